"""Fixtures that tests of several rooms use."""

from __future__ import annotations

import os
import random

import pytest

from exneat_cli.evolution import EvolutionSettings

os.environ.setdefault("MPLBACKEND", "Agg")


@pytest.fixture
def ant_settings() -> EvolutionSettings:
    return EvolutionSettings()


@pytest.fixture
def grid_settings() -> EvolutionSettings:
    """The settings of the grid worlds, with signed instead of absolute initial weights."""
    return EvolutionSettings(
        feed_forward=False,
        activation="relu",
        initial_connection="full_direct",
        neat_hidden=0,
        module_hidden=0,
        weight_sd=1.0,
        weight_power=0.5,
        weight_rate=0.8,
        weight_replace=0.1,
        bias_sd=0.0,
        bias_power=0.0,
        bias_rate=0.0,
        bias_replace=0.0,
        bound=30.0,
        connection_add=0.25,
        connection_delete=0.25,
        node_add=0.25,
        node_delete=0.25,
        disjoint_coefficient=1.1,
        weight_coefficient=1.1,
        elitism=10,
        survival=0.4,
        min_species_size=20,
        species_elitism=1,
    )


@pytest.fixture
def python_random() -> random.Random:
    return random.Random(20260101)
