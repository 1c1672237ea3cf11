"""One panel of a report's figure: curves, bands, bars and points of all variants on empty axes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib import rcParams
from matplotlib.axes import Axes
from matplotlib.ticker import EngFormatter, MaxNLocator
from numpy.typing import NDArray

from exneat_cli.analysis.catalogue import Panel
from exneat_cli.analysis.statistics import bootstrap_interval
from exneat_cli.analysis.study import BEST, Study
from exneat_cli.analysis.styles import AS_TRAINED, GREY, Look, tick_levels

Tables = dict[str, pd.DataFrame]
"""Variant -> what its runs reached: a row per place on the horizontal axis, a column per seed."""
Looks = Mapping[str, Look]
_AXIS_LABELS = {
    "generation": "generation",
    "episodes": "training episodes",
    "env_steps": "environment steps (control steps)",
}
"""Column of history.csv -> label of the horizontal axis."""
AXES = tuple(_AXIS_LABELS)
"""What the horizontal axis of a training curve can be."""
MOST_POINTS = 100
"""At most this many points of a curve: more could not be told apart, but each costs a bootstrap."""
MARKERS_PER_CURVE = 8
OF_VARIANT = "\u200b"
"""Marks, unseen, the beginning of a variant's label; matplotlib leaves out labels that begin with an underscore."""
_DASHED: Look = {"linestyle": "--", "linewidth": 1.2}
_BAR: Look = {"color": GREY, "linewidth": 2.4}


def draw_panel(kind: str, axes: Axes, panel: Panel, study: Study, looks: Looks, axis: str) -> dict[str, int]:
    """Draw one panel of a figure on empty axes; returns the number of runs of each variant that it shows.

    Kinds are ``training`` (means of runs with 95% bands), ``training_runs`` (each run thin, means thick), ``area`` (one
    point per run, its mean over generations), ``robustness`` (means of runs with 95% bands; where a variant has more
    than `BEST` runs, also the mean of those best on validation, dashed) and ``cluster`` (one point per run and level).
    Training curves run over `axis`, one of `AXES`. `looks` are those of all variants.

    Raises:
        MissingRunsError: a variant has no finished run, or none has a finished sweep.
    """
    if kind in ("robustness", "cluster"):
        tables = _swept(panel, study)
        (_draw_levels if kind == "robustness" else _draw_clusters)(axes, panel, study, tables, looks)
        score = "full reward" if panel.value == "full_reward" else study.fitness_name
        axes.set(xlabel=study.sweeps[str(panel.sweep)], ylabel=score)
    else:
        study.require(panel.condition, study.trained_variants)
        tables = _tables(study.history(panel.condition), study.trained_variants, axis, "best_so_far")
        if kind == "area":
            _draw_areas(axes, study, tables, looks)
        else:
            _draw_curves(axes, study, tables, looks, axis, each_run=kind == "training_runs")
    return {variant: table.shape[1] for variant, table in tables.items()}


def _tables(rows: pd.DataFrame, variants: Iterable[str], place: str, score: str) -> Tables:
    found = {variant: rows[rows["variant"] == variant] for variant in variants}
    return {v: own.pivot_table(index=place, columns="seed", values=score) for v, own in found.items() if len(own)}


def common_curves(curves: pd.DataFrame) -> pd.DataFrame:
    """Bring the runs of one variant to common places on an axis, up to where the first run ends.

    Runs spend different numbers of control steps per generation. Between two generations a run keeps the value of the
    earlier one, which is what it had then. At most `MOST_POINTS` places are kept.
    """
    shortest = min(curves[seed].dropna().index.max() for seed in curves)
    common: pd.DataFrame = curves.ffill().dropna()
    common = common[common.index <= max(shortest, common.index[0])]
    return common.iloc[np.unique(np.linspace(0, len(common) - 1, MOST_POINTS).round().astype(int))]


