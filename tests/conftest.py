"""Fixtures that tests of several rooms use."""

from __future__ import annotations

import os
from collections.abc import Iterator

import pytest

from tests.commands.figures import without_figures

os.environ.setdefault("MPLBACKEND", "Agg")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    # The longest file first, so that no worker ends alone with it while the others wait.
    items.sort(key=lambda item: item.path.name != "test_report.py")


@pytest.fixture
def no_figures() -> Iterator[None]:
    """See `without_figures`."""
    with without_figures():
        yield
