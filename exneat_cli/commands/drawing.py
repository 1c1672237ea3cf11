"""The figures in a run's own directory, drawn where they are missing."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from exneat_cli.records import RunDirectory


def missing_figures(directory: RunDirectory, *, swept: bool) -> list[str]:
    """Names of the figures that a finished run has data for, but no picture; of robustness also an older one."""
    data = {"training": directory.history, "path": directory.trace, "network": directory.champion}
    missing = [name for name, path in data.items() if path.exists() and not _picture(directory, name).exists()]
    return [*missing, "robustness"] if swept and _is_robustness_missing(directory) else missing


def _is_robustness_missing(directory: RunDirectory) -> bool:
    """Its data may grow later on; those of the other figures come and go together with these."""
    picture, data = _picture(directory, "robustness"), directory.robustness
    return data.exists() and not (picture.exists() and picture.stat().st_mtime >= data.stat().st_mtime)


def _picture(directory: RunDirectory, name: str) -> Path:
    return directory.plots / f"{name}.svg"


def draw_what_is_missing(directory: RunDirectory, fitness_name: str, labels: Mapping[str, str]) -> None:
    """Draw training, path, network and robustness, as far as there is data for them.

    Args:
        directory: of a finished run.
        fitness_name: label of the fitness axis.
        labels: of the axes of robustness sweeps, by name.

    Raises:
        ExneatError: another process holds the directory, or a figure cannot be written.
    """
    if not missing_figures(directory, swept=bool(labels)):
        return
    from exneat_cli.analysis import draw_network, draw_path, draw_robustness, draw_training

    with directory.held():  # nobody may change the data between reading and drawing
        missing = missing_figures(directory, swept=bool(labels))
        if "training" in missing:
            draw_training(directory, fitness_name)
        if "path" in missing:
            draw_path(directory)
        if "network" in missing:
            draw_network(directory)
        if "robustness" in missing:
            draw_robustness(directory, labels, fitness_name)
