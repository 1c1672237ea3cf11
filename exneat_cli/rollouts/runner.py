"""Runs brains through episodes on the chosen executor.

Every episode draws from its own generators, and every brain gets a fresh world, so results depend neither on the
number of workers nor on how the work is divided among them.
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
"""One episode: its path, (steps + 1, columns), and the tiles of a grid world at its end, see `HasTiles`.

Row t holds the agent's location after t steps (`Task.trace_columns`), then the reward terms of step t (`Task.terms`; 0
in the first row).
"""

SHARES_AHEAD = 4
"""A thread takes its fair share of the remaining work, divided by this."""
LONGEST_CALL = 0.25
"""Desired maximum duration of a compiled call in the main thread (s): signals wait until it ends."""


class Outcomes(NamedTuple):
    """The outcomes of B brains in E episodes.

    Attributes:
        fitness: (B, E) the task's fitness; its failure floor for failed episodes.
        full_reward: (B, E) the full reward if the task has one, else the fitness; likewise with the failure floor.
        steps: (B, E) number of control steps.
        failed: (B, E) whether the simulation became unstable or a value was not finite.
        moments: (B, sensed) moments of the values that each brain sensed in its episodes, except failed ones; None
            unless they are wanted.
    """

    fitness: NDArray[np.float64]
    full_reward: NDArray[np.float64]
    steps: NDArray[np.int64]
    failed: NDArray[np.bool_]
    moments: Moments | None = None


class Runner:
    """Runs episodes of one task with one noise; a context manager that ends its threads or processes.

    Args:
        task: the task that is simulated.
        noise: noise on sensors and on the initial pose.
        executor: where episodes run; one world is opened for each thread. ``warp`` is used only in training, and
            replaced by threads on all cores otherwise.
        training: whether to enable features of training, such as early stopping.

    Raises:
        ExneatError: the executor's cluster cannot be reached, or its library is not installed.
    """

    def __init__(self, task: Task, noise: Noise, executor: Executor, *, training: bool) -> None:
        if executor.name == "warp" and not training:
            executor = Executor()  # results are only reported in double precision
        self._task, self._noise, self._executor, self._training = task, noise, executor, training
        self._halt = np.zeros(1, dtype=np.bool_)
        self._run = functools.partial(run_shares, task, noise, self._halt)
        threads = executor.threads if executor.name == "threads" else 1
        self._worlds = [open_world(task, noise, training=training) for _ in range(threads)]
        self._pool = ThreadPoolExecutor(threads, thread_name_prefix="episodes")  # starts no threads before it has work
        with contextlib.ExitStack() as ending:
            ending.callback(self._pool.shutdown, cancel_futures=True)
            ending.callback(self._halt.fill, True)  # threads stop before the next step of their episodes
            if executor.name in ("processes", "dask", "warp"):
                ending.enter_context(keep_workers())
                workers_of(executor)
            self._ending = ending.pop_all()

    def __enter__(self) -> Runner:
        return self

    def __exit__(self, *exception: object) -> None:
        self._ending.close()

    def run(self, brains: Actors, episodes: Sequence[EpisodeSeeds], *, moments: bool = False) -> Outcomes:
        """Outcomes of every brain (or of one agent that acts at random) in every episode.

        Args:
            brains: the brains; None for random actions, uniform between the task's bounds.
            episodes: the same ones for all brains.
            moments: whether statistics of the sensed values are wanted, see `Outcomes`.

        Raises:
            ValueError: there is no brain, or one has another number of sensed values or actuators than the task.
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
        """The path of one episode, and the tiles of its world; always runs in this process."""
        acting = self._acting(brain)
        tally = empty_tally(self._task, 1, 1, moments=False)
        path = np.zeros((self._task.longest_episode + 1, len(self._task.trace_columns) + len(self._task.terms)))
        self._run(self._worlds[0], [(0, 0, 1)], acting, [seeds], tally, path)
        steps, world = tally[1][0, 0], self._worlds[0].world
        return path[: steps + 1].copy(), self._task.tiles(world) if isinstance(self._task, HasTiles) else None

    def _run_on_threads(self, acting: Acting, episodes: Sequence[EpisodeSeeds], tally: Tally) -> None:
        """Run one thread per world: the compiled loop releases the GIL, so they run in parallel."""
        # Threads may share a list iterator, which does not release the GIL during a step, but not a generator.
        shares = iter(list(shares_for_threads(len(acting[0].size), len(episodes), len(self._worlds))))

        def work(world: Simulation) -> None:
            try:
                self._run(world, shares, acting, episodes, tally)
            except BaseException:
                deque(shares, maxlen=0)  # leaves nothing for the other threads
                raise

        for worker in wait([self._pool.submit(work, world) for world in self._worlds]).done:
            worker.result()

    def _acting(self, brains: Actors) -> Acting:
        """Brains end to end; refuses wrong sizes, with which compiled code would read and write out of bounds."""
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
    """Shares for threads, episode by episode: large ones save calls and the drawing of worlds.

    Shares shrink, so that all threads finish together (guided self-scheduling; Polychronopoulos and Kuck, 1987).
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
    """Shares for the main thread: as large as fits in `LONGEST_CALL`, judged by the time of the last ones."""
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
    """Outcomes from a tally of a task."""
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
    """(B, sensed) moments over the `sound` episodes, (E, B), merged in their order."""
    # A value that is not finite would spoil the statistics of the whole training.
    sound = (sound & np.isfinite(squares).all(axis=-1))[..., np.newaxis]
    each = (np.where(sound, values, 0.0) for values in (steps[..., np.newaxis], means, squares))
    rows = (np.broadcast_to(values, means.shape).reshape(len(sound), -1) for values in each)
    together = merged(map(Moments, *rows), means[0].size)
    return Moments(*(values.reshape(means.shape[1:]) for values in together))
