"""What tables show of a study, read off its runs and summarised."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
import pandas as pd

from exneat_cli.analysis.catalogue import Column
from exneat_cli.analysis.statistics import compare, efficiency, mean
from exneat_cli.analysis.study import BEST, Study

STATISTICS = ["mean", "low", "high", "iqm", "best_5"]
"""Columns of a summary that are in the unit of their quantity."""
_SUMMARY = ["experiment", "condition", "variant", "quantity", "runs", *STATISTICS, "p_holm", "a12", "efficiency"]


def summarise(study: Study, conditions: Iterable[str], columns: Mapping[str, Column]) -> pd.DataFrame:
    """Summarise the quantities named in `columns`, of every variant of the study; they are compared within conditions.

    Returns:
        One row per condition, quantity and variant. Columns: experiment, condition, variant, quantity, those of
        `compare`, best_5 (of robustness: mean over the `BEST` runs best on validation) and efficiency (text). Rows
        of efficiency count all finished runs and have no statistics.
    """
    parts = []
    for condition in conditions:
        measured = _measured(study, condition, columns)
        for name, column in columns.items():
            if column.of == "efficiency":
                runs = {variant: len(study.of(condition, variant)) for variant in study.variants}
                part = pd.DataFrame({"runs": runs, "efficiency": _efficiencies(study, condition)})
            else:
                groups = {variant: runs.droplevel(0) for variant, runs in measured[name].dropna().groupby(level=0)}
                values = {variant: groups.get(variant, pd.Series(dtype=float)) for variant in study.variants}
                part = compare({variant: each.to_numpy() for variant, each in values.items()}, study.baselines)
                part["efficiency"] = ""
                if column.of == "robustness":
                    part["best_5"] = [_mean_of_best(study, condition, *each) for each in values.items()]
            place = {"experiment": study.experiment, "condition": condition, "quantity": name}
            parts.append(part.rename_axis("variant").reset_index().assign(**place))
    return pd.concat(parts, ignore_index=True).reindex(columns=_SUMMARY)


def _measured(study: Study, condition: str, columns: Mapping[str, Column]) -> pd.DataFrame:
    """One row per finished run, indexed by variant and seed; one column per quantity, NaN where a run has none."""
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
            measured[name] = results[column.of]
    return measured


def _mean_of_best(study: Study, condition: str, variant: str, values: pd.Series) -> float:
    best = [values[run.seed] for run in study.best_first(condition, variant) if run.seed in values]
    return mean(best[:BEST])


def _efficiencies(study: Study, condition: str) -> dict[str, str]:
    """The generation at which each variant's mean curve reaches the final mean of the study's first variant.

    E.g. ``7``, ``>20`` if 20 were not enough, or nothing if the variant or the first one has no curve.
    """
    best = study.history(condition).groupby(["variant", "generation"])["best_so_far"].mean()
    curves = {variant: curve.to_numpy() for variant, curve in best.groupby("variant")}
    found = dict.fromkeys(study.variants, "")
    if study.first_variant in curves:
        target = float(curves[study.first_variant][-1])
        for variant, curve in curves.items():
            found[str(variant)] = str(efficiency(curve, target) or f">{len(curve)}")
    return found
