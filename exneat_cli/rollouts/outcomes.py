"""What comes out of episodes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exneat_cli.tasks import FAILED, HasFullReward, Task
from exneat_cli.wiring import Moments, merged


class Outcomes(NamedTuple):
    """What B brains got in E episodes.

    Attributes:
        fitness: (B, E) the task's fitness; its failure floor where an episode failed.
        full_reward: (B, E) the task's second figure, else the fitness; the failure floor likewise.
        steps: (B, E) control steps done.
        failed: (B, E) whether physics or network exploded.
        moments: (B, sensed) of what each brain sensed at all steps of its episodes, but for those that failed; None
            unless they were asked for.
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


class Tally(NamedTuple):
    """What the loop writes for B brains in E episodes.

    Attributes:
        status: (E, B) how episodes ended: ``ENDED`` or ``FAILED``.
        steps: (E, B) control steps done.
        totals: (E, B, terms) sums of the reward terms.
        means, squares: (E, B, sensed) of what was sensed: means, and sums of squared deviations from them;
            (E, B, 0) where nobody asked.
    """

    status: NDArray[np.int64]
    steps: NDArray[np.int64]
    totals: NDArray[np.float64]
    means: NDArray[np.float64]
    squares: NDArray[np.float64]

    @classmethod
    def empty(cls, task: Task, brains: int, episodes: int, *, moments: bool) -> Tally:
        """Room for all of it, 0 everywhere."""
        shape, sensed = (episodes, brains), task.sensed_size if moments else 0
        status, steps = np.zeros((2, *shape), np.int64)
        means, squares = np.zeros((2, *shape, sensed))
        return cls(status, steps, np.zeros((*shape, len(task.terms))), means, squares)

    def outcomes(self, task: Task) -> Outcomes:
        """What it means in a task."""
        with np.errstate(invalid="ignore"):
            fitness = task.fitness_of(self.totals).T
            full_reward = task.full_reward_of(self.totals).T if isinstance(task, HasFullReward) else fitness
        failed = (self.status.T == FAILED) | ~np.isfinite(fitness) | ~np.isfinite(full_reward)
        return Outcomes(
            fitness=np.where(failed, task.failure_floor, fitness),
            full_reward=np.where(failed, task.failure_floor, full_reward),
            steps=self.steps.T,
            failed=failed,
            moments=self._moments(~failed.T) if self.means.shape[-1] else None,
        )

    def _moments(self, sound: NDArray[np.bool_]) -> Moments:
        """(B, sensed) over the `sound`, (E, B), episodes, merged in their order."""
        # What is not finite would stay so in the statistics of a whole training.
        sound = (sound & np.isfinite(self.squares).all(axis=-1))[..., np.newaxis]
        each = (np.where(sound, values, 0.0) for values in (self.steps[..., np.newaxis], self.means, self.squares))
        counts, means, squares = (np.broadcast_to(v, self.means.shape).reshape(len(sound), -1) for v in each)
        together = merged(map(Moments, counts, means, squares), means.shape[1])
        return Moments(*(values.reshape(self.means.shape[1:]) for values in together))