def _draw_curves(axes: Axes, study: Study, tables: Tables, looks: Looks, axis: str, *, each_run: bool) -> None:
    for variant in study.trained_variants:
        look = looks[variant]
        curves = common_curves(tables[variant])
        if each_run:
            for seed in tables[variant]:
                axes.plot(tables[variant][seed].dropna(), color=look["color"], linewidth=0.6, alpha=0.55, zorder=1)
        else:
            _draw_band(axes, curves, look)
        thickness = (1.7 if each_run else 1.2) * rcParams["lines.linewidth"]
        marks: Look = {"markevery": max(1, len(curves) // MARKERS_PER_CURVE), "linewidth": thickness}
        axes.plot(curves.index, curves.mean(axis=1), label=OF_VARIANT + study.variants[variant], **look, **marks)
    axes.set(xlabel=_AXIS_LABELS[axis], ylabel=f"best {study.fitness_name} so far")
    if axis == "generation":
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    else:
        axes.xaxis.set_major_formatter(EngFormatter(sep=""))


def _draw_areas(axes: Axes, study: Study, tables: Tables, looks: Looks) -> None:
    for place, variant in enumerate(study.trained_variants):
        areas = tables[variant].mean().to_frame().T
        _draw_points(
            axes, np.array([place]), areas, looks[variant], OF_VARIANT + study.variants[variant], room=0.7, size=40
        )
    axes.plot([], [], label="bar: mean over runs", **_BAR)
    axes.set(xticks=[], xlabel="variant", ylabel=f"best {study.fitness_name} so far,\nmean over generations")
    axes.margins(x=0.08)


def _swept(panel: Panel, study: Study) -> Tables:
    """What the runs of each variant reached at each level; variants that were not swept are left out."""
    rows = study.robustness(panel.condition)
    rows = rows[rows["parameter"] == panel.sweep]
    if panel.highest is not None:
        rows = rows[rows["level"] <= panel.highest + 1e-9]
    tables = _tables(rows, study.variants, "level", f"{panel.value}_mean")
    if not set(tables) & set(study.trained_variants):
        raise study.lacking(panel.condition, f"no finished sweep of {panel.sweep}")
    return tables


def _draw_levels(axes: Axes, panel: Panel, study: Study, tables: Tables, looks: Looks) -> None:
    for variant, table in tables.items():
        axes.plot(table.index, table.mean(axis=1), label=OF_VARIANT + study.variants[variant], **looks[variant])
        if variant in study.baselines:
            continue
        _draw_band(axes, table, looks[variant])
        if table.shape[1] > BEST:
            best = table[study.best_seeds(panel.condition, variant, table.columns)]
            axes.plot(table.index, best.mean(axis=1), color=looks[variant]["color"], zorder=2, **_DASHED)
    if any(table.shape[1] > BEST for table in tables.values()):
        axes.plot([], [], color=GREY, label=f"mean of the {BEST} runs best on validation", **_DASHED)
    _mark_training(axes, panel, study)
    tick_levels(axes, (level for table in tables.values() for level in table.index))


def _mark_training(axes: Axes, panel: Panel, study: Study, levels: Sequence[float] = ()) -> None:
    """Draw a line at the level at which runs were trained; `levels`, if drawn side by side, have places from 0 on."""
    trained = study.trained.get(panel.condition, {}).get(str(panel.sweep))
    if trained is None:
        return
    place = np.interp(trained, levels, range(len(levels)), np.nan, np.nan) if levels else trained
    if np.isfinite(place):  # else outside of the levels that were tested
        axes.axvline(float(place), **AS_TRAINED)


def _draw_clusters(axes: Axes, panel: Panel, study: Study, tables: Tables, looks: Looks) -> None:
    """Draw the variants side by side at each level."""
    levels = sorted({level for table in tables.values() for level in table.index})
    trained = [variant for variant in tables if variant not in study.baselines]
    room = 0.8 / len(trained)
    for variant, table in tables.items():
        look, label = looks[variant], OF_VARIANT + study.variants[variant]
        places = np.array([levels.index(level) for level in table.index], dtype=np.float64)
        if variant in study.baselines:
            line = {"color": look["color"], "linestyle": look["linestyle"]}
            axes.hlines(table.mean(axis=1), places - 0.45, places + 0.45, **line)
            axes.plot([], [], label=label, **line)
        else:
            aside = (trained.index(variant) - (len(trained) - 1) / 2) * room
            _draw_points(axes, places + aside, table, look, label, room, size=12)
    axes.plot([], [], label="bar: mean over runs", **_BAR)
    _mark_training(axes, panel, study, levels)
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
