"""Axes of a report: how runs learned, and how champions hold up at the levels of a sweep.

Runs come as one table per variant: a row per place on the horizontal axis, a column per seed.
"""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import EngFormatter, MaxNLocator
from numpy.typing import NDArray

from exneat_cli.analysis.catalogue import Panel
from exneat_cli.analysis.statistics import bootstrap_interval
from exneat_cli.analysis.study import BEST, Study
from exneat_cli.analysis.styles import GREY, Look, tick_levels, variant_styles

Tables = dict[str, pd.DataFrame]
AXIS_LABELS = {
    "generation": "generation",
    "episodes": "training episodes",
    "env_steps": "environment steps (control steps)",
}
"""Column of history.csv -> label of the horizontal axis."""
MOST_POINTS = 100
"""Points of a curve beyond these could not be told apart, but each would cost a bootstrap."""
MARKERS_PER_CURVE = 8
_DASHED: Look = {"linestyle": "--", "linewidth": 1.2}
_BAR: Look = {"color": GREY, "linewidth": 2.4}


def draw_panel(kind: str, axes: Axes, panel: Panel, study: Study, axis: str) -> dict[str, int]:
    """Draw one panel of a figure on empty axes; returns the number of runs of each variant that it shows.

    Kinds are ``training`` (means of runs with 95% bands), ``training_runs`` (each run thin, means thick), ``area`` (one
    point per run, its mean over generations), ``robustness`` (means of runs with 95% bands; where a variant has more
    than `BEST` runs, dashed the mean of those best on validation) and ``cluster`` (one point per run at each level).
    Training curves run over `axis`, one of `AXIS_LABELS`.

    Raises:
        MissingRunsError: a variant has no finished run, or none has a finished sweep.
    """
    if kind in ("robustness", "cluster"):
        tables = _swept(panel, study)
        (_draw_levels if kind == "robustness" else _draw_clusters)(axes, panel, study, tables)
        score = "full reward" if panel.value == "full_reward" else study.fitness_name
        axes.set(xlabel=study.sweeps[str(panel.sweep)], ylabel=score)
        return {variant: table.shape[1] for variant, table in tables.items()}
    study.require(panel.condition, study.trained_variants)
    history = study.history(panel.condition)
    histories = {variant: history[history["variant"] == variant] for variant in study.trained_variants}
    if kind == "area":
        _draw_areas(axes, study, histories)
    else:
        _draw_curves(axes, study, histories, axis, each_run=kind == "training_runs")
    return {variant: own["seed"].nunique() for variant, own in histories.items()}


def common_curves(history: pd.DataFrame, axis: str) -> pd.DataFrame:
    """Bring the runs of one variant to common places on an axis: all that every run has reached and none has passed.

    Runs spend different numbers of control steps per generation. Between two generations a run keeps the
    value of the earlier one, which is what it had then.

    Returns:
        Best fitness so far: at most `MOST_POINTS` rows, one per place, and a column per seed.
    """
    best: pd.DataFrame = (
        history.pivot_table(index=axis, columns="seed", values="best_so_far", aggfunc="last").ffill().dropna()
    )
    shortest = history.groupby("seed")[axis].max().min()
    best = best[best.index <= max(shortest, best.index[0])]
    return best.iloc[np.unique(np.linspace(0, len(best) - 1, MOST_POINTS).round().astype(int))]


