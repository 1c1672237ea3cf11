"""Fixtures that tests of several rooms use."""

from __future__ import annotations

import os

import pytest

from exneat_cli.algorithms import RECURRENT, EvolutionSettings

os.environ.setdefault("MPLBACKEND", "Agg")


@pytest.fixture
def ant_settings() -> EvolutionSettings:
    return EvolutionSettings()


@pytest.fixture
def grid_settings() -> EvolutionSettings:
    """The settings of the grid worlds."""
    return RECURRENT
