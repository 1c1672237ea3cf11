"""Histories of runs, to be compared."""

from __future__ import annotations

import csv
from pathlib import Path


def history_of(path: Path) -> list[dict[str, str]]:
    """The rows of a history.csv without the seconds that they took, which never repeat."""
    with path.open(encoding="utf-8") as file:
        return [{name: value for name, value in row.items() if name != "wall_seconds"} for row in csv.DictReader(file)]
