"""Runs episodes on threads: the compiled loop holds no GIL, so they run side by side.

Every episode draws from generators of its own and starts in a reset world, so results depend neither on
the number of workers nor on which of them ran what.
"""

from __future__ import annotations

import itertools
import math
import os
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.random import PCG64, Generator
from numpy.typing import NDArray

from exneat_cli.brains import Brain, RandomActions
from exneat_cli.brains.brain import sizes
from exneat_cli.errors import check_choice, check_whole
from exneat_cli.rollouts.episode import Conditions, episode_loop
from exneat_cli.rollouts.noise import Noise
from exneat_cli.seeding import EpisodeSeeds
from exneat_cli.tasks import FAILED, Simulation, Task

EXECUTORS = ("threads", "serial")


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


class Job(NamedTuple):
    """One brain in one episode."""

    brain: Brain | RandomActions
    seeds: EpisodeSeeds


class Outcome(NamedTuple):
    """What one episode gave.

    Attributes:
        fitness: the task's fitness; its failure floor if the episode failed.
        full_reward: the task's second figure; the failure floor likewise.
        steps: control steps done.
        failed: whether physics or network exploded.
    """

    fitness: float
    full_reward: float
    steps: int
    failed: bool


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
        self._loops: dict[type[Any], Callable[..., Any]] = {}
        self._stop = threading.Event()
        self._pool = ThreadPoolExecutor(executor.threads, thread_name_prefix="episodes")
        self._booths = [
            _Booth(task, noise, task.open(training=training, reset_scale=noise.reset_scale))
            for _ in range(executor.threads)
        ]
        self.compiled = self._booths[0].simulation.compiled

    def __enter__(self) -> Runner:
        return self

    def __exit__(self, *exception: object) -> None:
        self._stop.set()
        self._pool.shutdown(cancel_futures=True)

    def run(self, jobs: Sequence[Job]) -> list[Outcome]:
        """Outcomes in the order of the jobs.

        Raises:
            ValueError: a brain was wired for other sizes of observation or action.
        """
        self._prepare(jobs)
        episodes = {id(job.seeds): job.seeds for job in jobs}
        starts = {key: _generator_states(seeds) for key, seeds in episodes.items()}
        outcomes: list[Outcome | None] = [None] * len(jobs)
        positions = itertools.count()
        failed = threading.Event()

        def work(booth: _Booth) -> None:
            try:
                while (k := next(positions)) < len(jobs) and not (self._stop.is_set() or failed.is_set()):
                    job = jobs[k]
                    outcomes[k] = booth.run(self._loops[type(job.brain)], job.brain, starts[id(job.seeds)])
            except BaseException:
                failed.set()
                raise

        # Each thread takes the next job when it is free: episodes differ in length, and a future each costs
        # more than a short one.
        workers = [self._pool.submit(work, booth) for booth in self._booths]
        wait(workers)
        for worker in workers:
            worker.result()
        return [outcome for outcome in outcomes if outcome is not None]

    def run_each(self, brains: Sequence[Brain], episodes: Sequence[EpisodeSeeds]) -> list[list[Outcome]]:
        """The outcomes of every brain, in the order of the brains, in all of the same episodes."""
        outcomes = self.run([Job(brain, seeds) for brain in brains for seeds in episodes])
        return [outcomes[k * len(episodes) : (k + 1) * len(episodes)] for k in range(len(brains))]

    def trace(self, job: Job) -> Trace:
        """The path of one episode, and the world that it went through."""
        self._prepare([job])
        booth, loop = self._booths[0], self._loops[type(job.brain)]
        states = _generator_states(job.seeds)
        columns = len(self._task.trace_columns) + len(self._task.terms)
        steps = np.zeros((booth.run(loop, job.brain, states).steps + 1, columns))
        booth.run(loop, job.brain, states, steps)
        return Trace(steps, self._task.tiles(booth.simulation.world))

    def _prepare(self, jobs: Sequence[Job]) -> None:
        """Refuse brains that compiled code would let read and write elsewhere, and bind every loop."""
        expected = self._task.observation_size, len(self._task.actuator_names)
        for brain in {id(job.brain): job.brain for job in jobs}.values():
            fits = sizes(brain) == expected if isinstance(brain, Brain) else len(brain.low) == expected[1]
            if not fits:
                raise ValueError(f"a brain for another task: expected sizes {expected} of observation and action")
        for brain_type in {type(job.brain) for job in jobs} - set(self._loops):
            self._loops[brain_type] = episode_loop(self._booths[0].simulation, brain_type, self._task.name)


class _Booth:
    """What one thread needs to run episodes: a world, three generators, and buffers to reuse."""

    def __init__(self, task: Task, noise: Noise, simulation: Simulation) -> None:
        self.simulation = simulation
        self._task = task
        self._generators = [Generator(PCG64(0)) for _ in EpisodeSeeds._fields]
        lowest, highest = task.observation_limits
        self._conditions = Conditions(float(noise.sensor_std), float(lowest), float(highest), float(task.tie_noise))
        self._observation = np.zeros(task.observation_size)
        self._action = np.zeros(len(task.actuator_names))
        self._totals = np.zeros(len(task.terms))
        self._no_trace = np.zeros((0, len(task.trace_columns) + len(task.terms)))
        self._located = len(task.trace_columns)

    def run(
        self,
        loop: Callable[..., Any],
        brain: Brain | RandomActions,
        states: Sequence[dict[str, Any]],
        trace: NDArray[np.float64] | None = None,
    ) -> Outcome:
        """One episode, with the generators put to `states` first."""
        for rng, state in zip(self._generators, states, strict=True):
            rng.bit_generator.state = state
        status, steps = loop(
            self.simulation.world,
            brain,
            *self._generators,
            self._conditions,
            self._observation,
            self._action,
            self._totals,
            self._no_trace if trace is None else trace,
            self._located,
        )
        task, totals = self._task, self._totals
        fitness, full_reward = task.fitness_of(totals), task.full_reward_of(totals)
        if status == FAILED or not (math.isfinite(fitness) and math.isfinite(full_reward)):
            return Outcome(task.failure_floor, task.failure_floor, int(steps), True)
        return Outcome(fitness, full_reward, int(steps), False)


def _generator_states(seeds: EpisodeSeeds) -> list[dict[str, Any]]:
    """Where the generators of an episode start; setting a state is cheaper than making a generator."""
    return [dict(PCG64(seed).state) for seed in seeds]


def _usable_cores() -> int:
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
