"""Whole runs with other numbers of workers and on other executors: the same bytes."""

from __future__ import annotations

import random
import tempfile
from pathlib import Path
from typing import Any

from exneat_cli.algorithms import EvolutionSettings
from exneat_cli.rollouts import Executor, Sweep
from exneat_cli.runs import RunSettings, run_robustness, train
from exneat_cli.tasks import TASKS, AntTask, Task
from exneat_cli.wiring import Geometry
from tests.torture.findings import Finding, Mistakes, exactly, say
from tests.torture.small_runs import difference, results

_WORKERS = (1, 2, 4, 8)
_NOISE = Sweep("sensor_noise", "noise.sensor_std", (0.0, 0.1))
_SMALL: dict[str, Any] = {"generations": 4, "population": 24, "validation_episodes": 2, "test_episodes": 2}
_WALKING: dict[str, Any] = {
    "judging": "mean",
    "champion": "race",
    "geometry": Geometry("auto"),
    "evolution": EvolutionSettings(
        mutation="adaptive",
        weight_mutate_power_min=0.01,
        safe_mutation=True,
        parent_selection="rank",
        crossover_prob=0.3,
        initial_connection="full_direct",
        module_hidden=0,
    ),
}


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
        compared += sum(_compare(each, mistakes) for each in _variants(task, seed))
    names = ", ".join(sorted({_named(each) for each in _executors()}))
    return [
        exactly("runs compared", compared, (2 * min(count, len(TASKS)) + 4) * len(_executors()), names),
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


def _variants(task: str, seed: int) -> list[RunSettings]:
    """NEAT and linked ExNEAT; on Ant also ExNEAT as it walks, and every evolution strategy."""
    linked = {"geometry": Geometry("all"), "linkage": "full" if task == "ant" else "output"}
    variants: list[dict[str, Any]] = [{"algorithm": "neat"}, {"algorithm": "exneat", **linked}]
    if task == "ant":
        world: Task = AntTask(max_steps=150, frame="part", contact_forces=False)
        strategies = [{"algorithm": name, "geometry": Geometry("auto")} for name in ("ars", "openai_es", "cma_es")]
        variants += [{"task": world, **each} for each in ({"algorithm": "exneat", **_WALKING}, *strategies)]
    usual = {"task": AntTask(max_steps=150) if task == "ant" else TASKS[task](), "seed": seed, "episodes": 3}
    return [RunSettings(**{**usual, **_SMALL, **each}) for each in variants]


def _executors() -> list[Executor]:
    several = [Executor(name, workers) for name in ("threads", "dask") for workers in _WORKERS]
    return [Executor("serial"), *several, Executor("processes", 2)]


def _named(executor: Executor) -> str:
    return executor.name if executor.name == "serial" else f"{executor.name} {executor.workers}"
