"""One world, and brains that run through it: what every thread and every worker process has of its own."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exneat_cli.brains import Brains
from exneat_cli.brains.brain import memory_size
from exneat_cli.interruption import uninterrupted
from exneat_cli.rollouts.episode import Buffers, Conditions, episode_loop
from exneat_cli.rollouts.noise import Noise
from exneat_cli.rollouts.outcomes import Results
from exneat_cli.seeding import EpisodeSeeds, generator
from exneat_cli.tasks import HasInitialPose, HasTiles, Simulation, Task


class Crew(NamedTuple):
    """Who acts, and what happens to its inputs and actions."""

    brains: Brains
    conditions: Conditions


class Setup(NamedTuple):
    """What is simulated.

    Attributes:
        task: see there.
        noise: what disturbs the agent.
        training: switches on the task's early stopping.
    """

    task: Task
    noise: Noise
    training: bool


class Player:
    """An opened world; use it from one thread at a time.

    Args:
        setup: what is simulated.
        halt: (1,), set by another thread to stop; left out, nothing stops it.
    """

    def __init__(self, setup: Setup, halt: NDArray[np.bool_] | None = None) -> None:
        self._task = setup.task
        self._simulation = open_world(setup.task, setup.noise, training=setup.training)
        self._loop = episode_loop(self._simulation, setup.task.name)
        self._halt = np.zeros(1, dtype=np.bool_) if halt is None else halt
        self.compiled = self._simulation.compiled

    def buffers(self, crew: Crew) -> Buffers:
        """What a crew writes into while it plays."""
        conditions, steps = crew.conditions, self._task.longest_episode
        shaken = bool(conditions.action_low.any() or conditions.action_span.any())
        return Buffers(
            memory=np.zeros(memory_size(crew.brains)),
            action=np.zeros(len(conditions.action_low)),
            terms=np.zeros(len(self._task.terms)),
            sensor_noise=np.zeros((steps, self._task.observation_size if conditions.sensor_std > 0.0 else 0)),
            action_noise=np.zeros((steps, len(conditions.action_low) if shaken else 0)),
        )

    def play(
        self,
        crew: Crew,
        buffers: Buffers,
        chosen: tuple[int, int],
        seeds: EpisodeSeeds,
        results: Results,
        trace: NDArray[np.float64] | None = None,
    ) -> None:
        """Run some brains through one episode.

        Args:
            crew: who acts.
            buffers: of this crew.
            chosen: the first brain, and the one before which to stop.
            seeds: of the episode.
            results: of one episode and all brains of the crew; those of the chosen are overwritten.
            trace: (steps + 1, columns) to record the path of the last one, see `Trace`.
        """
        located = len(self._task.trace_columns)
        with uninterrupted():
            self._loop(
                self._simulation.world,
                crew.brains,
                *chosen,
                *(generator(seed) for seed in seeds),
                crew.conditions,
                buffers,
                self._task.observation_size,
                self._halt,
                results.status,
                results.steps,
                results.totals,
                np.zeros((0, located + len(self._task.terms))) if trace is None else trace,
                located,
            )

    def tiles(self) -> NDArray[np.float64] | None:
        """The world as the last episode left it, see `HasTiles`; None where there are no tiles."""
        return self._task.tiles(self._simulation.world) if isinstance(self._task, HasTiles) else None


def open_world(task: Task, noise: Noise, *, training: bool) -> Simulation:
    """Open a new world, with the noise on its initial pose if it has one."""
    if isinstance(task, HasInitialPose):
        return task.open_disturbed(training=training, reset_scale=noise.reset_scale)
    return task.open(training=training)
