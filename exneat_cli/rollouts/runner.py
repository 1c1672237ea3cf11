"""Runs brains through episodes, wherever the executor says.

Every episode draws from generators of its own, and a world is as new for each brain, so results depend neither on
the number of workers nor on which of them ran what.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from exneat_cli.brains import Brain, Brains, RandomActions, motionless
from exneat_cli.brains.brain import lay_out
from exneat_cli.rollouts.cluster_work import ClusterWork
from exneat_cli.rollouts.episode import Conditions
from exneat_cli.rollouts.executor import Executor
from exneat_cli.rollouts.noise import Noise
from exneat_cli.rollouts.outcomes import Outcomes, Results, Trace
from exneat_cli.rollouts.player import Crew, Player, Setup
from exneat_cli.rollouts.threads import Threads
from exneat_cli.seeding import EpisodeSeeds
from exneat_cli.tasks import Task


class Runner:
    """Episodes of one task under one noise; a context manager that ends its threads or processes.

    Args:
        task: what is simulated.
        noise: what disturbs the agent.
        executor: where; one world is opened for each thread.
        training: switches on the task's early stopping.

    Raises:
        ExneatError: the executor's cluster cannot be reached, or its library is not installed.
    """

    def __init__(self, task: Task, noise: Noise, executor: Executor, *, training: bool) -> None:
        self._task = task
        self._noise = noise
        setup = Setup(task, noise, training)
        halt = np.zeros(1, dtype=np.bool_)
        self._player = Player(setup, halt)
        self.compiled = self._player.compiled
        self._work: Threads | ClusterWork
        if executor.name == "dask":
            self._work = ClusterWork(setup, executor)
        else:
            self._work = Threads([self._player, *(Player(setup, halt) for _ in range(executor.threads - 1))], halt)

    def __enter__(self) -> Runner:
        return self

    def __exit__(self, *exception: object) -> None:
        self._work.close()

    def run(
        self,
        brains: Brains | Sequence[Brain] | RandomActions,
        episodes: Sequence[EpisodeSeeds],
        *,
        moments: bool = False,
    ) -> Outcomes:
        """Outcomes of every brain (one, if it acts at random) in every episode.

        Raises:
            ValueError: there is no brain, or one was wired for other sizes of observation or action.
            ExneatError: the executor's cluster has no workers left, or cannot be used.
        """
        crew = self._crew(brains)
        results = Results.empty(len(crew.brains.size), len(episodes), len(self._task.terms))
        self._work.play(crew, episodes, results)
        return results.outcomes(self._task)

    def trace(self, brain: Brain | RandomActions, seeds: EpisodeSeeds) -> Trace:
        """The path of one episode, and the world that it went through; always runs in this process."""
        crew = self._crew([brain] if isinstance(brain, Brain) else brain)
        buffers = self._player.buffers(crew)
        results = Results.empty(1, 1, len(self._task.terms))
        columns = len(self._task.trace_columns) + len(self._task.terms)
        self._player.play(crew, buffers, (0, 1), seeds, results.of_episode(0))
        steps = np.zeros((int(results.steps[0, 0]) + 1, columns))
        self._player.play(crew, buffers, (0, 1), seeds, results.of_episode(0), steps)
        return Trace(steps, self._player.tiles())

    def _crew(self, brains: Brains | Sequence[Brain] | RandomActions) -> Crew:
        """Brains end to end; refuses those that compiled code would let read and write elsewhere."""
        task = self._task
        actions = len(task.actuator_names)
        low, high = np.zeros(actions), np.full(actions, task.tie_noise)
        if isinstance(brains, RandomActions):
            low, high = brains
            brains = [motionless(task.observation_size, np.zeros(len(low)))]
        brains = brains if isinstance(brains, Brains) else lay_out(brains)
        expected, came = (task.observation_size, actions), (brains.observation_size, brains.output_slot.shape[1])
        if came != expected:
            raise ValueError(f"brains: expected sizes {expected} of observation and action, got {came}")
        lowest, highest = task.observation_limits
        conditions = Conditions(float(self._noise.sensor_std), float(lowest), float(highest), low, high - low)
        return Crew(brains, conditions)
