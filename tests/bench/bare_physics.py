"""Whole episodes against the physics alone: what network, observation, reward and reset add."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exneat_cli.brains import Brains
from exneat_cli.brains.brain import activate, lay_out, memory_size
from exneat_cli.compiling import compiled
from exneat_cli.seeding import generator
from exneat_cli.tasks import RUNNING, AntTask, Simulation
from exneat_cli.tasks.robots.dynamics import AntWorld, mj_rnePostConstraint, mj_step, observe, step
from tests.bench.measurement import RATIO, Bar, Pair, Row, VerificationError, seconds_of, speed_ratios
from tests.bench.workload import TASK, Workload, open_runner

BAR = Bar(0.90, at_least=True)


class Recording(NamedTuple):
    """What the bare loop needs to do an episode again, and what it must come to.

    Attributes:
        controls: (steps, actuators), each between -1 and 1.
        fitness: of the episode, its forward reward.
        final_x: of the trunk, in metres.
    """

    controls: NDArray[np.float64]
    fitness: float
    final_x: float


@compiled
def replay(world: AntWorld, controls: NDArray[np.float64]) -> None:
    """Nothing but the physics of an episode: (steps, actuators) controls, from the state `world` is in."""
    for t in range(controls.shape[0]):
        for i in range(controls.shape[1]):
            world.ctrl[i] = controls[t, i]
        for _ in range(world.substeps):
            mj_step(world.model, world.data)
        mj_rnePostConstraint(world.model, world.data)


def record(task: AntTask, simulation: Simulation, brains: Brains, b: int) -> Recording:
    """Do the episode of brain `b`, step by step, in the world that `simulation` was last reset to."""
    controls = np.zeros((task.max_steps, len(task.actuator_names)))
    memory, terms, totals = np.zeros(memory_size(brains)), np.zeros(len(task.terms)), np.zeros(len(task.terms))
    simulation.rewind(simulation.world)
    steps = _record(simulation.world, brains, b, memory, task.observation_size, controls, terms, totals)
    return Recording(controls[:steps].copy(), float(totals[0]), trunk_x(simulation))


@compiled
def _record(world, brains, b, memory, observation_size, controls, terms, totals):  # type: ignore[no-untyped-def]
    """Writes `controls` and the sums of `terms`; returns the number of steps."""
    status, t = RUNNING, 0
    while status == RUNNING:
        observe(world, memory[:observation_size])
        activate(brains, b, memory, controls[t])
        status = step(world, controls[t], terms)
        totals += terms
        t += 1
    return t


def compare_with_bare_physics(workload: Workload, repetitions: int) -> Row:
    """Environment steps per second, on one thread, over those of the bare physics with equal controls.

    The bare loop's time leaves out the resets; ours has them, and everything else that a run costs.

    Raises:
        VerificationError: a replay did not end where the episode did.
    """
    seeds, brains = workload.seeds, workload.brains()
    simulation = TASK.open(training=False)
    simulation.reset(simulation.world, generator(seeds.world))
    recordings = [record(TASK, simulation, lay_out(brains), b) for b in range(len(brains))]
    with open_runner(threads=1) as runner:
        for brain, recording in zip(brains, recordings, strict=True):
            check_x("step by step", recording.final_x, float(runner.trace(brain, seeds)[0][-1, 0]))
        pairs = [
            Pair(
                partial(seconds_of, partial(runner.run, [brain], [seeds])), partial(_replay_one, simulation, recording)
            )
            for brain, recording in zip(brains, recordings, strict=True)
        ]
        speed_ratios(pairs, repetitions=1)  # compiles the replay
        ratios = speed_ratios(pairs, repetitions)
    return Row("whole Ant episodes / bare mj_step x 5 + mj_rnePostConstraint, steps/s, 1 thread", RATIO, ratios, BAR)


def _replay_one(simulation: Simulation, recording: Recording) -> float:
    simulation.rewind(simulation.world)
    seconds = seconds_of(lambda: replay(simulation.world, recording.controls))
    check_x("replayed", trunk_x(simulation), recording.final_x)
    return seconds


def trunk_x(simulation: Simulation) -> float:
    """Where the trunk is along x, in metres."""
    row = np.zeros(len(TASK.trace_columns))
    simulation.locate(simulation.world, row)
    return float(row[0])


def check_x(how: str, x: float, expected: float) -> None:
    """Refuse an episode that did not end where it should have.

    Raises:
        VerificationError: the two differ, however little.
    """
    if x != expected:
        raise VerificationError(f"an episode {how} ended at x = {x!r} m; expected {expected!r} m")
