"""robustness.csv: one row per perturbed setting and level."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from exneat_cli.errors import ExneatError
from exneat_cli.records.files import write_csv

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
    run_seed: int
    parameter: str
    level: float
    episodes: int
    fitness_mean: float
    fitness_std: float
    full_reward_mean: float
    full_reward_std: float


def read_robustness(path: Path) -> list[RobustnessRow]:
    """All rows; none if the file is not there.

    Raises:
        ExneatError: the file is damaged.
    """
    if not path.exists():
        return []
    try:
        with path.open(encoding="utf-8", newline="") as file:
            rows = list(csv.reader(file))
        if not rows or tuple(rows[0]) != RobustnessRow._fields:
            raise ValueError("other columns")
        return [_row(values) for values in rows[1:]]
    except (OSError, ValueError, TypeError) as error:
        raise ExneatError(f"{path}: expected a table of {', '.join(RobustnessRow._fields)}: {error}") from error


def _row(values: Sequence[str]) -> RobustnessRow:
    variant, seed, parameter, level, episodes, *figures = values
    numbers = [float(figure) for figure in figures]
    if not all(math.isfinite(number) for number in (float(level), *numbers)):
        raise ValueError(f"a number is not finite in the row of {parameter} {level}")
    return RobustnessRow(variant, int(seed), parameter, float(level), int(episodes), *numbers)


def merge_robustness(path: Path, rows: Sequence[RobustnessRow]) -> None:
    """Add rows to a file, in order; a new row replaces the old one of its parameter, level and number of episodes.

    Raises:
        ExneatError: the file is damaged or cannot be written.
    """
    merged = {(row.parameter, row.level, row.episodes): row for row in (*read_robustness(path), *rows)}
    order = sorted(merged, key=lambda key: (key[0] != UNPERTURBED, *key))
    write_csv(path, RobustnessRow._fields, [merged[key] for key in order])
