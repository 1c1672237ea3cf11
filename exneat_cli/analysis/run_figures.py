"""The figures in a run's own directory, drawn from its CSV files alone."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
from matplotlib.ticker import MaxNLocator

from exneat_cli.analysis.figures import new_figure, save_figure, style
from exneat_cli.records import RunDirectory


def draw_training(run: RunDirectory, fitness_name: str) -> list[Path]:
    """Best, mean and median fitness per generation, and the best so far, as PNG and SVG.

    Args:
        run: whose history.csv is drawn.
        fitness_name: label of the vertical axis, e.g. ``forward reward``.
    """
    history = pd.read_csv(run.history)
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
    """The agent's path over the ground in the first test episode, coloured by time, as PNG and SVG."""
    trace = pd.read_csv(run.trace)
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
