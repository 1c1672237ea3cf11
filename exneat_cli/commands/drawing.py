"""The figures in a run's own directory, drawn where they are missing."""

from __future__ import annotations

from collections.abc import Mapping

from exneat_cli.records import RunDirectory


def missing_figures(directory: RunDirectory, *, swept: bool) -> list[str]:
    """Names of the figures that a finished run has data for, but no picture, or one older than its data."""
    lacks = {name: not (directory.plots / f"{name}.svg").exists() for name in ("training", "path", "network")}
    lacks["training"] &= directory.history.exists()
    lacks["network"] &= directory.champion.exists()
    picture, data = directory.plots / "robustness.svg", directory.robustness
    up_to_date = picture.exists() and data.exists() and picture.stat().st_mtime >= data.stat().st_mtime
    lacks["robustness"] = swept and data.exists() and not up_to_date
    return [name for name, lacking in lacks.items() if lacking]


def draw_what_is_missing(directory: RunDirectory, fitness_name: str, labels: Mapping[str, str]) -> None:
    """Draw training, path, network and robustness, as far as there is data for them.

    Args:
        directory: of a finished run.
        fitness_name: label of the fitness axis.
        labels: of the axes of robustness sweeps, by name.
    """
    missing = missing_figures(directory, swept=bool(labels))
    if not missing:
        return
    from exneat_cli.analysis import draw_network, draw_path, draw_robustness, draw_training

    if "training" in missing:
        draw_training(directory, fitness_name)
    if "path" in missing:
        draw_path(directory)
    if "network" in missing:
        draw_network(directory)
    if "robustness" in missing:
        draw_robustness(directory, labels, fitness_name)
