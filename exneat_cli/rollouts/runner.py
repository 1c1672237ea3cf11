"""Runs brains through episodes, wherever the executor says.

Every episode draws from generators of its own, and a world is as new for each brain, so results depend neither on
the number of workers nor on which of them ran what.
"""

from __future__ import annotations

import contextlib
from collections import deque
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor, wait

import numpy as np

from exneat_cli.brains import Brains, motionless
from exneat_cli.brains.brain import lay_out
from exneat_cli.rollouts.cluster import cluster_of, keep_clusters
from exneat_cli.rollouts.episode import Acting, World
from exneat_cli.rollouts.outcomes import Outcomes, Tally, Trace
from exneat_cli.rollouts.settings import Executor, Noise
from exneat_cli.rollouts.sharing import shares_for_threads, short_shares
from exneat_cli.seeding import EpisodeSeeds
from exneat_cli.tasks import Task

Actors = Brains | Sequence[Brains] | None


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
        self._task, self._noise, self._executor, self._training = task, noise, executor, training
        self._halt = np.zeros(1, dtype=np.bool_)
        threads = executor.threads if executor.name == "threads" else 1
        self._worlds = [World(task, noise, training=training, halt=self._halt) for _ in range(threads)]
        self._pool = ThreadPoolExecutor(threads, thread_name_prefix="episodes")  # starts none before it has work
        with contextlib.ExitStack() as ending:
            ending.callback(self._pool.shutdown, cancel_futures=True)
            ending.callback(self._halt.fill, True)  # threads end before the next step of their episodes
            if executor.name == "dask":
                ending.enter_context(keep_clusters())
                cluster_of(executor)
            self._ending = ending.pop_all()

    def __enter__(self) -> Runner:
        return self

    def __exit__(self, *exception: object) -> None:
        self._ending.close()

    def run(self, brains: Actors, episodes: Sequence[EpisodeSeeds], *, moments: bool = False) -> Outcomes:
        """Outcomes of every brain (one, if it acts at random) in every episode.

        Args:
            brains: who acts; None for actions at random, uniform between the task's bounds.
            episodes: the same for all of them.
            moments: whether statistics of what each brain senses are wanted, see `Outcomes`.

        Raises:
            ValueError: there is no brain, or one was wired for other sizes of what is sensed or of the action.
            ExneatError: the executor's cluster has no workers left, or cannot be used.
        """
        acting = self._acting(brains)
        count = len(acting[0].size)
        tally = Tally.empty(self._task, count, len(episodes), moments=moments)
        if self._executor.name == "serial":
            self._worlds[0].run(short_shares(count, len(episodes)), acting, episodes, tally)
        elif self._executor.name == "threads":
            self._run_on_threads(acting, episodes, tally)
        else:
            cluster_of(self._executor).run((self._task, self._noise, self._training), acting, episodes, tally)
        return tally.outcomes(self._task)

    def trace(self, brain: Brains | None, seeds: EpisodeSeeds) -> Trace:
        """The path of one episode, and the world that it went through; always runs in this process."""
        acting = self._acting(brain)
        tally = Tally.empty(self._task, 1, 1, moments=False)
        path = np.zeros((self._task.longest_episode + 1, len(self._task.trace_columns) + len(self._task.terms)))
        self._worlds[0].run([(0, 0, 1)], acting, [seeds], tally, path)
        return Trace(path[: tally.steps[0, 0] + 1].copy(), self._worlds[0].tiles())

    def _run_on_threads(self, acting: Acting, episodes: Sequence[EpisodeSeeds], tally: Tally) -> None:
        """A thread per world: the compiled loop holds no GIL, so they run side by side."""
        # Threads may share the iterator of a list, which takes a step without letting go of the GIL; no generator.
        shares = iter(list(shares_for_threads(len(acting[0].size), len(episodes), len(self._worlds))))

        def work(world: World) -> None:
            try:
                world.run(shares, acting, episodes, tally)
            except BaseException:
                deque(shares, maxlen=0)  # nothing is left for the other threads
                raise

        for worker in wait([self._pool.submit(work, world) for world in self._worlds]).done:
            worker.result()

    def _acting(self, brains: Actors) -> Acting:
        """Brains end to end; refuses those that compiled code would let read and write elsewhere."""
        task = self._task
        actions = len(task.actuator_names)
        low, high = np.zeros(actions), np.full(actions, task.tie_noise)
        if brains is None:
            low, high = task.action_bounds
            brains = motionless(task.sensed_size, np.zeros(actions))
        brains = brains if isinstance(brains, Brains) else lay_out(brains)
        expected, came = (task.sensed_size, actions), (brains.observation_size, brains.output_slot.shape[1])
        if came != expected:
            raise ValueError(f"brains: expected sizes {expected} of observation and action, got {came}")
        return brains, low, high - low
