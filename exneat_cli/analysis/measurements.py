"""What tables show of a study: one row per run, and one summary of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
import pandas as pd

from exneat_cli.analysis.catalogue import Column
from exneat_cli.analysis.statistics import compare, efficiency, mean
from exneat_cli.analysis.study import BEST, Study

STATISTICS = ["mean", "low", "high", "iqm", "best_5"]
"""Columns of a summary that are in the unit of their quantity."""
SUMMARY = ["experiment", "condition", "variant", "quantity", "runs", *STATISTICS, "p_holm", "a12", "efficiency"]


def measure(study: Study, condition: str, columns: Mapping[str, Column]) -> pd.DataFrame:
    """Collect what the finished runs of one condition reached.

    Args:
        study: whose runs they are.
        condition: one of its conditions.
        columns: name of a quantity -> what it is. Efficiency is passed over: a variant has one, a run has none.

    Returns:
        One row per run, indexed by variant and seed; one column per quantity, NaN where a run has none.
    """
    results = study.results[study.results["condition"] == condition].set_index(["variant", "seed"])
    measured = pd.DataFrame(index=results.index)
    if any(column.of == "robustness" for column in columns.values()):
        swept = study.robustness(condition).set_index(["variant", "seed"])
    for name, column in columns.items():
        if column.of == "robustness":
            level = np.isclose(swept["level"].astype(float), float(column.level or 0.0))
            here = swept.loc[level & (swept["parameter"] == column.sweep), f"{column.value}_mean"]
            measured[name] = here[~here.index.duplicated(keep="last")].astype(float)
        elif column.of != "efficiency":
            is_full = column.of == "test" and column.value == "full_reward"
            measured[name] = results["full_reward" if is_full else column.of]
    return measured


def efficiencies(study: Study, condition: str) -> dict[str, str]:
    """Find when the mean curve of each variant reaches the final mean of the study's first variant.

    Returns:
        variant -> a generation, counted from 1: e.g. ``7``, ``>20`` if 20 were not enough, or nothing if the variant
        or the first one has no curve.
    """
    best = study.history(condition).groupby(["variant", "generation"])["best_so_far"].mean()
    curves = {variant: curve.to_numpy() for variant, curve in best.groupby("variant")}
    found = dict.fromkeys(study.variants, "")
    if study.first_variant in curves:
        target = float(curves[study.first_variant][-1])
        for variant, curve in curves.items():
            found[str(variant)] = str(efficiency(curve, target) or f">{len(curve)}")
    return found


def summarise(study: Study, conditions: Iterable[str], columns: Mapping[str, Column]) -> pd.DataFrame:
    """Summarise every quantity of every variant in each condition, measured or not.

    Args:
        study: what was run.
        conditions: some of its conditions; variants are compared within each.
        columns: name of a quantity -> what it is.

    Returns:
        One row per condition, quantity and variant. Columns: experiment, condition, variant, quantity, those of
        `compare`, best_5 (of robustness: mean over the `BEST` runs best on validation) and efficiency (see
        `efficiencies`). Rows of efficiency count all finished runs and have no statistics.
    """
    parts = []
    for condition in conditions:
        measured = measure(study, condition, columns)
        for name, column in columns.items():
            if column.of == "efficiency":
                runs = {variant: len(study.of(condition, variant)) for variant in study.variants}
                part = pd.DataFrame({"runs": runs, "efficiency": efficiencies(study, condition)})
            else:
                part = _compared(study, condition, measured[name].dropna(), is_robustness=column.of == "robustness")
            place = {"experiment": study.experiment, "condition": condition, "quantity": name}
            parts.append(part.rename_axis("variant").reset_index().assign(**place))
    return pd.concat(parts, ignore_index=True).reindex(columns=SUMMARY).fillna({"efficiency": ""})


def _compared(study: Study, condition: str, values: pd.Series, *, is_robustness: bool) -> pd.DataFrame:
    seeds = {variant: values[values.index.get_level_values("variant") == variant] for variant in study.variants}
    by_variant = {variant: each.droplevel("variant") for variant, each in seeds.items()}
    table = compare({variant: each.to_numpy() for variant, each in by_variant.items()}, study.baselines)
    if is_robustness:
        table["best_5"] = [_mean_of_best(study, condition, variant, each) for variant, each in by_variant.items()]
    return table


def _mean_of_best(study: Study, condition: str, variant: str, values: pd.Series) -> float:
    best = [values[run.seed] for run in study.best_first(condition, variant) if run.seed in values]
    return mean(best[:BEST])
