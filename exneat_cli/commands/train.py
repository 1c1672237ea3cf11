"""`exneat train`: one run, or with -m one run per combination."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from hydra.core.hydra_config import HydraConfig
from hydra.types import RunMode
from omegaconf import DictConfig

from exneat_cli.commands.composition import run_composed, settings_from
from exneat_cli.commands.drawing import draw_what_is_missing
from exneat_cli.commands.sweeps import sweeps_from
from exneat_cli.errors import ExneatError
from exneat_cli.runs import check_sweeps, progress_for_terminal, run_robustness, train


def run(arguments: Sequence[str]) -> int:
    """Train; returns the exit code.

    Raises:
        ExneatError: the configuration or a run directory is unusable, in at least one job of a multirun.
    """

    def job(config: DictConfig) -> None:
        try:
            _train(config, arguments)
        except ExneatError as error:
            if HydraConfig.get().mode is RunMode.MULTIRUN:
                # Raised again at the end of the multirun by Hydra, with its reason: what a job prints on another
                # machine stays in a log there.
                print(f"exneat: {' '.join(HydraConfig.get().overrides.task)}: {error}", file=sys.stderr)
                reason = str(error).splitlines()[0]
                raise ExneatError(f"at least one job of the multirun failed; the first:\n  {reason}") from error
            raise

    run_composed("exneat train", arguments, job)
    return 0


def _train(config: DictConfig, arguments: Sequence[str]) -> None:
    settings = settings_from(config)
    asked = sweeps_from(config, settings.task.name)
    check_sweeps(settings, asked.sweeps, asked.episodes)
    again = HydraConfig.get().mode is RunMode.MULTIRUN
    command = ["exneat", "train", *arguments]
    finished = train(settings, progress=progress_for_terminal(), command=command, go_on=again)
    directory = finished.directory
    if not finished.trained_now:
        print(f"{directory.path} is finished already; nothing was trained.")
    if asked.sweeps:
        run_robustness(
            directory,
            asked.sweeps,
            episodes=asked.episodes,
            executor=settings.executor,
            progress=progress_for_terminal(),
        )
    draw_what_is_missing(directory, settings.task.fitness_name, asked.labels)
    print("\nWritten:")
    for path in sorted(path for path in directory.path.rglob("*") if path.is_file()):
        print(f"  {path}")
    print(f"\n{finished.summary}")
