"""Worker processes that stay for the next runner: starting them takes seconds."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Iterator

from exneat_cli.rollouts.cluster import Cluster
from exneat_cli.rollouts.processes import Processes
from exneat_cli.rollouts.settings import Executor

_open: dict[Executor, Cluster | Processes] = {}
_users = 0
_lock = threading.RLock()


@contextlib.contextmanager
def keep_workers() -> Iterator[None]:
    """While inside, workers that runners start stay for the next ones; the last to leave ends them."""
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


def workers_of(executor: Executor) -> Cluster | Processes:
    """The workers of an executor that has some, those there are or new ones; within `keep_workers`.

    Raises:
        ExneatError: dask is not installed, or nothing answers at the executor's address.
    """
    with _lock:
        if executor in _open and not _open[executor].is_usable:
            _open.pop(executor).close()
        if executor not in _open:
            _open[executor] = Cluster(executor) if executor.name == "dask" else Processes(executor)
        return _open[executor]
