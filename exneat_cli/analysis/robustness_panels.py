"""Axes that show how champions hold up: a swept level against what they earn there."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from numpy.typing import NDArray

from exneat_cli.analysis.catalogue import Panel
from exneat_cli.analysis.figures import tick_levels
from exneat_cli.analysis.quantities import BEST, best_on_validation
from exneat_cli.analysis.statistics import bootstrap_interval
from exneat_cli.analysis.study import MissingRunsError, Study
from exneat_cli.analysis.variant_styles import VariantStyle, variant_styles

_ROUNDING = 1e-9
_ANY_VARIANT = "#444444"


def draw_levels(axes: Axes, panel: Panel, study: Study) -> dict[str, int]:
    """Each variant's mean over runs at each level, with its 95% band; returns the number of runs of each variant.

    The dashed line of a variant is the mean over its `BEST` runs best on validation. It is left out
    where there are no more runs than that. Baselines are grey lines.

    Raises:
        MissingRunsError: no trained variant has a finished sweep.
    """
    tables = swept_runs(panel, study)
    styles = variant_styles(study.variants, study.baselines)
    some_are_chosen = False
    for variant, table in tables.items():
        axes.plot(table.index, table.mean(axis=1), label=study.variants[variant], **styles[variant].mean)
        if variant in study.baselines:
            continue
        _draw_band(axes, table, styles[variant].colour)
        if table.shape[1] > BEST:
            ranked = [seed for seed in best_on_validation(study, panel.condition, variant) if seed in table]
            mean = table[ranked[:BEST]].mean(axis=1)
            axes.plot(table.index, mean, "--", color=styles[variant].colour, linewidth=1.2, zorder=2)
            some_are_chosen = True
    if some_are_chosen:
        label = f"mean of the {BEST} runs best on validation"
        axes.plot([], [], "--", color=_ANY_VARIANT, linewidth=1.2, label=label)
    tick_levels(axes, (level for table in tables.values() for level in table.index))
    _label(axes, panel, study)
    return {variant: table.shape[1] for variant, table in tables.items()}


def draw_clusters(axes: Axes, panel: Panel, study: Study) -> dict[str, int]:
    """One point per run at each level, variants side by side; returns the number of runs of each variant.

    Raises:
        MissingRunsError: no trained variant has a finished sweep.
    """
    tables = swept_runs(panel, study)
    levels = sorted({level for table in tables.values() for level in table.index})
    trained = [variant for variant in tables if variant not in study.baselines]
    styles = variant_styles(study.variants, study.baselines)
    room = 0.8 / len(trained)
    for variant, table in tables.items():
        style, label = styles[variant], study.variants[variant]
        places = np.array([levels.index(level) for level in table.index], dtype=np.float64)
        if variant in study.baselines:
            axes.hlines(table.mean(axis=1), places - 0.45, places + 0.45, color=style.colour, linestyle=style.line)
            axes.plot([], [], linestyle=style.line, color=style.colour, label=label)
        else:
            places += (trained.index(variant) - (len(trained) - 1) / 2) * room
            _draw_cluster(axes, places, table, style, label, room)
    axes.plot([], [], color=_ANY_VARIANT, linewidth=2.4, label="bar: mean over runs")
    _label(axes, panel, study)
    axes.set_xticks(range(len(levels)), [f"{level:g}" for level in levels])
    axes.set_xlim(-0.6, len(levels) - 0.4)
    axes.grid(visible=False, axis="x")
    return {variant: table.shape[1] for variant, table in tables.items()}


def _draw_band(axes: Axes, table: pd.DataFrame, colour: str) -> None:
    band = np.array([bootstrap_interval(runs[~np.isnan(runs)]) for runs in table.to_numpy()])
    if not np.isnan(band).all():
        axes.fill_between(table.index, band[:, 0], band[:, 1], color=colour, alpha=0.18, linewidth=0.0)


def _draw_cluster(
    axes: Axes, places: NDArray[np.float64], table: pd.DataFrame, style: VariantStyle, label: str, room: float
) -> None:
    """Runs stand from left to right in the order of their seeds, so that equal ones do not hide each other."""
    count = table.shape[1]
    aside = np.linspace(-0.3, 0.3, count) * room if count > 1 else np.zeros(1)
    x = (places[:, None] + aside).ravel()
    look: dict[str, Any] = {"color": style.colour, "marker": style.marker, "label": label}
    axes.scatter(x, table.to_numpy().ravel(), s=12, alpha=0.7, linewidths=0.0, **look)
    means = table.mean(axis=1)
    axes.hlines(means, places - 0.42 * room, places + 0.42 * room, color=style.colour, linewidth=2.0)


def swept_runs(panel: Panel, study: Study) -> dict[str, pd.DataFrame]:
    """What the runs of each variant earned: one row per level, one column per seed.

    Variants without a row of the sweep are left out, as not every variant is swept.

    Raises:
        MissingRunsError: no trained variant is left.
    """
    tables = {variant: _table(panel, study.robustness(panel.condition, variant)) for variant in study.variants}
    tables = {variant: table for variant, table in tables.items() if not table.empty}
    if not any(variant in tables for variant in study.trained_variants):
        place = f"{study.experiment}, {panel.condition}, budget {study.budget}"
        raise MissingRunsError(f"{place}: no finished sweep of {panel.sweep}\n  {study.command}")
    return tables


def _table(panel: Panel, rows: pd.DataFrame) -> pd.DataFrame:
    if rows.empty:
        return rows
    rows = rows[rows["parameter"] == panel.sweep]
    if panel.highest is not None:
        rows = rows[rows["level"] <= panel.highest + _ROUNDING]
    return rows.pivot_table(index="level", columns="seed", values=f"{panel.value}_mean")


def _label(axes: Axes, panel: Panel, study: Study) -> None:
    assert panel.sweep is not None
    earned = "full reward" if panel.value == "full_reward" else study.fitness_name
    axes.set(xlabel=study.sweeps[panel.sweep], ylabel=earned)
