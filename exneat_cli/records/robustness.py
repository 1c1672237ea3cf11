"""robustness.csv: one row per perturbed setting and level."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from exneat_cli.errors import ExneatError, shortened
from exneat_cli.records.files import read_text, write_csv
from exneat_cli.records.plain import Count, Real, converted

UNPERTURBED = "none"
"""Parameter of the row that tells how a baseline does when nothing is perturbed."""


class RobustnessRow(NamedTuple):
    """How a champion or a baseline did at one level.

    Attributes:
        variant, run_seed: whose run it is.
        parameter: name of the sweep, e.g. ``sensor_noise``; or `UNPERTURBED`.
        level: of the swept setting, in its unit.
        episodes: how many were run.
        fitness_mean, fitness_std: over these episodes (population standard deviation).
        full_reward_mean, full_reward_std: the same of the task's second figure.
    """

    variant: str
    run_seed: Count
    parameter: str
    level: Real
    episodes: Count
    fitness_mean: Real
    fitness_std: Real
    full_reward_mean: Real
    full_reward_std: Real


def read_robustness(path: Path) -> list[RobustnessRow]:
    """All rows; none if the file is not there.

    Raises:
        ExneatError: the file is damaged.
    """
    if not path.exists():
        return []
    try:
        columns, *rows = csv.reader(io.StringIO(read_text(path), newline=""))
        if tuple(columns) != RobustnessRow._fields:
            raise ValueError(f"the columns {shortened(columns)}")
    except (csv.Error, ValueError) as error:
        raise ExneatError(f"{path}: expected a table of {', '.join(RobustnessRow._fields)}, got {error}") from error
    return converted(rows, list[RobustnessRow], f"{path}: damaged, at [row][column]", strict=False)


def merge_robustness(path: Path, rows: Sequence[RobustnessRow]) -> None:
    """Add rows to a file, in order; a new row replaces the old one of its parameter, level and number of episodes.

    Raises:
        ExneatError: the file is damaged or cannot be written.
    """
    merged = {(row.parameter, row.level, row.episodes): row for row in (*read_robustness(path), *rows)}
    order = sorted(merged, key=lambda key: (key[0] != UNPERTURBED, *key))
    write_csv(path, RobustnessRow._fields, [merged[key] for key in order])
