"""Work for worker processes: how it is divided into blocks, and how a worker runs one."""

from __future__ import annotations

import functools
import pickle
import platform
import sys
import time
from importlib.metadata import version

import numpy as np

import exneat_cli
from exneat_cli.compiling import source_digest
from exneat_cli.errors import ExneatError
from exneat_cli.rollouts.episode import Tally, empty_tally, open_world, run_shares
from exneat_cli.rollouts.settings import Noise
from exneat_cli.tasks import Simulation, Task

Setup = tuple[Task, Noise, bool]
"""The setup of a world: a task, its noise, and whether this is training."""
WORTH_SECONDS = 0.05
"""Minimum duration of a block (s), if there is enough work: sending one costs 3 to 5 ms."""
BLOCKS_PER_WORKER = 8
"""Number of blocks per worker, so that workers finish at about the same time."""


def blocks(brains: int, episodes: int, workers: int, smallest: int) -> list[tuple[slice, slice]]:
    """Equal blocks of brains and episodes for the workers: whole rows if possible, so that a brain is sent only once.

    Blocks hold at least `smallest` pairs of a brain and an episode, if there is work for all workers.
    """
    runs = brains * episodes
    wanted = min(runs, max(workers, min(BLOCKS_PER_WORKER * workers, runs // smallest)))
    rows = max(1, min(brains, wanted))
    columns = -(-wanted // rows)
    return [(some, which) for some in _slices(brains, rows) for which in _slices(episodes, columns)]


def _slices(count: int, parts: int) -> list[slice]:
    return [slice(count * k // parts, count * (k + 1) // parts) for k in range(parts)]


def run_block(expected: dict[str, str], world: bytes, work: bytes) -> tuple[Tally, float]:
    """Run some brains through some episodes, in a worker; returns their tally and the time that it took (s).

    `world` holds, pickled, the requesting process's module search path and the pickled `Setup`; `work` holds `Acting`,
    episodes, and whether statistics of the sensed values are wanted.

    Raises:
        ExneatError: a version differs from the `expected` one, that of the requesting process.
    """
    for name, wanted in expected.items():
        if (came := versions()[name]) != wanted:
            fix = "install the same on all machines and start the workers again"
            raise ExneatError(f"executor=dask: expected workers with {name} {wanted}, got {came}\n  {fix}")
    path, setup = pickle.loads(world)
    sys.path.extend(place for place in path if place not in sys.path)  # a user's task may be anywhere
    (task, noise, training), (acting, episodes, moments) = pickle.loads(setup), pickle.loads(work)
    idle = _idle_worlds(world)
    try:
        own = idle.pop()
    except IndexError:  # not tested beforehand, since another thread may take the last one in between
        own = open_world(task, noise, training=training)
    brains, began = len(acting[0].size), time.perf_counter()
    tally = empty_tally(task, brains, len(episodes), moments=moments)
    shares = [(episode, 0, brains) for episode in range(len(episodes))]
    run_shares(task, noise, np.zeros(1, np.bool_), own, shares, acting, episodes, tally)
    idle.append(own)
    return tally, time.perf_counter() - began


@functools.lru_cache(4)  # a robustness sweep has a new setup at every level
def _idle_worlds(world: bytes) -> list[Simulation]:
    """Open worlds of this worker that are not in use; callers take them from this list and return them to it."""
    return []


@functools.cache
def versions() -> dict[str, str]:
    """Versions that must be the same here and in every worker, or results could differ."""
    return {
        "exneat": f"{exneat_cli.__version__} with sources {source_digest()[:8]}",
        "Python": ".".join(platform.python_version_tuple()[:2]),
        **{library: version(library) for library in ("numpy", "numba", "mujoco")},
    }
