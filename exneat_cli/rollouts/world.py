"""One opened world, and episodes that run in it: what every thread and every worker process has of its own."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from exneat_cli.brains import Brains
from exneat_cli.brains.brain import memory_size
from exneat_cli.interruption import uninterrupted
from exneat_cli.rollouts.episode import episode_loop
from exneat_cli.rollouts.outcomes import Tally
from exneat_cli.rollouts.perturbation import Noise
from exneat_cli.rollouts.sharing import Share
from exneat_cli.seeding import EpisodeSeeds, generator
from exneat_cli.tasks import HasInitialPose, HasTiles, Simulation, Task

Acting = tuple[Brains, NDArray[np.float64], NDArray[np.float64]]
"""Brains, and low and span, (A,) each: low + U(0, span) is added to their actions."""


class World:
    """An opened world; use it from one thread at a time.

    Args:
        task: what is simulated.
        noise: what disturbs the agent.
        training: switches on the task's early stopping.
        halt: (1,), set by another thread to stop; left out, nothing stops it.

    Raises:
        ValueError: the world has no `sense`, but its task says that brains sense something else than the readings.
    """

    def __init__(self, task: Task, noise: Noise, *, training: bool, halt: NDArray[np.bool_] | None = None) -> None:
        self._task = task
        self._sensor_std = float(noise.sensor_std)
        self._simulation = _open(task, noise, training=training)
        if self._simulation.sense is None and task.sensed_size != task.observation_size:
            sizes = f"{task.sensed_size} entries of {task.observation_size} readings"
            raise ValueError(f"task {task.name}: expected a simulation with `sense`, since brains sense {sizes}")
        self._loop = episode_loop(self._simulation, task.name)
        self._halt = np.zeros(1, dtype=np.bool_) if halt is None else halt

    def run(
        self,
        shares: Iterable[Share],
        acting: Acting,
        episodes: Sequence[EpisodeSeeds],
        tally: Tally,
        trace: NDArray[np.float64] | None = None,
    ) -> None:
        """Run brains through episodes.

        Args:
            shares: which of them; taken one by one.
            acting: who acts.
            episodes: that shares count.
            tally: of all of them; what belongs to `shares` is overwritten.
            trace: (steps + 1, columns) to record the path of the last one, see `Trace`.
        """
        brains, action_low, action_span = acting
        buffers = self._buffers(brains, noisy_action=bool(action_low.any() or action_span.any()))
        disturbance = (self._sensor_std, *map(float, self._task.observation_limits), action_low, action_span)
        located = len(self._task.trace_columns)
        if trace is None:
            trace = np.zeros((0, located + len(self._task.terms)))
        for episode, first, last in shares:
            with uninterrupted():
                self._loop(
                    self._simulation.world,
                    brains,
                    first,
                    last,
                    *map(generator, episodes[episode]),
                    disturbance,
                    buffers,
                    self._halt,
                    Tally(*(values[episode] for values in tally)),
                    trace,
                    located,
                )

    def tiles(self) -> NDArray[np.float64] | None:
        """The world as the last episode left it, see `HasTiles`; None where there are no tiles."""
        return self._task.tiles(self._simulation.world) if isinstance(self._task, HasTiles) else None

    def _buffers(self, brains: Brains, *, noisy_action: bool) -> tuple[NDArray[np.float64], ...]:
        """What the loop writes into: noise has no columns where there is none."""
        task, memory = self._task, np.zeros(memory_size(brains))
        inputs, actions, steps = task.observation_size, len(task.actuator_names), task.longest_episode
        sensed = memory[: task.sensed_size]
        return (
            memory,  # values of the largest brain and a scratch entry for each of its nodes
            # (inputs,) readings: without a `sense` they need no copying, since they are what is sensed.
            sensed if self._simulation.sense is None else np.zeros(inputs),
            sensed,
            np.zeros(actions),
            np.zeros(len(task.terms)),
            np.zeros((steps, inputs if self._sensor_std > 0.0 else 0)),  # noise of the sensors
            np.zeros((steps, actions if noisy_action else 0)),  # of the action
        )


def _open(task: Task, noise: Noise, *, training: bool) -> Simulation:
    if isinstance(task, HasInitialPose):
        return task.open_disturbed(training=training, reset_scale=noise.reset_scale)
    return task.open(training=training)
