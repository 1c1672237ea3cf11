"""Worker processes and batches on a GPU, kept for the next runner, since starting them takes seconds."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Iterator
from typing import TYPE_CHECKING, TypeAlias

from exneat_cli.rollouts.cluster import Cluster
from exneat_cli.rollouts.processes import Processes
from exneat_cli.rollouts.settings import Executor

if TYPE_CHECKING:
    from exneat_cli.rollouts.batch.service import Batches

Workers: TypeAlias = "Cluster | Processes | Batches"

_open: dict[Executor, Workers] = {}
_users = 0
_lock = threading.RLock()


@contextlib.contextmanager
def keep_workers() -> Iterator[None]:
    """Within the block, keep the workers that runners start for later ones; the last block to end ends them."""
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


def workers_of(executor: Executor) -> Workers:
    """The workers of an executor that uses any, existing or new ones; to be called within `keep_workers`.

    Raises:
        ExneatError: its library is not installed, nothing answers at its address, or there is no such device.
    """
    with _lock:
        if executor in _open and not _open[executor].is_usable:
            _open.pop(executor).close()
        if executor not in _open:
            _open[executor] = _started(executor)
        return _open[executor]


def _started(executor: Executor) -> Workers:
    if executor.name == "dask":
        return Cluster(executor)
    if executor.name == "processes":
        return Processes(executor)
    from exneat_cli.rollouts.batch.service import Batches

    return Batches(executor)
