"""CSV tables, among them history.csv and robustness.csv; docs/run-directory.md says what their columns hold."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

from exneat_cli.errors import ExneatError, shortened
from exneat_cli.records.files import read_text, write_whole
from exneat_cli.records.plain import Count, Real, converted

HistoryRow = dict[str, int | float]
"""The figures of one generation, by column; see `COLUMNS`. An algorithm may add columns of its own."""

COLUMNS = (
    *("generation", "best_fitness", "mean_fitness", "median_fitness", "best_so_far", "episodes", "env_steps"),
    *("species", "connections", "hidden_nodes", "failed_episodes", "extinctions", "wall_seconds"),
)
"""Every column of history.csv that exneat itself knows, in the order of the file."""

HISTORY_COLUMNS = tuple(name for name in COLUMNS if name not in ("species", "extinctions"))
"""The columns that every history has."""

UNPERTURBED = "none"
"""Parameter of the row that holds a baseline's score when nothing is perturbed."""


class RobustnessRow(NamedTuple):
    """The score of a champion or a baseline at one level; `parameter` is the sweep's name, or `UNPERTURBED`."""

    variant: str
    run_seed: Count
    parameter: str
    level: Real
    episodes: Count
    fitness_mean: Real
    fitness_std: Real
    full_reward_mean: Real
    full_reward_std: Real


def write_csv(path: Path, columns: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Write a table; floats keep every digit, so equal numbers give equal bytes.

    Raises:
        ExneatError: the file cannot be written.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows([repr(float(v)) if isinstance(v, float) else v for v in row] for row in rows)
    write_whole(path, text.getvalue())


def write_history(path: Path, rows: Sequence[HistoryRow]) -> None:
    """Write all rows so far; columns that are not in `COLUMNS` come before the last.

    Raises:
        ExneatError: the file cannot be written.
    """
    *known, last = (name for name in COLUMNS if name in rows[0])
    columns = [*known, *(name for name in rows[0] if name not in COLUMNS), last]
    write_csv(path, columns, [[row[name] for name in columns] for row in rows])


def read_robustness(path: Path) -> list[RobustnessRow]:
    """All rows; none if the file is not there.

    Raises:
        ExneatError: the file is damaged.
    """
    rows = read_cells(path, RobustnessRow._fields)
    return converted(rows, list[RobustnessRow], f"{path}: damaged, at [row][column]", strict=False)


def read_cells(path: Path, fields: Sequence[str]) -> list[list[str]]:
    """The text of all rows below a heading of these columns; none if the file is not there.

    Raises:
        ExneatError: the file cannot be read, or has other columns.
    """
    if not path.exists():
        return []
    try:
        columns, *rows = csv.reader(io.StringIO(read_text(path), newline=""))
        if tuple(columns) != tuple(fields):
            raise ValueError(f"the columns {shortened(columns)}")
    except (csv.Error, ValueError) as error:
        raise ExneatError(f"{path}: expected a table of {', '.join(fields)}, got {error}") from error
    return rows


def merge_robustness(path: Path, rows: Sequence[RobustnessRow]) -> None:
    """Add rows to a file, in order; a new row replaces the old one of its parameter, level and number of episodes.

    Raises:
        ExneatError: the file is damaged or cannot be written.
    """
    merged = {(row.parameter, row.level, row.episodes): row for row in (*read_robustness(path), *rows)}
    order = sorted(merged, key=lambda key: (key[0] != UNPERTURBED, *key))
    write_csv(path, RobustnessRow._fields, [merged[key] for key in order])
