"""The figures in a run's own directory, drawn from its CSV files alone."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from exneat_cli.analysis.figures import new_figure, save_figure, style, tick_levels
from exneat_cli.analysis.study import read_csv
from exneat_cli.records import UNPERTURBED, HistoryRow, RobustnessRow, RunDirectory

MOST_PREY = 50
"""Paths of prey beyond these are left out of a picture: nobody could tell them apart."""
MOST_COLUMNS = 3
_SPREAD = "one standard deviation over episodes"


def draw_training(run: RunDirectory, fitness_name: str) -> list[Path]:
    """Best, mean and median fitness per generation, and the best so far, as PNG and SVG.

    Args:
        run: whose history.csv is drawn.
        fitness_name: label of the vertical axis, e.g. ``forward reward``.
    """
    history = read_csv(run.history, HistoryRow._fields)
    curves = {
        "best_so_far": ("best so far", "#222222", 1.2, "--"),
        "best_fitness": ("best of the generation", "#0072b2", 1.8, "-"),
        "mean_fitness": ("mean", "#d55e00", 1.8, "-"),
        "median_fitness": ("median", "#009e73", 1.2, "-"),
    }
    with style():
        figure = new_figure()
        axes = figure.add_subplot()
        for column, (label, colour, width, line) in curves.items():
            axes.plot(history["generation"], history[column], line, label=label, color=colour, linewidth=width)
        axes.set(title=run.path.name, xlabel="generation", ylabel=f"training fitness ({fitness_name})")
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.legend(loc="upper left")
    return save_figure(figure, run.plots / "training")


def draw_path(run: RunDirectory) -> list[Path]:
    """The agent at work in the first test episode, as PNG and SVG.

    In a grid world: its path over the tiles and their cues, and the paths of prey. Elsewhere: its path over
    the ground, coloured by time.
    """
    trace = read_csv(run.trace)
    if run.tiles.exists():
        return _draw_on_tiles(run, trace, read_csv(run.tiles))
    with style():
        figure = new_figure(7.0, 3.6)
        axes = figure.add_subplot()
        axes.plot(trace["x"], trace["y"], color="#bbbbbb", linewidth=1.0, zorder=1)
        points = axes.scatter(trace["x"], trace["y"], c=trace["step"], s=4, cmap="viridis", zorder=2)
        axes.plot(trace["x"].iloc[0], trace["y"].iloc[0], "o", color="#d55e00", label="start", zorder=3)
        axes.set(title=f"{run.path.name}: first test episode", xlabel="x, ahead (m)", ylabel="y, left (m)")
        axes.set_aspect("equal", adjustable="datalim")
        figure.colorbar(points, ax=axes, label="control step")
        axes.legend(loc="best")
    return save_figure(figure, run.plots / "path")


def draw_robustness(run: RunDirectory, labels: Mapping[str, str], fitness_name: str) -> list[Path]:
    """Fitness at each level of each sweep in robustness.csv, as PNG and SVG; no files if it holds no sweep.

    Of a level that was tested more than once, the row with the most episodes is shown.

    Args:
        run: whose robustness.csv is drawn.
        labels: name of a sweep -> label of its axis; a sweep without one is called by its name.
        fitness_name: label of the vertical axes, e.g. ``forward reward``.
    """
    rows = read_csv(run.robustness, RobustnessRow._fields).sort_values(["parameter", "level", "episodes"])
    rows = rows.drop_duplicates(["parameter", "level"], keep="last")
    sweeps = [name for name in dict.fromkeys(rows["parameter"]) if name != UNPERTURBED]
    if not sweeps:
        return []
    columns = min(len(sweeps), MOST_COLUMNS)
    lines = math.ceil(len(sweeps) / columns)
    with style():
        figure = new_figure(max(6.2, 3.6 * columns), 3.0 * lines + 0.9)
        panels = figure.subplots(lines, columns, squeeze=False).ravel()
        for axes, sweep in zip(panels, sweeps, strict=False):
            levels = rows[rows["parameter"] == sweep]
            x, mean, spread = (levels[column].to_numpy() for column in ("level", "fitness_mean", "fitness_std"))
            axes.fill_between(
                x, mean - spread, mean + spread, color="#0072b2", alpha=0.18, linewidth=0.0, label=_SPREAD
            )
            axes.plot(x, mean, "o-", color="#0072b2", markersize=4.0, label="mean over episodes")
            tick_levels(axes, x)
            axes.set(xlabel=labels.get(sweep, sweep), ylabel=fitness_name)
        for axes in panels[len(sweeps) :]:
            axes.remove()
        figure.suptitle(f"{run.path.name}: robustness")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return save_figure(figure, run.plots / "robustness")


def _draw_on_tiles(run: RunDirectory, trace: pd.DataFrame, tiles: pd.DataFrame) -> list[Path]:
    with style():
        figure = new_figure(9.0, 4.4)
        for channel, axes in enumerate(figure.subplots(1, 2), start=1):
            cues = tiles.pivot(index="row", columns="column", values=f"channel_{channel}").to_numpy()
            path = tiles.pivot(index="row", columns="column", values="path").to_numpy()
            picture = axes.imshow(np.ma.masked_where(path == 0, cues), cmap="YlOrBr", vmin=0.0)
            axes.set_facecolor("#444444")
            prey = [name.removesuffix("_free") for name in trace.columns if name.endswith("_free")]
            for name in prey[:MOST_PREY]:
                _draw_prey(axes, trace, name)
            if "goal_row" in trace:
                axes.plot(trace["goal_column"].iloc[0], trace["goal_row"].iloc[0], "*", color="#009e73", markersize=12)
            axes.plot(trace["column"], trace["row"], "-", color="#0072b2", linewidth=2.0)
            axes.plot(trace["column"].iloc[0], trace["row"].iloc[0], "o", color="#0072b2", label="start")
            axes.plot(trace["column"].iloc[-1], trace["row"].iloc[-1], "s", color="#0072b2", label="end")
            axes.set(title=f"channel {channel}", xticks=[], yticks=[])
            axes.grid(visible=False)
            figure.colorbar(picture, ax=axes, shrink=0.8, label="cue at the end")
        figure.suptitle(f"{run.path.name}: first test episode")
        figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return save_figure(figure, run.plots / "path")


def _draw_prey(axes: Axes, trace: pd.DataFrame, prey: str) -> None:
    free = trace[trace[f"{prey}_free"] == 1]
    axes.plot(free[f"{prey}_column"], free[f"{prey}_row"], "-", color="#009e73", linewidth=1.0)
    caught = len(free) < len(trace)
    last = trace.iloc[min(len(free), len(trace) - 1)]
    axes.plot(last[f"{prey}_column"], last[f"{prey}_row"], "x" if caught else ".", color="#009e73")
