"""`exneat train`: one run, or with -m one run per combination."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from hydra.core.hydra_config import HydraConfig
from hydra.types import RunMode
from omegaconf import DictConfig

from exneat_cli.commands.composition import run_composed, settings_from
from exneat_cli.errors import ExneatError
from exneat_cli.records import RunDirectory
from exneat_cli.runs import progress_for_terminal, train


def run(arguments: Sequence[str]) -> int:
    """Train; returns the exit code.

    Raises:
        ExneatError: the configuration or a run directory is unusable, in at least one job of a multirun.
    """
    refused: list[ExneatError] = []

    def job(config: DictConfig) -> None:
        try:
            _train(config, arguments)
        except ExneatError as error:
            if HydraConfig.get().mode is RunMode.MULTIRUN:
                # Raised again at the end of the multirun by Hydra, also where jobs run in other processes.
                print(f"exneat: {' '.join(HydraConfig.get().overrides.task)}: {error}", file=sys.stderr)
                raise ExneatError("at least one job of the multirun failed; see above") from error
            refused.append(error)

    run_composed("exneat train", arguments, job)
    if refused:
        raise refused[0]
    return 0


def _draw_what_is_missing(directory: RunDirectory, fitness_name: str) -> None:
    lacks_training = directory.history.exists() and not (directory.plots / "training.svg").exists()
    lacks_path = not (directory.plots / "path.svg").exists()
    if lacks_training or lacks_path:
        from exneat_cli.analysis import draw_path, draw_training

        if lacks_training:
            draw_training(directory, fitness_name)
        if lacks_path:
            draw_path(directory)


def _train(config: DictConfig, arguments: Sequence[str]) -> None:
    settings = settings_from(config)
    finished = train(settings, progress=progress_for_terminal(), command=["exneat", "train", *arguments])
    directory = finished.directory
    if not finished.trained_now:
        print(f"{directory.path} is finished already; nothing was trained.")
    _draw_what_is_missing(directory, settings.task.fitness_name)
    print("\nWritten:")
    for path in sorted(path for path in directory.path.rglob("*") if path.is_file()):
        print(f"  {path}")
    print(f"\n{finished.summary}")
