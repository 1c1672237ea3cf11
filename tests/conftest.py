"""Fixtures that tests of several rooms use."""

from __future__ import annotations

import os

import pytest

from exneat_cli.algorithms import RECURRENT, EvolutionSettings

os.environ.setdefault("MPLBACKEND", "Agg")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    # The longest file first, so that no worker ends alone with it while the others wait.
    items.sort(key=lambda item: item.path.name != "test_report.py")


@pytest.fixture
def ant_settings() -> EvolutionSettings:
    return EvolutionSettings()


@pytest.fixture
def grid_settings() -> EvolutionSettings:
    """The settings of the grid worlds."""
    return RECURRENT
