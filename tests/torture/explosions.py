"""Networks and physics that explode: the floor as fitness, counted, and no trace of NaN in any file."""

from __future__ import annotations

import contextlib
import csv
import os
import random
import re
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np

from exneat_cli.algorithms import ACTIVATIONS
from exneat_cli.brains import Brains, assemble
from exneat_cli.errors import ExneatError
from exneat_cli.records import RunDirectory
from exneat_cli.rollouts import Executor, Noise, Sweep
from exneat_cli.runs import RunSettings, run_robustness, train, training
from exneat_cli.tasks import TASKS, AntTask, Simulation
from exneat_cli.wiring import Geometry
from tests.torture.findings import Finding, Mistakes, exactly
from tests.torture.small_runs import difference, results

_NOT_FINITE = re.compile(rb"(?i)(?<![a-z])(nan|inf|infinity)(?![a-z])")
_SMALL: dict[str, Any] = {"generations": 3, "population": 12, "validation_episodes": 2, "test_episodes": 2}
_WEIGHTS = (np.nan, np.inf, -np.inf, 1e308)
"""What is put into a network; the last overflows in the first sum."""


def explode(count: int, seed: int) -> list[Finding]:
    """Inject explosions into whole runs; returns the figures.

    Args:
        count: seeds of each kind of run.
        seed: the first of them.
    """
    mistakes = Mistakes()
    injected = runs = 0
    for number in range(seed, seed + count):
        for name, settings in _variants(number):
            injected += _with_networks(name, settings, mistakes)
            runs += 1
        injected += _with_physics(number, mistakes)
        _with_wild_poses(number, mistakes)
        runs += 2
    note = f"{injected} episodes exploded by order"
    return [
        exactly("runs with explosions", runs, count * (len(_variants(0)) + 2), note),
        mistakes.none_of("miscounted episodes, NaN in a file, stray logs, or bytes that depend on the workers"),
    ]


def _variants(seed: int) -> list[tuple[str, RunSettings]]:
    variants = []
    for task in sorted(TASKS):
        world = AntTask(max_steps=60, patience=20) if task == "ant" else TASKS[task]()
        linkage = "full" if task == "ant" else "output"
        linked = RunSettings(task=world, geometry=Geometry("all"), linkage=linkage, seed=seed, **_SMALL)
        variants += [(f"{task}, ExNEAT linked", linked)]
        variants += [(f"{task}, NEAT", RunSettings(task=world, algorithm="neat", seed=seed, **_SMALL))]
    return variants


def _with_networks(name: str, settings: RunSettings, mistakes: Mistakes) -> int:
    """Spoil the networks of some teams of each generation, with one worker and with two."""
    found: dict[str, bytes] = {}
    for workers in (1, 2):
        chance, ordered = random.Random(settings.seed), [0]

        def spoilt(*arguments: Any, chance: random.Random = chance, ordered: list[int] = ordered, **options: Any):
            brains = assemble(*arguments, **options)
            chosen = sorted(chance.sample(range(len(brains.size)), 4))
            ordered[0] += len(chosen)
            return _poisoned(brains, chosen, chance)

        with mock.patch.object(training, "assemble", spoilt), _empty_directory() as folder:
            run = train(replace(settings, output=str(folder / "out"), executor=Executor(workers=workers))).directory
            _look_at(f"{name}, networks", run, folder, ordered[0] * settings.episodes, mistakes)
            came = results(folder / "out")
        if found and (differing := difference(came, found)):
            mistakes.add(f"{name}: {differing} differ between one and two workers")
        found = came
    return 2 * ordered[0]


def _poisoned(brains: Brains, chosen: list[int], chance: random.Random) -> Brains:
    """Networks that end in what is not finite: linear nodes, since clipped ones turn NaN into a number."""
    bias, activation, weight = brains.bias.copy(), brains.activation.copy(), brains.edge_weight.copy()
    for b in chosen:
        nodes = slice(brains.first_node[b], brains.first_node[b + 1])
        activation[nodes] = ACTIVATIONS.index("identity")
        bias[nodes] = np.nan
        edges = slice(brains.edge_start[nodes.start], brains.edge_start[nodes.stop])
        weight[edges] = chance.choice(_WEIGHTS)
    return brains._replace(bias=bias, activation=activation, edge_weight=weight)


