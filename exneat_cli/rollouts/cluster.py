"""Runs episodes in the workers of a dask cluster: one started on this machine, or an existing one at an address.

Work is repeated when its worker dies, and results are stored by position, so that they depend neither on deaths of
workers nor on the order of completion. dask is only imported when the first cluster is opened.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import math
import signal
import sys
import time
from collections.abc import Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from multiprocessing import resource_tracker
from typing import Any

from exneat_cli.errors import ExneatError
from exneat_cli.interruption import scratch_directory
from exneat_cli.rollouts.blocks import WORTH_SECONDS, Setup, blocks, run_block, versions
from exneat_cli.rollouts.episode import Acting, Tally
from exneat_cli.rollouts.settings import Executor
from exneat_cli.seeding import EpisodeSeeds

PATIENCE_SECONDS = 60.0
"""How long a cluster may be without workers (s)."""
CONNECT_SECONDS = 8
"""How long to wait for the scheduler at an address (s)."""


class Cluster:
    """A connection to a scheduler, and any workers started for it, which `close` ends, removing their files."""

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
            # Errors are reported by us, once; dask would print pages of them.
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

    @property
    def is_usable(self) -> bool:
        """Whether the scheduler is still connected."""
        return bool(self.client.status == "running")

    def run(self, setup: Setup, acting: Acting, episodes: Sequence[EpisodeSeeds], tally: Tally) -> None:
        """Run every brain through every episode of the setup; write `tally`.

        Raises:
            ExneatError: there were no workers for `PATIENCE_SECONDS`, several workers in a row died over the same
                brains, or a worker has other versions.
        """
        from distributed import KilledWorker
        from distributed.protocol.pickle import dumps

        (brains, *added), moments = acting, bool(tally[-1].size)
        workers = self._threads() or 1 if self._own is None else self._executor.threads
        smallest = math.ceil(WORTH_SECONDS / self._seconds_per_run)
        world, waiting = dumps((sys.path, dumps(setup))), {}
        pool = self.client.get_executor(pure=False)
        try:
            for some, which in blocks(len(brains.size), len(episodes), workers, max(1, smallest)):
                # dask's own pickling, but in one piece: arrays sent separately arrive read-only, and numba would
                # compile everything again for them.
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
                pool.shutdown(wait=False)  # waiting work is not started; running work finishes on its own

    def _gather(self, waiting: dict[Future[tuple[Tally, float]], tuple[slice, slice]], tally: Tally) -> None:
        """Write results to their places, (episodes, brains), and check meanwhile that there are workers."""
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
                pace = min(pace, seconds / part[0].size)  # longer ones also loaded compiled code
            if done or self._threads():
                workers_seen = time.monotonic()
            elif time.monotonic() - workers_seen > PATIENCE_SECONDS:
                fix = "\n  start some: dask worker <address> --nworkers auto --nthreads 1" if self._own is None else ""
                raise ExneatError(f"executor=dask: {self._name} had no workers for {PATIENCE_SECONDS:.0f} s{fix}")
            if self._own is not None and not done:
                self._own.scale(self._executor.threads)  # restarts workers that dask has given up
        self._seconds_per_run = pace

    def _threads(self) -> int:
        """Current number of threads of all workers together; 0 also if the scheduler cannot be asked."""
        try:
            return sum(self.client.nthreads().values())
        except (OSError, AttributeError, asyncio.CancelledError):  # it has just gone away
            return 0

    def _started(self, ending: contextlib.ExitStack) -> Any:
        """A scheduler and workers on this machine; does not wait for the workers."""
        from distributed import LocalCluster

        # dask would leave its own directory for such files behind.
        scratch = str(ending.enter_context(scratch_directory()))
        cluster: Any = LocalCluster(
            n_workers=0,
            threads_per_worker=1,
            processes=True,
            host="127.0.0.1",
            dashboard_address=None,
            # The scheduler listens at this address even without a dashboard.
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
    """Children inherit the signals that this thread blocks: Ctrl-C also reaches them, but only we handle it."""
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})


async def _stop_workers(cluster: Any) -> None:
    """End the workers; busy ones are killed after a second, since they have nothing to save."""
    logging.getLogger("asyncio").setLevel(logging.CRITICAL)  # it would report futures that are no longer awaited
    stopping = [nanny.close(timeout=1.0) for nanny in cluster.workers.values()]
    await asyncio.gather(*stopping, return_exceptions=True)
