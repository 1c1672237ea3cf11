"""The figures in a run's own directory, drawn from its CSV files alone."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from exneat_cli.analysis import styles
from exneat_cli.analysis.study import read_csv
from exneat_cli.records import HISTORY_COLUMNS, UNPERTURBED, RobustnessRow, RunDirectory, read_robustness

MOST_PREY = 50
"""At most this many prey have their paths drawn: more could not be told apart."""
MOST_COLUMNS = 3
_CURVES: dict[str, styles.Look] = {
    "best_so_far": {"label": "best so far", "color": "#222222", "linewidth": 1.2, "linestyle": "--"},
    "best_fitness": {"label": "best of the generation", "color": styles.BLUE, "linewidth": 1.8},
    "mean_fitness": {"label": "mean", "color": styles.VERMILION, "linewidth": 1.8, "linestyle": "-."},
    "median_fitness": {"label": "median", "color": styles.GREEN, "linewidth": 1.2, "linestyle": styles.DASH_DOT_DOT},
    "judged_fitness": {
        "label": "best mean over all episodes",
        "color": styles.PURPLE,
        "linewidth": 1.8,
        "linestyle": (0.0, (8.0, 2.0)),
    },
}
_TESTED: styles.Look = {"label": "champion, test mean", "color": "#222222", "linewidth": 1.2, "linestyle": ":"}


def draw_training(run: RunDirectory, fitness_name: str, tested: float | None = None) -> list[Path]:
    """Draw the fitness per generation in a run's history.csv, as PNG and SVG.

    `fitness_name` is its label, and `tested` the champion's mean over the test episodes.
    """
    history = read_csv(run.history, HISTORY_COLUMNS)
    with styles.SCREEN.style():
        figure = Figure(figsize=(7.0, 4.2), layout="constrained")
        axes = figure.add_subplot()
        for column, look in _CURVES.items():
            if column in history:
                axes.plot(history["generation"], history[column], **look)
        if tested is not None:
            axes.axhline(tested, **_TESTED)
        score = "training fitness" if fitness_name == "fitness" else f"training fitness ({fitness_name})"
        axes.set(title=styles.run_title(run), xlabel="generation", ylabel=score)
        styles.tick_levels(axes, history["generation"])
        figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return styles.save_figure(figure, run.plots / "training")


def draw_robustness(
    run: RunDirectory, labels: Mapping[str, str], fitness_name: str, trained: Mapping[str, float] | None = None
) -> list[Path]:
    """Draw fitness at each level of each sweep in a run's robustness.csv, as PNG and SVG; no files without a sweep.

    If a level was tested more than once, the row with the most episodes is shown. `labels` are those of the horizontal
    axes by sweep, for which a sweep's name stands in; `fitness_name` is that of the vertical axes, and `trained` holds
    the level of training by sweep.
    """
    tested = [row for row in read_robustness(run.robustness) if row.parameter != UNPERTURBED]
    rows = pd.DataFrame(tested, columns=RobustnessRow._fields).sort_values(["parameter", "level", "episodes"])
    rows = rows.drop_duplicates(["parameter", "level"], keep="last")
    sweeps = list(rows.groupby("parameter"))
    if not sweeps:
        return []
    columns = min(len(sweeps), MOST_COLUMNS)
    lines = math.ceil(len(sweeps) / columns)
    band = "one standard deviation over episodes"
    with styles.SCREEN.style():
        figure = Figure(figsize=(max(6.2, 3.6 * columns), 3.0 * lines + 0.9), layout="constrained")
        panels = figure.subplots(lines, columns, squeeze=False).ravel()
        for axes, (sweep, levels) in zip(panels, sweeps, strict=False):
            x, mean, spread = levels["level"], levels["fitness_mean"], levels["fitness_std"]
            axes.fill_between(x, mean - spread, mean + spread, color=styles.BLUE, alpha=0.18, linewidth=0.0, label=band)
            axes.plot(x, mean, "o-", color=styles.BLUE, markersize=4.0, label="mean over episodes")
            if trained and sweep in trained:
                axes.axvline(trained[str(sweep)], **styles.AS_TRAINED)
            styles.tick_levels(axes, x)
            axes.set(xlabel=labels.get(str(sweep), str(sweep)), ylabel=fitness_name)
        for axes in panels[len(sweeps) :]:
            axes.remove()
        figure.suptitle(f"{styles.run_title(run)}: robustness")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return styles.save_figure(figure, run.plots / "robustness")


def draw_path(run: RunDirectory) -> list[Path]:
    """Draw the agent at work in the first test episode, as PNG and SVG.

    In a grid world: its path over the tiles and their cues, and the paths of prey. On the ground: its path,
    coloured by time. For other tasks: their reward terms over time.
    """
    trace = read_csv(run.trace)
    title = f"{styles.run_title(run)}: first test episode"
    with styles.SCREEN.style():
        if run.tiles.exists():
            figure = _on_tiles(trace, read_csv(run.tiles))
            figure.suptitle(title)
        else:
            figure = Figure(figsize=(7.0, 3.6), layout="constrained")
            axes = figure.add_subplot(title=title)
            if {"x", "y"} <= set(trace.columns):
                axes.plot(trace["x"], trace["y"], color="#bbbbbb", linewidth=1.0, zorder=1)
                points = axes.scatter(trace["x"], trace["y"], c=trace["step"], s=4, cmap="viridis", zorder=2)
                axes.plot(trace["x"].iloc[0], trace["y"].iloc[0], "o", color=styles.VERMILION, label="start", zorder=3)
                axes.set(xlabel="x, ahead (m)", ylabel="y, left (m)")
                axes.set_aspect("equal", adjustable="datalim")
                figure.colorbar(points, ax=axes, label="control step")
            else:
                for term in trace.columns.drop("step"):
                    axes.plot(trace["step"], trace[term], label=term.replace("_", " "))
                axes.set(xlabel="control step", ylabel="reward of the step")
            axes.legend(loc="best")
    return styles.save_figure(figure, run.plots / "path")


def _on_tiles(trace: pd.DataFrame, tiles: pd.DataFrame) -> Figure:
    figure = Figure(figsize=(9.0, 4.6), layout="constrained")
    grid = tiles.pivot(index="row", columns="column")
    channels = [np.ma.masked_where(grid["path"] == 0, grid[f"channel_{channel}"]) for channel in (1, 2)]
    strongest = max(float(cues.max()) for cues in channels)  # one scale for both
    panels = figure.subplots(1, 2)
    for channel, (axes, cues) in enumerate(zip(panels, channels, strict=True), start=1):
        picture = axes.imshow(cues, cmap="YlOrBr", vmin=0.0, vmax=strongest)
        _draw_prey(axes, trace)
        if "goal_row" in trace:
            x, y = trace["goal_column"].iloc[0], trace["goal_row"].iloc[0]
            axes.plot(x, y, "*", color=styles.GREEN, markersize=12, label="goal")
        axes.plot(trace["column"], trace["row"], "-", color=styles.BLUE, linewidth=2.0, label="agent")
        for place, marker, label in ((0, "o", "start"), (-1, "s", "end")):
            axes.plot(trace["column"].iloc[place], trace["row"].iloc[place], marker, color=styles.BLUE, label=label)
        axes.set(title=f"channel {channel}", xticks=[], yticks=[], facecolor=styles.GREY)
        axes.grid(visible=False)
    figure.colorbar(picture, ax=panels, shrink=0.8, label="cue at the end")
    entries = dict(zip(*reversed(panels[0].get_legend_handles_labels()), strict=True))
    figure.legend(list(entries.values()), list(entries), loc="outside lower center", ncols=len(entries))
    return figure


def _draw_prey(axes: Axes, trace: pd.DataFrame) -> None:
    """Draw where prey went, and where it was caught or left."""
    prey = [name.removesuffix("_free") for name in trace.columns if name.endswith("_free")]
    for name in prey[:MOST_PREY]:
        row, column, is_free = trace[f"{name}_row"], trace[f"{name}_column"], trace[f"{name}_free"] == 1
        axes.plot(column[is_free], row[is_free], "-", color=styles.GREEN, linewidth=1.0, label="prey")
        end = min(is_free.sum(), len(trace) - 1)
        marker, label = (".", "prey, free at the end") if is_free.all() else ("x", "prey, caught here")
        axes.plot(column.iloc[end], row.iloc[end], marker, linestyle="", color=styles.GREEN, label=label)
