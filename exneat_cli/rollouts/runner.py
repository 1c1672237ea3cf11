"""Runs episodes on threads: the compiled loop holds no GIL, so they run side by side.

Every episode draws from generators of its own and starts in a reset world, so results depend neither on
the number of workers nor on which of them ran what.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from queue import SimpleQueue
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exneat_cli.brains import Brain, RandomActions
from exneat_cli.brains.brain import sizes
from exneat_cli.errors import check_choice, check_whole
from exneat_cli.rollouts.episode import episode_loop
from exneat_cli.rollouts.noise import Noise
from exneat_cli.seeding import EpisodeSeeds, generator
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
        self._idle: SimpleQueue[Simulation] = SimpleQueue()
        self._loops: dict[type[Any], Callable[..., Any]] = {}
        self._pool = ThreadPoolExecutor(executor.threads, thread_name_prefix="episodes")
        for _ in range(executor.threads):
            simulation = task.open(training=training, reset_scale=noise.reset_scale)
            self._idle.put(simulation)
        self._any_simulation = simulation
        self.compiled = simulation.compiled

    def __enter__(self) -> Runner:
        return self

    def __exit__(self, *exception: object) -> None:
        self._pool.shutdown(cancel_futures=True)

    def run(self, jobs: Sequence[Job]) -> list[Outcome]:
        """Outcomes in the order of the jobs.

        Raises:
            ValueError: a brain was wired for other sizes of observation or action.
        """
        self._prepare(jobs)
        return list(self._pool.map(self._run_one, jobs))

    def trace(self, job: Job) -> NDArray[np.float64]:
        """The path of one episode.

        Returns:
            (steps + 1, columns): row t holds where the agent is after t steps (`Task.trace_columns`), then
            the reward terms of step t (`Task.terms`; 0 in the first row).
        """
        self._prepare([job])
        columns = len(self._task.trace_columns) + len(self._task.terms)
        trace = np.zeros((self._run_one(job).steps + 1, columns))
        self._run_one(job, trace)
        return trace

    def _prepare(self, jobs: Sequence[Job]) -> None:
        """Refuse brains that compiled code would let read and write elsewhere, and bind every loop."""
        expected = self._task.observation_size, len(self._task.actuator_names)
        for brain in {id(job.brain): job.brain for job in jobs}.values():
            fits = sizes(brain) == expected if isinstance(brain, Brain) else len(brain.low) == expected[1]
            if not fits:
                raise ValueError(f"a brain for another task: expected sizes {expected} of observation and action")
        for brain_type in {type(job.brain) for job in jobs} - set(self._loops):
            self._loops[brain_type] = episode_loop(self._any_simulation, brain_type, self._task.name)

    def _run_one(self, job: Job, trace: NDArray[np.float64] | None = None) -> Outcome:
        task = self._task
        totals = np.zeros(len(task.terms))
        if trace is None:
            trace = np.zeros((0, len(task.trace_columns) + len(task.terms)))
        simulation = self._idle.get()
        try:
            status, steps = self._loops[type(job.brain)](
                simulation.world,
                job.brain,
                generator(job.seeds.world),
                generator(job.seeds.sensor_noise),
                generator(job.seeds.actions),
                float(self._noise.sensor_std),
                np.zeros(task.observation_size),
                np.zeros(len(task.actuator_names)),
                totals,
                trace,
                len(task.trace_columns),
            )
        finally:
            self._idle.put(simulation)
        fitness, full_reward = task.fitness(totals), task.full_reward(totals)
        failed = status == FAILED or not (np.isfinite(fitness) and np.isfinite(full_reward))
        if failed:
            return Outcome(task.failure_floor, task.failure_floor, int(steps), True)
        return Outcome(fitness, full_reward, int(steps), False)


def _usable_cores() -> int:
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
