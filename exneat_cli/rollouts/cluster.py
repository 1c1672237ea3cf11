"""Runs episodes in the worker processes of dask clusters: one on this machine, started for it, or one at an address.

Work is done again when the worker that had it dies, and results are put where they belong, so that neither
deaths nor the order of things show in them. dask is imported when the first cluster is opened, never before.
"""

from __future__ import annotations

import asyncio
import contextlib
import functools
import logging
import math
import pickle
import platform
import signal
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from importlib.metadata import version
from multiprocessing import resource_tracker
from typing import Any

import numpy as np

import exneat_cli
from exneat_cli.compiling import source_digest
from exneat_cli.errors import ExneatError
from exneat_cli.rollouts.episode import Acting, Tally, empty_tally, open_world, run_shares
from exneat_cli.rollouts.settings import Executor, Noise
from exneat_cli.seeding import EpisodeSeeds
from exneat_cli.tasks import Simulation, Task

WORTH_SECONDS = 0.05
"""A block takes at least this long, where there is so much to do: sending it costs 3 to 5 ms."""
PATIENCE_SECONDS = 60.0
"""How long a cluster may be without any worker."""
CONNECT_SECONDS = 8
"""How long to wait for the scheduler at an address."""
BLOCKS_PER_WORKER = 8
"""So many blocks let workers end together."""

_open: dict[Executor, _Cluster] = {}
_users = 0
_lock = threading.RLock()


@contextlib.contextmanager
def keep_clusters() -> Iterator[None]:
    """While inside, clusters that runners open stay open for the next ones; the last to leave closes them."""
    global _users
    with _lock:
        _users += 1
    try:
        yield
    finally:
        with _lock, contextlib.ExitStack() as closing:
            _users -= 1
            while not _users and _open:
                closing.callback(_open.popitem()[1].close)


def cluster_of(executor: Executor) -> _Cluster:
    """The open cluster of an executor, or a new one; within `keep_clusters`.

    Raises:
        ExneatError: dask is not installed, or nothing answers at the executor's address.
    """
    with _lock:
        if executor in _open and _open[executor].client.status != "running":
            _open.pop(executor).close()
        if executor not in _open:
            _open[executor] = _Cluster(executor)
        return _open[executor]


class _Cluster:
    """A connection to a scheduler, and the workers that were started for it, which `close` ends with their files."""

    def __init__(self, executor: Executor) -> None:
        executor.check_installed()
        import dask
        from distributed import Client
        from distributed.utils import silence_logging_cmgr

        self._executor = executor
        self._seconds_per_run = math.inf
        address, self._own = executor.address, None
        self._name = f"the scheduler at {address}" if address else "the cluster on this machine"
        with contextlib.ExitStack() as ending:
            # What goes wrong is said by us, once; dask would add pages.
            ending.enter_context(silence_logging_cmgr(logging.CRITICAL))
            ending.enter_context(dask.config.set({"distributed.admin.large-graph-warning-threshold": "1GB"}))
            if address is None:
                self._own = self._started(ending)
            try:
                self.client: Any = Client(address or self._own, timeout=CONNECT_SECONDS, set_as_default=False)
            except (OSError, ValueError) as error:
                what = f"executor.address: expected a dask scheduler at {address}, got none"
                fix = "start one with: dask scheduler; the address is in its first lines"
                raise ExneatError(f"{what}\n  {fix}") from error
            ending.callback(self.client.close)
            self.close = ending.pop_all().close

    def run(
        self, setup: tuple[Task, Noise, bool], acting: Acting, episodes: Sequence[EpisodeSeeds], tally: Tally
    ) -> None:
        """Run every brain through every episode of a task, under its noise and in training or not; write `tally`.

        Raises:
            ExneatError: no worker was there for `PATIENCE_SECONDS`, brains killed one worker after the other, or
                a worker has other versions.
        """
        from distributed import KilledWorker
        from distributed.protocol.pickle import dumps

        (brains, *added), moments = acting, bool(tally[-1].size)
        workers = self._threads() or 1 if self._own is None else self._executor.threads
        smallest = math.ceil(WORTH_SECONDS / self._seconds_per_run)
        world, waiting = dumps(setup), {}
        pool = self.client.get_executor(pure=False)
        try:
            for some, which in blocks(len(brains.size), len(episodes), workers, max(1, smallest)):
                # dask's own pickling, but in one piece: arrays that travel on their own arrive read-only, for which
                # numba would compile everything anew.
                work = dumps(((brains.part(some.start, some.stop), *added), list(episodes[which]), moments))
                waiting[pool.submit(run_block, versions(), world, work)] = which, some
            self._gather(waiting, tally)
        except ImportError as error:
            fix = "install the same exneat[dask] on all machines and start the workers again"
            raise ExneatError(f"executor=dask: a worker cannot import what it needs: {error}\n  {fix}") from error
        except KilledWorker as error:
            raise ExneatError("executor=dask: gave up: one worker after the other died over the same brains") from error
        finally:
            if self.client.status == "running":
                pool.shutdown(wait=False)  # what waits is not begun; what is being run ends by itself

    def _gather(self, waiting: dict[Future[tuple[Tally, float]], tuple[slice, slice]], tally: Tally) -> None:
        """Write what comes back to its place, (episodes, brains), and see that there are workers meanwhile."""
        pace, workers_seen = math.inf, time.monotonic()
        while waiting:
            done, _ = wait(waiting, timeout=1.0, return_when=FIRST_COMPLETED)
            if self.client.status != "running" or any(future.cancelled() for future in done):
                raise ExneatError(f"executor=dask: {self._name} went away")
            for future in done:
                place = waiting.pop(future)
                part, seconds = future.result()
                for own, values in zip(tally, part, strict=True):
                    own[place] = values
                pace = min(pace, seconds / part[0].size)  # the longer ones loaded compiled code
            if done or self._threads():
                workers_seen = time.monotonic()
            elif time.monotonic() - workers_seen > PATIENCE_SECONDS:
                fix = "\n  start some: dask worker <address> --nworkers auto --nthreads 1" if self._own is None else ""
                raise ExneatError(f"executor=dask: {self._name} had no workers for {PATIENCE_SECONDS:.0f} s{fix}")
            if self._own is not None and not done:
                self._own.scale(self._executor.threads)  # starts those again that dask had given up
        self._seconds_per_run = pace

    def _threads(self) -> int:
        """How many threads all workers have together, now; 0 also if the scheduler cannot be asked."""
        try:
            return sum(self.client.nthreads().values())
        except (OSError, AttributeError, asyncio.CancelledError):  # it went away just now
            return 0

    def _started(self, ending: contextlib.ExitStack) -> Any:
        """A scheduler and workers on this machine; no worker is waited for."""
        from distributed import LocalCluster

        # dask would leave its own directory for such files where it is.
        scratch = ending.enter_context(tempfile.TemporaryDirectory(prefix="exneat-", ignore_cleanup_errors=True))
        cluster: Any = LocalCluster(
            n_workers=0,
            threads_per_worker=1,
            processes=True,
            host="127.0.0.1",
            dashboard_address=None,
            # The scheduler listens there without a dashboard too.
            scheduler_kwargs={"dashboard": False, "dashboard_address": "127.0.0.1:0", "local_directory": scratch},
            memory_limit=0,
            local_directory=scratch,
            silence_logs=logging.CRITICAL,
            config={"distributed.worker.profile.enabled": False},
        )
        ending.callback(cluster.close)
        ending.callback(cluster.sync, _stop_workers, cluster)
        resource_tracker.ensure_running()  # its first start would undo the next line
        cluster.sync(_ignore_interrupts)
        cluster.scale(self._executor.threads)
        return cluster


