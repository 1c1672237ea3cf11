"""The dask clusters that this process uses: one at an address, or worker processes of its own.

dask is imported when the first cluster is opened, never before.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import signal
import tempfile
import threading
import time
from collections.abc import Iterator
from multiprocessing import resource_tracker
from typing import Any

from exneat_cli.errors import ExneatError
from exneat_cli.rollouts.executor import Executor

CONNECT_SECONDS = 8
"""How long to wait for the scheduler at an address."""
STOP_SECONDS = 1
"""How long a worker process of our own may take to stop by itself: it has nothing to save."""

DEAD_SECONDS = 3.0
"""dask starts a worker that died again at once, unless it died while it started."""

_lock = threading.RLock()
_open: dict[Executor, Cluster] = {}
_users = 0


class Cluster:
    """A connection to a scheduler; `close` ends it, and with it the workers that were started for it.

    Args:
        executor: of name ``dask``.

    Raises:
        ExneatError: dask is not installed, or nothing answers at the executor's address.
    """

    def __init__(self, executor: Executor) -> None:
        executor.check_installed()
        from distributed.utils import silence_logging_cmgr

        self._ending = contextlib.ExitStack()
        self._own: Any = None
        self._own_workers = executor.threads
        self._dead_since: dict[Any, float] = {}
        # What goes wrong is said by us, once; dask would add pages.
        self._ending.enter_context(silence_logging_cmgr(logging.CRITICAL))
        try:
            self.client: Any = self._connect(executor.address) if executor.address else self._start(executor.threads)
        except BaseException:
            self._ending.close()
            raise

    @property
    def usable(self) -> bool:
        """Whether the scheduler is still there."""
        return bool(self.client.status == "running")

    def threads(self) -> int:
        """How many threads all workers have together, now; 0 also if the scheduler cannot be asked."""
        try:
            return sum(self.client.nthreads().values()) if self.usable else 0
        except (OSError, asyncio.CancelledError):
            return 0

    def fix(self) -> None:
        """Start those workers of our own again that dask has given up."""
        if self._own is None or not self.usable:
            return

        async def drop_dead() -> None:
            now = time.monotonic()
            for name, nanny in list(self._own.workers.items()):
                if nanny.is_alive():
                    self._dead_since.pop(name, None)
                elif now - self._dead_since.setdefault(name, now) > DEAD_SECONDS:
                    del self._own.workers[name], self._dead_since[name]
                    with contextlib.suppress(Exception):  # whatever is wrong with it, another one takes its place
                        await nanny.close(timeout=STOP_SECONDS)

        self._own.sync(drop_dead)
        self._own.scale(self._own_workers)

    def close(self) -> None:
        """Leave the cluster; workers that were started for it are ended, with their files."""
        self._ending.close()

    def _connect(self, address: str) -> Any:
        from distributed import Client

        class ClosingClient(Client):
            """One that ends its thread also when it could not connect, or lost its scheduler."""

            def start(self, **options: Any) -> None:
                try:
                    super().start(**options)  # type: ignore[no-untyped-call]
                except BaseException:
                    self.close()
                    raise

            def close(self, timeout: Any = 2 * CONNECT_SECONDS) -> None:
                super().close(timeout)  # type: ignore[no-untyped-call]
                if self._loop_runner.is_started():
                    self._loop_runner.stop()

        try:
            client: Any = ClosingClient(  # type: ignore[no-untyped-call]
                address, timeout=CONNECT_SECONDS, set_as_default=False
            )
        except (OSError, ValueError) as error:
            fix = "start one with: dask scheduler; the address is in its first lines"
            raise ExneatError(f"executor.address: expected a dask scheduler at {address}, got none\n  {fix}") from error
        self._ending.callback(client.close)
        return client

    def _start(self, workers: int) -> Any:
        from distributed import Client, LocalCluster

        scratch = self._ending.enter_context(tempfile.TemporaryDirectory(prefix="exneat-", ignore_cleanup_errors=True))
        cluster = LocalCluster(
            n_workers=0,  # those that `scale` adds come up while the caller goes on
            threads_per_worker=1,
            processes=True,
            host="127.0.0.1",
            dashboard_address=None,
            scheduler_kwargs={
                "dashboard": False,
                "dashboard_address": "127.0.0.1:0",
                "local_directory": scratch,
            },
            memory_limit=0,
            local_directory=scratch,
            silence_logs=logging.CRITICAL,
            config={"distributed.worker.profile.enabled": False},
        )
        self._ending.callback(_close_local, cluster)
        resource_tracker.ensure_running()  # its first start would undo the next line
        cluster.sync(_ignore_interrupts)
        client = Client(cluster, set_as_default=False)
        self._ending.callback(client.close)
        cluster.scale(workers)
        self._own = cluster
        return client


async def _ignore_interrupts() -> None:
    """Children inherit what this thread blocks: Ctrl-C reaches them too, but is ours to answer."""
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})


def _close_local(cluster: Any) -> None:
    async def stop_workers() -> None:
        stopping = [nanny.close(timeout=STOP_SECONDS) for nanny in cluster.workers.values()]
        await asyncio.gather(*stopping, return_exceptions=True)

    try:
        cluster.sync(stop_workers)
    finally:
        cluster.close()


@contextlib.contextmanager
def keep_clusters() -> Iterator[None]:
    """While inside, clusters that runners open stay open for the next ones; the last to leave closes them."""
    retain_clusters()
    try:
        yield
    finally:
        release_clusters()


def retain_clusters() -> None:
    """Enter `keep_clusters`."""
    global _users
    with _lock:
        _users += 1


def release_clusters() -> None:
    """Leave `keep_clusters`."""
    global _users
    with _lock:
        _users -= 1
        if _users:
            return
        with contextlib.ExitStack() as closing:
            for cluster in _open.values():
                closing.callback(cluster.close)
            _open.clear()


def cluster_of(executor: Executor) -> Cluster:
    """The open cluster of an executor, or a new one.

    Raises:
        ExneatError: dask is not installed, or nothing answers at the executor's address.
    """
    with _lock:
        if executor in _open and not _open[executor].usable:
            _open.pop(executor).close()
        if executor not in _open:
            _open[executor] = Cluster(executor)
        return _open[executor]
