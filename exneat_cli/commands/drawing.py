"""The figures in a run's own directory, drawn where they are missing."""

from __future__ import annotations

from collections.abc import Mapping

from exneat_cli.records import RunDirectory


def draw_what_is_missing(
    directory: RunDirectory, fitness_name: str, labels: Mapping[str, str], *, again: bool = False
) -> None:
    """Draw training, path, network and robustness, as far as there is data for them.

    Args:
        directory: of a finished run.
        fitness_name: label of the fitness axis.
        labels: of the axes of robustness sweeps, by name.
        again: draw robustness also if there is a figure of it, since its data has changed.
    """
    lacks = {name: not (directory.plots / f"{name}.svg").exists() for name in ("training", "path", "network")}
    lacks["training"] &= directory.history.exists()
    lacks["network"] &= directory.champion.exists()
    swept = bool(labels) and directory.robustness.exists()
    lacks["robustness"] = swept and (again or not (directory.plots / "robustness.svg").exists())
    if not any(lacks.values()):
        return
    from exneat_cli.analysis import draw_network, draw_path, draw_robustness, draw_training

    if lacks["training"]:
        draw_training(directory, fitness_name)
    if lacks["path"]:
        draw_path(directory)
    if lacks["network"]:
        draw_network(directory)
    if lacks["robustness"]:
        draw_robustness(directory, labels, fitness_name)
