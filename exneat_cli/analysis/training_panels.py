"""Axes that show how runs learned: means with bands, each run, and the area under each run's curve."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import EngFormatter, MaxNLocator
from numpy.typing import NDArray

from exneat_cli.analysis.catalogue import Panel
from exneat_cli.analysis.statistics import bootstrap_interval
from exneat_cli.analysis.study import Study
from exneat_cli.analysis.variant_styles import VariantStyle, variant_styles

AXIS_LABELS = {
    "generation": "generation",
    "episodes": "training episodes",
    "env_steps": "environment steps (control steps)",
}
"""Column of history.csv -> label of the horizontal axis."""
MOST_POINTS = 100
"""Points of a curve beyond these could not be told apart, but each would cost a bootstrap."""
MARKERS_PER_CURVE = 8


class Curves(NamedTuple):
    """Best fitness so far of the runs of one variant.

    Attributes:
        x: (P,) places on the horizontal axis that every run has reached and none has passed.
        values: (R, P) of each run there.
    """

    x: NDArray[np.float64]
    values: NDArray[np.float64]


def common_curves(history: pd.DataFrame, axis: str) -> Curves:
    """The curves of one variant's runs at common places.

    Runs spend different numbers of control steps per generation. Between two generations a run keeps the
    value of the earlier one, which is what it had then.

    Args:
        history: of at least one run, with a column ``seed``.
        axis: a key of `AXIS_LABELS`.
    """
    runs = [run.sort_values("generation") for _, run in history.groupby("seed")]
    places = [run[axis].to_numpy(dtype=np.float64) for run in runs]
    low = max(x[0] for x in places)
    high = max(low, min(x[-1] for x in places))
    every = np.unique(np.concatenate(places))
    every = every[(every >= low) & (every <= high)]
    kept = np.unique(np.linspace(0, len(every) - 1, MOST_POINTS).round().astype(np.int64))
    x = every[kept]
    best = [run["best_so_far"].to_numpy(dtype=np.float64) for run in runs]
    return Curves(x, np.stack([y[np.searchsorted(own, x, "right") - 1] for own, y in zip(places, best, strict=True)]))


def draw_means(axes: Axes, panel: Panel, study: Study, axis: str) -> dict[str, int]:
    """Each variant's mean over runs with its 95% band; returns the number of runs of each variant.

    Raises:
        MissingRunsError: a variant has no finished run.
    """
    counts = {}
    for variant, style, curves in _curves_of_variants(panel, study, axis):
        band = np.array([bootstrap_interval(column) for column in curves.values.T])
        if not np.isnan(band).all():
            axes.fill_between(curves.x, band[:, 0], band[:, 1], color=style.colour, alpha=0.18, linewidth=0.0)
        _draw_mean(axes, curves, style, study.variants[variant])
        counts[variant] = len(curves.values)
    _label(axes, study, axis)
    return counts


def draw_each_run(axes: Axes, panel: Panel, study: Study, axis: str) -> dict[str, int]:
    """Each run as a thin line, each variant's mean as a thick one; returns the number of runs of each variant.

    Raises:
        MissingRunsError: a variant has no finished run.
    """
    counts = {}
    for variant, style, curves in _curves_of_variants(panel, study, axis):
        for _, run in study.history(panel.condition, variant).groupby("seed"):
            axes.plot(run[axis], run["best_so_far"], color=style.colour, linewidth=0.6, alpha=0.55, zorder=1)
        _draw_mean(axes, curves, style, study.variants[variant], width=2.6)
        counts[variant] = len(curves.values)
    _label(axes, study, axis)
    return counts


def draw_areas(axes: Axes, panel: Panel, study: Study, axis: str) -> dict[str, int]:
    """The mean over generations of each run's best so far, one point per run; returns the numbers of runs.

    Raises:
        MissingRunsError: a variant has no finished run.
    """
    study.require(panel.condition, study.trained_variants)
    styles = variant_styles(study.variants, study.baselines)
    counts = {}
    for place, variant in enumerate(study.trained_variants):
        history = study.history(panel.condition, variant)
        areas = history.groupby("seed")["best_so_far"].mean().to_numpy()
        offsets = np.linspace(-0.2, 0.2, len(areas)) if len(areas) > 1 else np.zeros(1)
        style = styles[variant]
        axes.scatter(
            place + offsets,
            areas,
            s=26,
            marker=style.marker,
            color=style.colour,
            alpha=0.75,
            label=study.variants[variant],
        )
        axes.hlines(areas.mean(), place - 0.32, place + 0.32, color=style.colour, linewidth=3.0)
        counts[variant] = len(areas)
    axes.plot([], [], color="#444444", linewidth=3.0, label="bar: mean over runs")
    axes.set(xticks=[], xlabel="variant", ylabel=f"best {study.fitness_name} so far,\nmean over generations")
    axes.margins(x=0.08)
    return counts


def _curves_of_variants(panel: Panel, study: Study, axis: str) -> list[tuple[str, VariantStyle, Curves]]:
    study.require(panel.condition, study.trained_variants)
    styles = variant_styles(study.variants, study.baselines)
    return [
        (variant, styles[variant], common_curves(study.history(panel.condition, variant), axis))
        for variant in study.trained_variants
    ]


def _draw_mean(axes: Axes, curves: Curves, style: VariantStyle, label: str, width: float = 1.8) -> None:
    every = max(1, len(curves.x) // MARKERS_PER_CURVE)
    axes.plot(curves.x, curves.values.mean(axis=0), linewidth=width, markevery=every, label=label, **style.mean)


def _label(axes: Axes, study: Study, axis: str) -> None:
    axes.set(xlabel=AXIS_LABELS[axis], ylabel=f"best {study.fitness_name} so far")
    if axis == "generation":
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    else:
        axes.xaxis.set_major_formatter(EngFormatter(sep=""))
