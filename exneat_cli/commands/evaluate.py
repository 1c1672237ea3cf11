"""`exneat evaluate`: how finished runs hold up when the world gets worse."""

from __future__ import annotations

import glob
from collections.abc import Sequence
from pathlib import Path

from omegaconf import DictConfig

from exneat_cli.commands.composition import plain_from, run_composed
from exneat_cli.commands.drawing import draw_what_is_missing
from exneat_cli.commands.sweeps import sweeps_from
from exneat_cli.errors import ConfigError, ExneatError
from exneat_cli.records import RunDirectory
from exneat_cli.runs import check_sweeps, executor_from, load_settings, progress_for_terminal, run_robustness

_KEYS = {"run", "sweep", "sweeps", "executor"}


def run(arguments: Sequence[str]) -> int:
    """Test runs under perturbations; returns the exit code.

    Raises:
        ExneatError: a run, a sweep or a level is unusable; nothing was run then.
    """
    run_composed("exneat evaluate", arguments, _evaluate, "evaluate")
    return 0


def _evaluate(config: DictConfig) -> None:
    plain = plain_from(config)
    if unknown := sorted(set(plain) - _KEYS):
        raise ExneatError(f"{unknown[0]}: unknown key; exneat evaluate knows {', '.join(sorted(_KEYS))}")
    if not plain.get("sweeps"):
        raise ConfigError("sweep", "what to perturb, e.g. sweep=sensor_noise", "none")
    executor = executor_from(plain.get("executor", {}))
    planned = []
    for directory in _directories(plain.get("run")):
        try:
            settings = load_settings(directory)
            asked = sweeps_from(config, settings.task.name)
            check_sweeps(settings, asked.sweeps, asked.episodes)
        except ConfigError as error:
            raise ExneatError(f"{directory.path}: {error}") from error
        planned.append((directory, settings, asked))
    for directory, settings, asked in planned:
        done = run_robustness(
            directory, asked.sweeps, episodes=asked.episodes, executor=executor, progress=progress_for_terminal()
        )
        draw_what_is_missing(directory, settings.task.fitness_name, asked.labels)
        print(f"{directory.robustness}: {done} levels tested now" if done else f"{directory.path}: all there already")


def _directories(pattern: object) -> list[RunDirectory]:
    if not isinstance(pattern, str) or not pattern:
        raise ConfigError("run", "a run directory, or a pattern such as 'outputs/ant/*'", pattern)
    if not glob.has_magic(pattern):
        return [RunDirectory(Path(pattern))]
    found = [run for path in sorted(glob.glob(pattern)) if (run := RunDirectory(Path(path))).is_there()]
    if not found:
        raise ConfigError("run", "a run directory, or a pattern that fits some", pattern, "exneat inspect lists them")
    return found
