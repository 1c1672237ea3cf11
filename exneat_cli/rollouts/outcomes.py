"""What comes out of episodes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exneat_cli.tasks import FAILED, HasFullReward, Task
from exneat_cli.wiring import Moments


class Outcomes(NamedTuple):
    """What B brains got in E episodes.

    Attributes:
        fitness: (B, E) the task's fitness; its failure floor where an episode failed.
        full_reward: (B, E) the task's second figure; the failure floor likewise.
        steps: (B, E) control steps done.
        failed: (B, E) whether physics or network exploded.
        moments: (B, sensed) of what each brain sensed in its episodes, if it was asked for.
    """

    fitness: NDArray[np.float64]
    full_reward: NDArray[np.float64]
    steps: NDArray[np.int64]
    failed: NDArray[np.bool_]
    moments: Moments | None = None


class Trace(NamedTuple):
    """One episode, step by step.

    Attributes:
        steps: (steps + 1, columns); row t holds where the agent is after t steps (`Task.trace_columns`),
            then the reward terms of step t (`Task.terms`; 0 in the first row).
        tiles: (N, N, 3) path (1 or 0) and both channels of a grid world at the end; None elsewhere.
    """

    steps: NDArray[np.float64]
    tiles: NDArray[np.float64] | None


class Results(NamedTuple):
    """What the loop writes for B brains in E episodes.

    Attributes:
        status: (E, B) how episodes ended: ``ENDED`` or ``FAILED``.
        steps: (E, B) control steps done.
        totals: (E, B, terms) sums of the reward terms.
    """

    status: NDArray[np.int64]
    steps: NDArray[np.int64]
    totals: NDArray[np.float64]

    @classmethod
    def empty(cls, brains: int, episodes: int, terms: int) -> Results:
        """Room for results, all 0."""
        shape = (episodes, brains)
        return cls(np.zeros(shape, np.int64), np.zeros(shape, np.int64), np.zeros((*shape, terms)))

    def of_episode(self, episode: int) -> Results:
        """Views of one episode, without the first axis."""
        return Results(*(values[episode] for values in self))

    def outcomes(self, task: Task) -> Outcomes:
        """What they mean in a task."""
        with np.errstate(invalid="ignore"):
            fitness = task.fitness_of(self.totals).T
            full_reward = task.full_reward_of(self.totals).T if isinstance(task, HasFullReward) else fitness
        failed = (self.status.T == FAILED) | ~np.isfinite(fitness) | ~np.isfinite(full_reward)
        floor = task.failure_floor
        return Outcomes(np.where(failed, floor, fitness), np.where(failed, floor, full_reward), self.steps.T, failed)