async def _ignore_interrupts() -> None:
    """Children inherit what this thread blocks: Ctrl-C reaches them too, but is ours to answer."""
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})


async def _stop_workers(cluster: Any) -> None:
    """End the workers; those in the midst of episodes after a second, since they have nothing to save."""
    logging.getLogger("asyncio").setLevel(logging.CRITICAL)  # it would tell of futures that nobody waits for any more
    stopping = [nanny.close(timeout=1.0) for nanny in cluster.workers.values()]
    await asyncio.gather(*stopping, return_exceptions=True)


def blocks(brains: int, episodes: int, workers: int, smallest: int) -> list[tuple[slice, slice]]:
    """Equal blocks of brains and episodes for the workers: whole rows if possible, so that a brain travels once.

    Blocks hold at least `smallest` runs of a brain through an episode, if there is work for all.
    """
    runs = brains * episodes
    wanted = min(runs, max(workers, min(BLOCKS_PER_WORKER * workers, runs // smallest)))
    rows = max(1, min(brains, wanted))
    columns = -(-wanted // rows)
    return [(some, which) for some in _slices(brains, rows) for which in _slices(episodes, columns)]


def _slices(count: int, parts: int) -> list[slice]:
    return [slice(count * k // parts, count * (k + 1) // parts) for k in range(parts)]


def run_block(expected: dict[str, str], world: bytes, work: bytes) -> tuple[Tally, float]:
    """Run some brains through some episodes, in a worker; returns what came out, and how many seconds it took.

    Pickled are in `world` task, noise, and whether this is training; in `work` `Acting`, episodes, and whether
    statistics of what is sensed are wanted.

    Raises:
        ExneatError: a version differs from what is `expected`, that of the process that asks.
    """
    for name, wanted in expected.items():
        if (came := versions()[name]) != wanted:
            fix = "install the same on all machines and start the workers again"
            raise ExneatError(f"executor=dask: expected workers with {name} {wanted}, got {came}\n  {fix}")
    (task, noise, training), (acting, episodes, moments) = pickle.loads(world), pickle.loads(work)
    idle = _idle_worlds(world)
    try:
        own = idle.pop()
    except IndexError:  # no test before: another thread may take the last one in between
        own = open_world(task, noise, training=training)
    brains, began = len(acting[0].size), time.perf_counter()
    tally = empty_tally(task, brains, len(episodes), moments=moments)
    shares = [(episode, 0, brains) for episode in range(len(episodes))]
    run_shares(task, noise, np.zeros(1, np.bool_), own, shares, acting, episodes, tally)
    idle.append(own)
    return tally, time.perf_counter() - began


@functools.lru_cache(4)  # a robustness sweep has another one at every level
def _idle_worlds(world: bytes) -> list[Simulation]:
    """Opened worlds of this worker that nobody uses; take from and give back to it."""
    return []


@functools.cache
def versions() -> dict[str, str]:
    """What must be the same here and in every worker, or results could differ."""
    return {
        "exneat": f"{exneat_cli.__version__} with sources {source_digest()[:8]}",
        "Python": ".".join(platform.python_version_tuple()[:2]),
        **{library: version(library) for library in ("numpy", "numba", "mujoco")},
    }