def _with_physics(seed: int, mistakes: Mistakes) -> int:
    """Let Ant leap in some training episodes, which run in plain Python."""
    ordered: list[int] = [0]
    settings = RunSettings(task=AntTask(max_steps=40, patience=20), seed=seed, executor=Executor("serial"), **_SMALL)
    leaping = _leaping(AntTask.open_disturbed, random.Random(seed), ordered)
    with mock.patch.object(AntTask, "open_disturbed", leaping), _empty_directory() as folder:
        run = train(replace(settings, output=str(folder / "out"))).directory
        _look_at("ant, physics", run, folder, ordered[0], mistakes)
    return ordered[0]


def _leaping(open_calm: Callable[..., Simulation], chance: random.Random, ordered: list[int]) -> Callable[..., Any]:
    """Opens worlds in which the body is given an impossible speed, in a third of the training episodes."""
    speeds = (np.nan, np.inf, 1e300, 1e12)

    def open_world(task: AntTask, *, training: bool, reset_scale: float) -> Simulation:
        calm = open_calm(task, training=training, reset_scale=reset_scale)
        leaps = [False]

        def start(begin: Callable[..., None], *arguments: Any) -> None:
            begin(*arguments)
            leaps[0] = training and chance.random() < 1 / 3
            ordered[0] += leaps[0]

        def step(world: Any, action: Any, terms: Any) -> int:
            if leaps[0]:
                world.qvel[chance.randrange(14)] = chance.choice(speeds)
            return int(calm.step(world, action, terms))

        starts = {"reset": partial(start, calm.reset), "rewind": partial(start, calm.rewind)}
        return replace(calm, **starts, step=step, compiled=False)

    return open_world


def _with_wild_poses(seed: int, mistakes: Mistakes) -> None:
    """Poses so wild that the compiled simulation explodes: the run fails in words, or counts."""
    settings = RunSettings(task=AntTask(max_steps=40), noise=Noise(0.0, 50.0), seed=seed, **_SMALL)
    with _empty_directory() as folder:
        settings = replace(settings, output=str(folder / "out"))
        with contextlib.suppress(ExneatError):
            train(settings)
        _look_at("ant, wild poses", settings.directory, folder, None, mistakes)
        calm = replace(settings, noise=Noise())
        run = train(calm).directory
        sweep = Sweep("reset_noise", "noise.reset_scale", (0.1, 50.0))
        run_robustness(run, [sweep], episodes=2, executor=calm.executor)
        _look_at("ant, wild robustness", run, folder, 0, mistakes)
        if not any("reset_noise=" in level for level in run.read_manifest().failed_robustness_episodes):
            mistakes.add("ant, wild robustness: no failed episode was counted")


def _look_at(name: str, run: RunDirectory, folder: Path, failed: int | None, mistakes: Mistakes) -> None:
    """What a run left, beside the number of training episodes that had to fail, where it is known."""
    with run.history.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    counted = sum(int(row["failed_episodes"]) for row in rows)
    if failed is not None and counted != failed:
        mistakes.add(f"{name}: {failed} episodes had to fail, {counted} were counted")
    for path in run.path.rglob("*"):
        if path.suffix in (".csv", ".json", ".jsonl") and _NOT_FINITE.search(path.read_bytes()):
            mistakes.add(f"{name}: {path.name} holds a number that is not finite")
    if stray := [path.name for path in folder.iterdir() if path.name != "out"]:
        mistakes.add(f"{name}: left {', '.join(stray)}")


@contextlib.contextmanager
def _empty_directory() -> Iterator[Path]:
    """A new working directory, in which stray files would show."""
    before = Path.cwd()
    with tempfile.TemporaryDirectory() as name:
        os.chdir(name)
        try:
            yield Path(name)
        finally:
            os.chdir(before)