def _draw_curves(axes: Axes, study: Study, histories: Tables, axis: str, *, each_run: bool) -> None:
    for variant, look in variant_styles(study.trained_variants).items():
        curves = common_curves(histories[variant], axis)
        if each_run:
            for _, run in histories[variant].groupby("seed"):
                axes.plot(run[axis], run["best_so_far"], color=look["color"], linewidth=0.6, alpha=0.55, zorder=1)
        else:
            _draw_band(axes, curves, look)
        marks: Look = {"markevery": max(1, len(curves) // MARKERS_PER_CURVE), "linewidth": 2.6 if each_run else 1.8}
        axes.plot(curves.index, curves.mean(axis=1), label=study.variants[variant], **look, **marks)
    axes.set(xlabel=AXIS_LABELS[axis], ylabel=f"best {study.fitness_name} so far")
    if axis == "generation":
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    else:
        axes.xaxis.set_major_formatter(EngFormatter(sep=""))


def _draw_areas(axes: Axes, study: Study, histories: Tables) -> None:
    for place, (variant, look) in enumerate(variant_styles(study.trained_variants).items()):
        areas = histories[variant].groupby("seed")["best_so_far"].mean().to_frame().T
        _draw_points(axes, np.array([place]), areas, look, study.variants[variant], room=0.7, size=40)
    axes.plot([], [], label="bar: mean over runs", **_BAR)
    axes.set(xticks=[], xlabel="variant", ylabel=f"best {study.fitness_name} so far,\nmean over generations")
    axes.margins(x=0.08)


def _swept(panel: Panel, study: Study) -> Tables:
    """What the runs of each variant reached at each level; variants that were not swept are left out."""
    rows = study.robustness(panel.condition)
    rows = rows[rows["parameter"] == panel.sweep]
    if panel.highest is not None:
        rows = rows[rows["level"] <= panel.highest + 1e-9]
    score = f"{panel.value}_mean"
    tables = {
        variant: rows[rows["variant"] == variant].pivot_table(index="level", columns="seed", values=score)
        for variant in study.variants
        if (rows["variant"] == variant).any()
    }
    if not set(tables) & set(study.trained_variants):
        raise study.lacking(panel.condition, f"no finished sweep of {panel.sweep}")
    return tables


def _draw_levels(axes: Axes, panel: Panel, study: Study, tables: Tables) -> None:
    styles = variant_styles(study.variants, study.baselines)
    for variant, table in tables.items():
        axes.plot(table.index, table.mean(axis=1), label=study.variants[variant], **styles[variant])
        if variant in study.baselines:
            continue
        _draw_band(axes, table, styles[variant])
        if table.shape[1] > BEST:
            best = [run.seed for run in study.best_first(panel.condition, variant) if run.seed in table][:BEST]
            axes.plot(table.index, table[best].mean(axis=1), color=styles[variant]["color"], zorder=2, **_DASHED)
    if any(table.shape[1] > BEST for table in tables.values()):
        axes.plot([], [], color=GREY, label=f"mean of the {BEST} runs best on validation", **_DASHED)
    tick_levels(axes, (level for table in tables.values() for level in table.index))


def _draw_clusters(axes: Axes, panel: Panel, study: Study, tables: Tables) -> None:
    """Variants stand side by side at each level."""
    levels = sorted({level for table in tables.values() for level in table.index})
    trained = [variant for variant in tables if variant not in study.baselines]
    styles = variant_styles(study.variants, study.baselines)
    room = 0.8 / len(trained)
    for variant, table in tables.items():
        look, label = styles[variant], study.variants[variant]
        places = np.array([levels.index(level) for level in table.index], dtype=np.float64)
        if variant in study.baselines:
            line = {"color": look["color"], "linestyle": look["linestyle"]}
            axes.hlines(table.mean(axis=1), places - 0.45, places + 0.45, **line)
            axes.plot([], [], label=label, **line)
        else:
            aside = (trained.index(variant) - (len(trained) - 1) / 2) * room
            _draw_points(axes, places + aside, table, look, label, room, size=12)
    axes.plot([], [], label="bar: mean over runs", **_BAR)
    axes.set_xticks(range(len(levels)), [f"{level:g}" for level in levels])
    axes.set_xlim(-0.6, len(levels) - 0.4)
    axes.grid(visible=False, axis="x")


def _draw_band(axes: Axes, table: pd.DataFrame, look: Look) -> None:
    band = np.array([bootstrap_interval(runs[~np.isnan(runs)]) for runs in table.to_numpy()])
    if not np.isnan(band).all():
        axes.fill_between(table.index, band[:, 0], band[:, 1], color=look["color"], alpha=0.18, linewidth=0.0)


def _draw_points(
    axes: Axes, places: NDArray[np.float64], table: pd.DataFrame, look: Look, label: str, room: float, size: float
) -> None:
    """Draw a point per run within `room` of each place, from left to right by seed, and a bar for their mean."""
    count = table.shape[1]
    aside = np.linspace(-0.3, 0.3, count) * room if count > 1 else np.zeros(1)
    dots = {"color": look["color"], "marker": look["marker"], "label": label}
    axes.scatter((places[:, None] + aside).ravel(), table.to_numpy().ravel(), s=size, alpha=0.7, linewidths=0.0, **dots)
    axes.hlines(table.mean(axis=1), places - 0.42 * room, places + 0.42 * room, color=look["color"], linewidth=2.0)
