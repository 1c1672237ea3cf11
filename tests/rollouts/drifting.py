"""A task whose every step can be done by hand: a point on a line, with a `sense` and a `drive`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from exneat_cli.brains import Brain
from exneat_cli.brains.rules import weighted_sums
from exneat_cli.compiling import compiled_lean
from exneat_cli.rollouts import Executor, Noise, Outcomes, Runner
from exneat_cli.seeding import training_episodes
from exneat_cli.tasks import ENDED, FAILED, RUNNING, Part, Simulation, Task

SERIAL = Executor("serial")
EPISODES = training_episodes(0, 3, 4)


def reset(world, rng):  # type: ignore[no-untyped-def]
    world[1] = rng.uniform(-1.0, 1.0)
    world[0], world[2] = world[1], 0.0


def rewind(world):  # type: ignore[no-untyped-def]
    world[0], world[2] = world[1], 0.0


def observe(world, readings):  # type: ignore[no-untyped-def]
    readings[0], readings[1] = world[0], world[2] / 10.0


def sense(world, readings, sensed):  # type: ignore[no-untyped-def]
    sensed[0], sensed[1], sensed[2] = -readings[0], readings[1], readings[0] * readings[1]


def drive(world, action):  # type: ignore[no-untyped-def]
    action[0] *= -0.5


def step(world, action, terms):  # type: ignore[no-untyped-def]
    terms[0] = action[0]
    world[0] += action[0]
    world[2] += 1.0
    if not np.isfinite(world[0]):
        return FAILED
    return ENDED if abs(world[0]) > 2.0 or world[2] == 12.0 else RUNNING


def locate(world, row):  # type: ignore[no-untyped-def]
    row[0] = world[0]


PLAIN = {function.__name__: function for function in (reset, rewind, observe, sense, drive, step, locate)}
COMPILED = {name: compiled_lean(function) for name, function in PLAIN.items()}


@dataclass(frozen=True)
class Drifting(Task):
    """Its world is (3,): where the point is, where it began, and how many steps it did."""

    name: str = "drifting"
    compiled: bool = True
    terms: ClassVar[tuple[str, ...]] = ("way",)
    trace_columns: ClassVar[tuple[str, ...]] = ("x",)
    failure_floor: ClassVar[float] = -7.0
    observation_limits: ClassVar[tuple[float, float]] = (-1.0, 1.0)
    tie_noise: ClassVar[float] = 0.01
    parts = (Part("all", (0, 1, 2), (0,), (0.0, 0.0)),)
    observation_size, sensed_size, longest_episode = 2, 3, 12
    actuator_names = ("push",)

    def open(self, *, training: bool) -> Simulation:
        return Simulation(np.zeros(3), **(COMPILED if self.compiled else PLAIN), compiled=self.compiled)


def random_brains(count: int, task: Task = Drifting()) -> list[Brain]:
    """Weighted sums of what is sensed, all different."""
    shape, rng = (len(task.actuator_names), task.sensed_size), np.random.default_rng(7)
    return [weighted_sums(rng.normal(size=shape) / shape[1] ** 0.5, rng.normal(size=shape[0])) for _ in range(count)]


def assert_equal(some: Outcomes, others: Outcomes) -> None:
    for name, values in some._asdict().items():
        np.testing.assert_equal(values, getattr(others, name), err_msg=name)


def run(task: Task, brains: Any, executor: Executor = SERIAL, episodes: Any = EPISODES) -> Outcomes:
    with Runner(task, Noise(0.3), executor, training=True) as runner:
        return runner.run(brains, episodes, moments=True)
