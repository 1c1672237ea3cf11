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
from exneat_cli.tasks import RUNNING, RobotTask, Simulation
from exneat_cli.tasks.robots.dynamics import RobotWorld, drive, mj_rnePostConstraint, mj_step, observe, sense, step
from tests.bench.measurement import RATIO, Bar, Pair, Row, VerificationError, seconds_of, speed_ratios
from tests.bench.workload import TASK, Workload, open_runner

BAR = Bar(0.90, at_least=True)


class Recording(NamedTuple):
    """What the bare loop needs to do an episode again, and what it must come to.

    Attributes:
        controls: (steps, actuators), in the actuators' own units.
        fitness: of the episode, its forward reward.
        final_x: of the trunk, in metres.
    """

    controls: NDArray[np.float64]
    fitness: float
    final_x: float


@compiled
def replay(world: RobotWorld, controls: NDArray[np.float64]) -> None:
    """Nothing but the physics of an episode: (steps, actuators) controls, from the state `world` is in."""
    for t in range(controls.shape[0]):
        for i in range(controls.shape[1]):
            world.ctrl[i] = controls[t, i]
        for _ in range(world.substeps):
            mj_step(world.model, world.data)
        mj_rnePostConstraint(world.model, world.data)


def record(task: RobotTask, simulation: Simulation, brains: Brains, b: int) -> Recording:
    """Do the episode of brain `b`, step by step, in the world that `simulation` was last reset to."""
    controls = np.zeros((task.max_steps, len(task.actuator_names)))
    action, memory = np.zeros(len(task.actuator_names)), np.zeros(memory_size(brains))
    terms, totals = np.zeros((2, len(task.terms)))
    framed, sensed = simulation.sense is not None, memory[: task.sensed_size]
    readings = np.zeros(task.observation_size) if framed else sensed
    simulation.rewind(simulation.world)
    steps = _record(simulation.world, framed, brains, b, readings, sensed, memory, action, controls, terms, totals)
    return Recording(controls[:steps].copy(), float(totals[0]), trunk_x(task, simulation))


@compiled
def _record(world, framed, brains, b, readings, sensed, memory, action, controls, terms, totals):  # type: ignore[no-untyped-def]
    """Writes `controls` and the sums of `terms`; returns the number of steps."""
    status, t = RUNNING, 0
    while status == RUNNING:
        observe(world, readings)
        if framed:
            sense(world, readings, sensed)
        activate(brains, b, memory, action)
        if framed:
            drive(world, action)
        status = step(world, action, terms)
        controls[t] = world.ctrl
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
    check_x("replayed", trunk_x(TASK, simulation), recording.final_x)
    return seconds


def trunk_x(task: RobotTask, simulation: Simulation) -> float:
    """Where the trunk is along x, in metres."""
    row = np.zeros(len(task.trace_columns))
    simulation.locate(simulation.world, row)
    return float(row[0])


def check_x(how: str, x: float, expected: float) -> None:
    """Refuse an episode that did not end where it should have.

    Raises:
        VerificationError: the two differ, however little.
    """
    if x != expected:
        raise VerificationError(f"an episode {how} ended at x = {x!r} m; expected {expected!r} m")
