"""Runs episodes on threads: the compiled loop holds no GIL, so they run side by side.

Every episode draws from generators of its own, and a world is as new for each brain, so results depend neither on
the number of workers nor on which of them ran what.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exneat_cli.brains import Brain, Brains, RandomActions, motionless
from exneat_cli.brains.brain import lay_out, memory_size
from exneat_cli.errors import check_choice, check_whole
from exneat_cli.rollouts.episode import Buffers, Conditions, episode_loop
from exneat_cli.rollouts.noise import Noise
from exneat_cli.seeding import EpisodeSeeds, generator
from exneat_cli.tasks import FAILED, Simulation, Task

EXECUTORS = ("threads", "serial")
PIECES_AHEAD = 4
"""A thread takes this part of its fair share of what is left."""


@dataclass(frozen=True)
class Executor:
    """Where episodes run; results do not depend on it.

    Attributes:
        name: ``threads``, or ``serial`` for one thread.
        workers: number of threads; 0 takes every core this process may use.

    Raises:
        ConfigError: a value is out of range.
    """

    name: str = "threads"
    workers: int = 0

    def __post_init__(self) -> None:
        check_choice("executor.name", self.name, EXECUTORS)
        check_whole("executor.workers", self.workers, 0, 4096)

    @property
    def threads(self) -> int:
        """Number of threads that run at once."""
        if self.name == "serial":
            return 1
        return self.workers or _usable_cores()


class Outcomes(NamedTuple):
    """What B brains got in E episodes.

    Attributes:
        fitness: (B, E) the task's fitness; its failure floor where an episode failed.
        full_reward: (B, E) the task's second figure; the failure floor likewise.
        steps: (B, E) control steps done.
        failed: (B, E) whether physics or network exploded.
    """

    fitness: NDArray[np.float64]
    full_reward: NDArray[np.float64]
    steps: NDArray[np.int64]
    failed: NDArray[np.bool_]


class Trace(NamedTuple):
    """One episode, step by step.

    Attributes:
        steps: (steps + 1, columns); row t holds where the agent is after t steps (`Task.trace_columns`),
            then the reward terms of step t (`Task.terms`; 0 in the first row).
        tiles: (N, N, 3) path (1 or 0) and both channels of a grid world at the end; None elsewhere.
    """

    steps: NDArray[np.float64]
    tiles: NDArray[np.float64] | None


class Runner:
    """Episodes of one task under one noise; a context manager that ends its threads.

    Args:
        task: what is simulated.
        noise: what disturbs the agent.
        executor: how many threads; one world is opened for each.
        training: switches on the task's early stopping.
    """

    def __init__(self, task: Task, noise: Noise, executor: Executor, *, training: bool) -> None:
        self._task = task
        self._noise = noise
        self._halt = np.zeros(1, dtype=np.bool_)
        self._pool = ThreadPoolExecutor(executor.threads, thread_name_prefix="episodes")
        self._simulations = [
            task.open(training=training, reset_scale=noise.reset_scale) for _ in range(executor.threads)
        ]
        self._loop = episode_loop(self._simulations[0], task.name)
        self.compiled = self._simulations[0].compiled

    def __enter__(self) -> Runner:
        return self

    def __exit__(self, *exception: object) -> None:
        self._halt[0] = True
        self._pool.shutdown(cancel_futures=True)

    def run(self, brains: Brains | Sequence[Brain] | RandomActions, episodes: Sequence[EpisodeSeeds]) -> Outcomes:
        """Outcomes of every brain (one, if it acts at random) in every episode.

        Raises:
            ValueError: there is no brain, or one was wired for other sizes of observation or action.
        """
        crew = self._crew(brains)
        results = _Results.empty(len(crew.brains.size), len(episodes), len(self._task.terms))
        pieces = _Pieces(len(crew.brains.size), len(episodes), len(self._simulations))
        failed = threading.Event()

        def work(simulation: Simulation) -> None:
            buffers = self._buffers(crew)
            try:
                while not failed.is_set() and (piece := pieces.take()) is not None:
                    episode, first, last = piece
                    self._play(simulation, crew, buffers, (first, last), episodes[episode], results.of_episode(episode))
            except BaseException:
                failed.set()
                raise

        workers = [self._pool.submit(work, simulation) for simulation in self._simulations]
        wait(workers)
        for worker in workers:
            worker.result()
        return self._outcomes(results)

    def trace(self, brain: Brain | RandomActions, seeds: EpisodeSeeds) -> Trace:
        """The path of one episode, and the world that it went through."""
        crew = self._crew([brain] if isinstance(brain, Brain) else brain)
        buffers = self._buffers(crew)
        simulation, results = self._simulations[0], _Results.empty(1, 1, len(self._task.terms))
        columns = len(self._task.trace_columns) + len(self._task.terms)
        self._play(simulation, crew, buffers, (0, 1), seeds, results.of_episode(0))
        steps = np.zeros((int(results.steps[0, 0]) + 1, columns))
        self._play(simulation, crew, buffers, (0, 1), seeds, results.of_episode(0), steps)
        return Trace(steps, self._task.tiles(simulation.world))

    def _crew(self, brains: Brains | Sequence[Brain] | RandomActions) -> _Crew:
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
        return _Crew(brains, conditions)

    def _buffers(self, crew: _Crew) -> Buffers:
        conditions, steps = crew.conditions, self._task.longest_episode
        shaken = bool(conditions.action_low.any() or conditions.action_span.any())
        return Buffers(
            memory=np.zeros(memory_size(crew.brains)),
            action=np.zeros(len(conditions.action_low)),
            terms=np.zeros(len(self._task.terms)),
            sensor_noise=np.zeros((steps, self._task.observation_size if conditions.sensor_std > 0.0 else 0)),
            action_noise=np.zeros((steps, len(conditions.action_low) if shaken else 0)),
        )

    def _play(
        self,
        simulation: Simulation,
        crew: _Crew,
        buffers: Buffers,
        chosen: tuple[int, int],
        seeds: EpisodeSeeds,
        results: _Results,
        trace: NDArray[np.float64] | None = None,
    ) -> None:
        located = len(self._task.trace_columns)
        self._loop(
            simulation.world,
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

    def _outcomes(self, results: _Results) -> Outcomes:
        task = self._task
        with np.errstate(invalid="ignore"):
            fitness, full_reward = task.fitness_of(results.totals).T, task.full_reward_of(results.totals).T
        failed = (results.status.T == FAILED) | ~np.isfinite(fitness) | ~np.isfinite(full_reward)
        floor = task.failure_floor
        return Outcomes(np.where(failed, floor, fitness), np.where(failed, floor, full_reward), results.steps.T, failed)


class _Crew(NamedTuple):
    """Who acts, and what happens to its inputs and actions."""

    brains: Brains
    conditions: Conditions


class _Results(NamedTuple):
    """What the loop writes: how episodes ended, their steps and the sums of their terms, (E, B, ...) each."""

    status: NDArray[np.int64]
    steps: NDArray[np.int64]
    totals: NDArray[np.float64]

    @classmethod
    def empty(cls, brains: int, episodes: int, terms: int) -> _Results:
        shape = (episodes, brains)
        return cls(np.zeros(shape, np.int64), np.zeros(shape, np.int64), np.zeros((*shape, terms)))

    def of_episode(self, episode: int) -> _Results:
        return _Results(*(values[episode] for values in self))


class _Pieces:
    """Shares work out: episode by episode, in pieces that shrink towards the end.

    A piece is some brains in one episode. Large ones spare calls and the drawing of worlds; small last ones
    let all threads end together (guided self-scheduling; Polychronopoulos and Kuck, 1987).
    """

    def __init__(self, brains: int, episodes: int, threads: int) -> None:
        self._brains = brains
        self._total = brains * episodes
        self._threads = threads
        self._taken = 0
        self._lock = threading.Lock()

    def take(self) -> tuple[int, int, int] | None:
        """The next episode, its first brain and the one after its last; None when all are taken."""
        with self._lock:
            left = self._total - self._taken
            if left == 0:
                return None
            episode, first = divmod(self._taken, self._brains)
            fair = left if self._threads == 1 else max(1, left // (PIECES_AHEAD * self._threads))
            last = min(self._brains, first + fair)
            self._taken += last - first
            return episode, first, last


def _usable_cores() -> int:
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
