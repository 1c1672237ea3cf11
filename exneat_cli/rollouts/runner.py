"""Runs brains through episodes, wherever the executor says.

Every episode draws from generators of its own, and a world is as new for each brain, so results depend neither on
the number of workers nor on which of them ran what.
"""

from __future__ import annotations

import contextlib
import functools
import time
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exneat_cli.brains import Brains, motionless
from exneat_cli.brains.brain import lay_out
from exneat_cli.rollouts.episode import Acting, Share, Tally, empty_tally, open_world, run_shares
from exneat_cli.rollouts.settings import Executor, Noise
from exneat_cli.rollouts.workers import keep_workers, workers_of
from exneat_cli.seeding import EpisodeSeeds
from exneat_cli.tasks import FAILED, HasFullReward, HasTiles, Simulation, Task
from exneat_cli.wiring import Moments, merged

Actors = Brains | Sequence[Brains] | None
Trace = tuple[NDArray[np.float64], NDArray[np.float64] | None]
"""One episode: (steps + 1, columns) step by step, and the tiles of a grid world at its end, see `HasTiles`.

Row t holds where the agent is after t steps (`Task.trace_columns`), then the reward terms of step t (`Task.terms`; 0 in
the first row).
"""

SHARES_AHEAD = 4
"""A thread takes this part of its fair share of what is left."""
LONGEST_CALL = 0.25
"""Seconds that a call of compiled code in the main thread should not exceed: signals wait for its end."""


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


class Runner:
    """Episodes of one task under one noise; a context manager that ends its threads or processes.

    Args:
        task: what is simulated.
        noise: what disturbs the agent.
        executor: where; one world is opened for each thread. Of ``warp``, for training alone, else on all cores.
        training: switches on the task's early stopping.

    Raises:
        ExneatError: the executor's cluster cannot be reached, or its library is not installed.
    """

    def __init__(self, task: Task, noise: Noise, executor: Executor, *, training: bool) -> None:
        if executor.name == "warp" and not training:
            executor = Executor()  # figures that count are those of double precision
        self._task, self._noise, self._executor, self._training = task, noise, executor, training
        self._halt = np.zeros(1, dtype=np.bool_)
        self._run = functools.partial(run_shares, task, noise, self._halt)
        threads = executor.threads if executor.name == "threads" else 1
        self._worlds = [open_world(task, noise, training=training) for _ in range(threads)]
        self._pool = ThreadPoolExecutor(threads, thread_name_prefix="episodes")  # starts none before it has work
        with contextlib.ExitStack() as ending:
            ending.callback(self._pool.shutdown, cancel_futures=True)
            ending.callback(self._halt.fill, True)  # threads end before the next step of their episodes
            if executor.name in ("processes", "dask", "warp"):
                ending.enter_context(keep_workers())
                workers_of(executor)
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
            ExneatError: the executor has no workers left, or its cluster cannot be used.
        """
        acting = self._acting(brains)
        count = len(acting[0].size)
        tally = empty_tally(self._task, count, len(episodes), moments=moments)
        if self._executor.name == "serial":
            self._run(self._worlds[0], short_shares(count, len(episodes)), acting, episodes, tally)
        elif self._executor.name == "threads":
            self._run_on_threads(acting, episodes, tally)
        else:
            workers_of(self._executor).run((self._task, self._noise, self._training), acting, episodes, tally)
        return _outcomes(self._task, tally)

    def trace(self, brain: Brains | None, seeds: EpisodeSeeds) -> Trace:
        """The path of one episode, and the world that it went through; always runs in this process."""
        acting = self._acting(brain)
        tally = empty_tally(self._task, 1, 1, moments=False)
        path = np.zeros((self._task.longest_episode + 1, len(self._task.trace_columns) + len(self._task.terms)))
        self._run(self._worlds[0], [(0, 0, 1)], acting, [seeds], tally, path)
        steps, world = tally[1][0, 0], self._worlds[0].world
        return path[: steps + 1].copy(), self._task.tiles(world) if isinstance(self._task, HasTiles) else None

    def _run_on_threads(self, acting: Acting, episodes: Sequence[EpisodeSeeds], tally: Tally) -> None:
        """A thread per world: the compiled loop holds no GIL, so they run side by side."""
        # Threads may share the iterator of a list, which takes a step without letting go of the GIL; no generator.
        shares = iter(list(shares_for_threads(len(acting[0].size), len(episodes), len(self._worlds))))

        def work(world: Simulation) -> None:
            try:
                self._run(world, shares, acting, episodes, tally)
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


def shares_for_threads(brains: int, episodes: int, threads: int) -> Iterator[Share]:
    """Episode by episode, some brains at a time: large shares spare calls and the drawing of worlds.

    Shares shrink, so that all threads end together (guided self-scheduling; Polychronopoulos and Kuck, 1987).
    """
    left = brains * episodes
    for episode in range(episodes):
        first = 0
        while first < brains:
            fair = left if threads == 1 else max(1, left // (SHARES_AHEAD * threads))
            last = min(brains, first + fair)
            yield episode, first, last
            left -= last - first
            first = last


def short_shares(brains: int, episodes: int) -> Iterator[Share]:
    """The same for the main thread: as large as can be done within `LONGEST_CALL`, by the time the last ones took."""
    size = 1
    for episode in range(episodes):
        first = 0
        while first < brains:
            last, began = min(brains, first + size), time.perf_counter()
            yield episode, first, last
            seconds = time.perf_counter() - began
            if seconds > LONGEST_CALL:
                size = max(1, size // 2)
            elif seconds < LONGEST_CALL / 8:
                size *= 4
            first = last


def _outcomes(task: Task, tally: Tally) -> Outcomes:
    """What a tally means in a task."""
    statuses, steps, totals, means, squares = tally
    with np.errstate(invalid="ignore"):
        fitness = task.fitness_of(totals).T
        full_reward = task.full_reward_of(totals).T if isinstance(task, HasFullReward) else fitness
    failed = (statuses.T == FAILED) | ~np.isfinite(fitness) | ~np.isfinite(full_reward)
    return Outcomes(
        fitness=np.where(failed, task.failure_floor, fitness),
        full_reward=np.where(failed, task.failure_floor, full_reward),
        steps=steps.T,
        failed=failed,
        moments=_moments(~failed.T, steps, means, squares) if means.shape[-1] else None,
    )


def _moments(
    sound: NDArray[np.bool_], steps: NDArray[np.int64], means: NDArray[np.float64], squares: NDArray[np.float64]
) -> Moments:
    """(B, sensed) over the `sound`, (E, B), episodes, merged in their order."""
    # What is not finite would stay so in the statistics of a whole training.
    sound = (sound & np.isfinite(squares).all(axis=-1))[..., np.newaxis]
    each = (np.where(sound, values, 0.0) for values in (steps[..., np.newaxis], means, squares))
    rows = (np.broadcast_to(values, means.shape).reshape(len(sound), -1) for values in each)
    together = merged(map(Moments, *rows), means[0].size)
    return Moments(*(values.reshape(means.shape[1:]) for values in together))
