"""history.csv: one row per generation."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from exneat_cli.records.files import write_csv

HistoryRow = dict[str, int | float]
"""The figures of one generation, by column; see `COLUMNS`. An algorithm may add columns of its own."""

COLUMNS = {
    "generation": "counted from 1",
    "best_fitness": "of the generation's teams that did not fail",
    "mean_fitness": "over the generation's teams",
    "median_fitness": "over the generation's teams",
    "best_so_far": "running maximum of best_fitness",
    "episodes": "training episodes since the run began",
    "env_steps": "training control steps since the run began",
    "species": "of ExNEAT and NEAT: sum over subpopulations",
    "connections": "enabled connections of the best team, each genome once",
    "hidden_nodes": "nodes of the best team that are not outputs, each genome once",
    "failed_episodes": "of this generation",
    "extinctions": "of ExNEAT and NEAT: subpopulations that were created anew for this generation",
    "wall_seconds": "since training began; the only column that differs between equal runs",
}
"""Every column that exneat itself knows, in the order of the file, and what it holds."""

HISTORY_COLUMNS = tuple(name for name in COLUMNS if name not in ("species", "extinctions"))
"""The columns that every history has."""


def write_history(path: Path, rows: Sequence[HistoryRow]) -> None:
    """Write all rows so far; columns that are not in `COLUMNS` come before the last.

    Raises:
        ExneatError: the file cannot be written.
    """
    *known, last = (name for name in COLUMNS if name in rows[0])
    columns = [*known, *(name for name in rows[0] if name not in COLUMNS), last]
    write_csv(path, columns, [[row[name] for name in columns] for row in rows])
