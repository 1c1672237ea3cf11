"""Axes of a report: how runs learned, and how champions hold up at the levels of a sweep.

Every function draws on empty axes and returns how many runs of each variant it shows. It takes them as one table per
variant: a row per place on the horizontal axis, a column per seed.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import EngFormatter, MaxNLocator
from numpy.typing import NDArray

from exneat_cli.analysis.catalogue import Panel
from exneat_cli.analysis.figures import GREY, tick_levels
from exneat_cli.analysis.measurements import BEST
from exneat_cli.analysis.statistics import bootstrap_interval
from exneat_cli.analysis.study import Study
from exneat_cli.analysis.variant_styles import Look, variant_styles

AXIS_LABELS = {
    "generation": "generation",
    "episodes": "training episodes",
    "env_steps": "environment steps (control steps)",
}
"""Column of history.csv -> label of the horizontal axis."""
MOST_POINTS = 100
"""Points of a curve beyond these could not be told apart, but each would cost a bootstrap."""
MARKERS_PER_CURVE = 8
_ROUNDING = 1e-9


def draw_means(axes: Axes, panel: Panel, study: Study, axis: str) -> dict[str, int]:
    """Draw each variant's mean over runs with its 95% band, over one of `AXIS_LABELS`.

    Raises:
        MissingRunsError: a variant has no finished run.
    """
    return _draw_training(axes, panel, study, axis, each_run=False)


def draw_each_run(axes: Axes, panel: Panel, study: Study, axis: str) -> dict[str, int]:
    """Draw each run as a thin line and each variant's mean as a thick one, over one of `AXIS_LABELS`.

    Raises:
        MissingRunsError: a variant has no finished run.
    """
    return _draw_training(axes, panel, study, axis, each_run=True)


def _draw_training(axes: Axes, panel: Panel, study: Study, axis: str, *, each_run: bool) -> dict[str, int]:
    counts = {}
    styles = variant_styles(study.variants)
    for variant, history in _histories(panel, study).items():
        look, curves = styles[variant], common_curves(history, axis)
        if each_run:
            for _, run in history.groupby("seed"):
                axes.plot(run[axis], run["best_so_far"], color=look["color"], linewidth=0.6, alpha=0.55, zorder=1)
        else:
            _draw_band(axes, curves, look)
        every = max(1, len(curves) // MARKERS_PER_CURVE)
        width, label = (2.6 if each_run else 1.8), study.variants[variant]
        axes.plot(curves.index, curves.mean(axis=1), linewidth=width, markevery=every, label=label, **look)
        counts[variant] = curves.shape[1]
    axes.set(xlabel=AXIS_LABELS[axis], ylabel=f"best {study.fitness_name} so far")
    if axis == "generation":
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    else:
        axes.xaxis.set_major_formatter(EngFormatter(sep=""))
    return counts


def draw_areas(axes: Axes, panel: Panel, study: Study) -> dict[str, int]:
    """Draw one point per run, the mean over generations of its best so far.

    Raises:
        MissingRunsError: a variant has no finished run.
    """
    counts = {}
    styles = variant_styles(study.variants)
    for place, (variant, history) in enumerate(_histories(panel, study).items()):
        areas = history.groupby("seed")["best_so_far"].mean().to_frame().T
        _draw_points(axes, np.array([place]), areas, styles[variant], study.variants[variant], room=0.7, size=40)
        counts[variant] = areas.shape[1]
    _explain_bars(axes)
    axes.set(xticks=[], xlabel="variant", ylabel=f"best {study.fitness_name} so far,\nmean over generations")
    axes.margins(x=0.08)
    return counts


def _histories(panel: Panel, study: Study) -> dict[str, pd.DataFrame]:
    study.require(panel.condition, study.trained_variants)
    history = study.history(panel.condition)
    return {variant: history[history["variant"] == variant] for variant in study.trained_variants}


def common_curves(history: pd.DataFrame, axis: str) -> pd.DataFrame:
    """Bring the runs of one variant to common places: all that every run has reached and none has passed.

    Runs spend different numbers of control steps per generation. Between two generations a run keeps the
    value of the earlier one, which is what it had then.

    Args:
        history: of at least one run, with a column ``seed``.
        axis: a key of `AXIS_LABELS`.

    Returns:
        Best fitness so far: at most `MOST_POINTS` rows, one per place, and a column per seed.
    """
    best = history.pivot_table(index=axis, columns="seed", values="best_so_far", aggfunc="last").ffill().dropna()
    shortest = history.groupby("seed")[axis].max().min()
    reached = best[best.index <= max(shortest, best.index[0])]
    return reached.iloc[np.unique(np.linspace(0, len(reached) - 1, MOST_POINTS).round().astype(int))]


def draw_levels(axes: Axes, panel: Panel, study: Study) -> dict[str, int]:
    """Draw each variant's mean over runs at each level, with its 95% band; baselines are grey lines.

    The dashed line of a variant is the mean over its `BEST` runs best on validation. It is left out
    where there are no more runs than that.

    Raises:
        MissingRunsError: no trained variant has a finished sweep.
    """
    tables = _swept(panel, study)
    styles = variant_styles(study.variants, study.baselines)
    dashes = {"linestyle": "--", "linewidth": 1.2}
    some_are_chosen = False
    for variant, table in tables.items():
        axes.plot(table.index, table.mean(axis=1), label=study.variants[variant], **styles[variant])
        if variant in study.baselines:
            continue
        _draw_band(axes, table, styles[variant])
        if table.shape[1] > BEST:
            best = [run.seed for run in study.best_first(panel.condition, variant) if run.seed in table][:BEST]
            axes.plot(table.index, table[best].mean(axis=1), color=styles[variant]["color"], zorder=2, **dashes)
            some_are_chosen = True
    if some_are_chosen:
        axes.plot([], [], color=GREY, label=f"mean of the {BEST} runs best on validation", **dashes)
    tick_levels(axes, (level for table in tables.values() for level in table.index))
    _label_sweep(axes, panel, study)
    return _counts(tables)


def draw_clusters(axes: Axes, panel: Panel, study: Study) -> dict[str, int]:
    """Draw one point per run at each level, variants side by side.

    Raises:
        MissingRunsError: no trained variant has a finished sweep.
    """
    tables = _swept(panel, study)
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
    _explain_bars(axes)
    _label_sweep(axes, panel, study)
    axes.set_xticks(range(len(levels)), [f"{level:g}" for level in levels])
    axes.set_xlim(-0.6, len(levels) - 0.4)
    axes.grid(visible=False, axis="x")
    return _counts(tables)


def _swept(panel: Panel, study: Study) -> dict[str, pd.DataFrame]:
    """What the runs of each variant reached at each level; variants that were not swept are left out."""
    rows = study.robustness(panel.condition)
    rows = rows[rows["parameter"] == panel.sweep]
    if panel.highest is not None:
        rows = rows[rows["level"] <= panel.highest + _ROUNDING]
    tables = {
        variant: rows[rows["variant"] == variant].pivot_table(
            index="level", columns="seed", values=f"{panel.value}_mean"
        )
        for variant in study.variants
        if (rows["variant"] == variant).any()
    }
    if not set(tables) & set(study.trained_variants):
        raise study.lacking(panel.condition, f"no finished sweep of {panel.sweep}")
    return tables


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
    x = (places[:, None] + aside).ravel()
    dots = {"color": look["color"], "marker": look["marker"], "label": label}
    axes.scatter(x, table.to_numpy().ravel(), s=size, alpha=0.7, linewidths=0.0, **dots)
    axes.hlines(table.mean(axis=1), places - 0.42 * room, places + 0.42 * room, color=look["color"], linewidth=2.0)


def _explain_bars(axes: Axes) -> None:
    axes.plot([], [], color=GREY, linewidth=2.4, label="bar: mean over runs")


def _label_sweep(axes: Axes, panel: Panel, study: Study) -> None:
    score = "full reward" if panel.value == "full_reward" else study.fitness_name
    axes.set(xlabel=study.sweeps[str(panel.sweep)], ylabel=score)


def _counts(tables: Mapping[str, pd.DataFrame]) -> dict[str, int]:
    return {variant: table.shape[1] for variant, table in tables.items()}
