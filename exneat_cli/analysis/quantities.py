"""The figures that tables show, read off the runs of a study."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import pandas as pd

from exneat_cli.analysis.catalogue import Column
from exneat_cli.analysis.statistics import FloatArray, efficiency
from exneat_cli.analysis.study import MissingRunsError, Study

BEST = 5
"""How many runs of each variant the thesis tests: those best on validation; Zhang (2025), table 5.5."""


def per_run(study: Study, condition: str, variant: str, column: Column) -> dict[int, float]:
    """Seed -> figure, in the order of seeds, for the finished runs that have one; may be empty.

    A column of training, test or robustness can be asked for; efficiency is a figure of a variant, not of a run.
    """
    if column.of == "robustness":
        return _at_level(study.robustness(condition, variant), column)
    of = "full_reward" if (column.of, column.value) == ("test", "full_reward") else column.of
    return _by_seed(study.results(condition, variant), of)


def _at_level(table: pd.DataFrame, column: Column) -> dict[int, float]:
    if table.empty:
        return {}
    here = (table["parameter"] == column.sweep) & np.isclose(table["level"], float(column.level or 0.0))
    return _by_seed(table[here], f"{column.value}_mean")


def _by_seed(table: pd.DataFrame, column: str) -> dict[int, float]:
    rows = table[["seed", column]].astype({column: float}).dropna()
    return {int(seed): float(figure) for seed, figure in zip(rows["seed"], rows[column], strict=True)}


def require_level(study: Study, condition: str, variants: Iterable[str], column: Column) -> None:
    """Check that every one of `variants` was tested at the sweep and level of a robustness column.

    Raises:
        MissingRunsError: one has no run that was.
    """
    missing = [study.variants[variant] for variant in variants if not per_run(study, condition, variant, column)]
    if missing:
        what = f"{study.experiment}, {condition}, budget {study.budget}: sweep {column.sweep}, level {column.level}"
        raise MissingRunsError(f"{what}: not measured for {', '.join(missing)}\n  {study.command}")


def best_on_validation(study: Study, condition: str, variant: str) -> list[int]:
    """Seeds of the variant's runs from the best on validation down; equal ones by seed, those without a figure last."""
    results = study.results(condition, variant).sort_values("seed")
    return [int(seed) for seed in results.sort_values("validation", ascending=False, kind="stable")["seed"]]


def mean_curve(study: Study, condition: str, variant: str) -> FloatArray:
    """Best so far over generations, mean of the variant's finished runs; shape (generations,), empty without runs."""
    history = study.history(condition, variant)
    if history.empty:
        return np.empty(0)
    return history.groupby("generation")["best_so_far"].mean().to_numpy(dtype=np.float64)


def efficiency_of(study: Study, condition: str, variant: str) -> str:
    """First generation at which the variant's mean curve reaches the final mean of the study's first variant.

    Returns:
        e.g. ``7``, ``>20`` if 20 generations were not enough, or nothing if either has no curve.
    """
    first = next(iter(study.variants))
    if {first, variant} & set(study.baselines):
        return ""
    curve, target = mean_curve(study, condition, variant), mean_curve(study, condition, first)
    if not len(curve) or not len(target):
        return ""
    generation = efficiency(curve, float(target[-1]))
    return f">{len(curve)}" if generation is None else str(generation)
