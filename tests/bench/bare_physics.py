"""Whole episodes against the physics alone: what network, observation, reward and reset add."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exneat_cli.brains import Brain
from exneat_cli.brains.brain import activate, lay_out, memory_size
from exneat_cli.rollouts import Runner
from exneat_cli.seeding import EpisodeSeeds, generator
from exneat_cli.tasks import RUNNING, Simulation
from exneat_cli.tasks.ant_dynamics import AntWorld
from exneat_cli.tasks.compiling import compiled
from exneat_cli.tasks.mujoco_library import mj_rnePostConstraint, mj_step
from tests.bench.measurement import RATIO, Bar, Pair, Row, VerificationError, seconds_of, speed_ratios
from tests.bench.workload import TASK, Workload, open_runner

BAR = Bar(0.90, at_least=True)


class Recording(NamedTuple):
    """What the bare loop needs to do an episode again.

    Attributes:
        seeds: of the episode.
        controls: (steps, actuators), each between -1 and 1.
        final_x: of the trunk, in metres.
    """

    seeds: EpisodeSeeds
    controls: NDArray[np.float64]
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


def compare_with_bare_physics(workload: Workload, repetitions: int) -> Row:
    """Environment steps per second, on one thread, over those of the bare physics with equal controls.

    The bare loop's time leaves out the resets; ours has them, and everything else that a run costs.

    Raises:
        VerificationError: a replay did not end where the episode did.
    """
    seeds = workload.seeds
    simulation = TASK.open(training=False, reset_scale=0.1)
    with open_runner(threads=1) as runner:
        pairs = [
            Pair(
                partial(seconds_of, partial(runner.run, [brain], [seeds])),
                partial(_replay_one, simulation, _record(simulation, brain, seeds, runner)),
            )
            for brain in workload.brains()
        ]
        speed_ratios(pairs, repetitions=1)  # compiles the replay
        ratios = speed_ratios(pairs, repetitions)
    return Row("whole Ant episodes / bare mj_step x 5 + mj_rnePostConstraint, steps/s, 1 thread", RATIO, ratios, BAR)


def _record(simulation: Simulation, brain: Brain, seeds: EpisodeSeeds, runner: Runner) -> Recording:
    world, brains = simulation.world, lay_out([brain])
    memory, terms = np.zeros(memory_size(brains)), np.zeros(len(TASK.terms))
    action, controls = np.zeros(len(TASK.actuator_names)), []
    simulation.reset(world, generator(seeds.world))
    status = RUNNING
    while status == RUNNING:
        simulation.observe(world, memory[: TASK.observation_size])
        activate(brains, 0, memory, action)
        controls.append(action.copy())
        status = simulation.step(world, action, terms)
    final_x = _trunk_x(simulation)
    _check_x("step by step", final_x, float(runner.trace(brain, seeds).steps[-1, 0]))
    return Recording(seeds, np.array(controls), final_x)


def _replay_one(simulation: Simulation, recording: Recording) -> float:
    simulation.reset(simulation.world, generator(recording.seeds.world))
    seconds = seconds_of(lambda: replay(simulation.world, recording.controls))
    _check_x("replayed", _trunk_x(simulation), recording.final_x)
    return seconds


def _trunk_x(simulation: Simulation) -> float:
    row = np.zeros(len(TASK.trace_columns))
    simulation.locate(simulation.world, row)
    return float(row[0])


def _check_x(how: str, x: float, expected: float) -> None:
    if x != expected:
        raise VerificationError(f"an episode {how} ended at x = {x!r} m; expected {expected!r} m")
