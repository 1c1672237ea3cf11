"""Whole runs with other numbers of workers and on other executors: the same bytes."""

from __future__ import annotations

import random
import tempfile
from pathlib import Path
from typing import Any

from exneat_cli.rollouts import Executor, Sweep
from exneat_cli.runs import RunSettings, run_robustness, train
from exneat_cli.tasks import TASKS, AntTask
from exneat_cli.wiring import Geometry
from tests.torture.findings import Finding, Mistakes, exactly, say
from tests.torture.small_runs import difference, results

_WORKERS = (1, 2, 4, 8)
_NOISE = Sweep("sensor_noise", "noise.sensor_std", (0.0, 0.1))
_SMALL: dict[str, Any] = {"generations": 4, "population": 24, "validation_episodes": 2, "test_episodes": 2}


def compare_workers(count: int, seed: int) -> list[Finding]:
    """Train the same variants under every executor; returns the figures.

    Args:
        count: tasks; Ant always comes first.
        seed: of the runs, and of the choice of tasks.
    """
    grids = sorted(set(TASKS) - {"ant"})
    random.Random(seed).shuffle(grids)
    mistakes, compared = Mistakes(), 0
    for task in ["ant", *grids][:count]:
        for algorithm in ("neat", "exneat"):
            compared += _compare(_settings(task, algorithm, seed), mistakes)
    names = ", ".join(sorted({_named(each) for each in _executors()}))
    return [
        exactly("runs compared", compared, 2 * min(count, len(TASKS)) * len(_executors()), names),
        mistakes.none_of("runs whose bytes differ from those of one thread"),
    ]


def _compare(settings: RunSettings, mistakes: Mistakes) -> int:
    """One variant under every executor; returns how many there were."""
    expected: dict[str, bytes] = {}
    for executor in _executors():
        with tempfile.TemporaryDirectory() as folder:
            run = train(_with(settings, executor, folder)).directory
            run_robustness(run, [_NOISE], episodes=2, executor=executor)
            came = results(Path(folder))
        expected = expected or came
        if differing := difference(came, expected):
            mistakes.add(f"{settings.task.name} {settings.variant} on {_named(executor)}: {differing} differ")
    say(f"  {settings.task.name}, {settings.variant}")
    return len(_executors())


def _with(settings: RunSettings, executor: Executor, output: str) -> RunSettings:
    return RunSettings.from_plain({**settings.to_plain(), "executor": vars(executor), "output": output})


def _settings(task: str, algorithm: str, seed: int) -> RunSettings:
    world = AntTask(max_steps=150) if task == "ant" else TASKS[task]()
    linked = {"geometry": Geometry("all"), "linkage": "full" if task == "ant" else "output"}
    return RunSettings(
        task=world, algorithm=algorithm, seed=seed, episodes=3, **_SMALL, **(linked if algorithm == "exneat" else {})
    )


def _executors() -> list[Executor]:
    several = [Executor(name, workers) for name in ("threads", "dask") for workers in _WORKERS]
    return [Executor("serial"), *several, Executor("processes", 2)]


def _named(executor: Executor) -> str:
    return executor.name if executor.name == "serial" else f"{executor.name} {executor.workers}"
