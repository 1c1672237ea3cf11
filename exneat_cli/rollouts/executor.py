"""Where episodes run."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from importlib.util import find_spec

from exneat_cli.errors import ConfigError, ExneatError, check_choice, check_whole

EXECUTORS = ("threads", "serial", "dask")
_ADDRESS = re.compile(r"([a-z]+://)?[^\s/:]\S*:\d+")


@dataclass(frozen=True)
class Executor:
    """Where episodes run; results do not depend on it.

    Attributes:
        name: ``threads``, ``serial`` for one thread, or ``dask`` for the worker processes of a cluster.
        workers: number of threads, or of processes with one thread each, one at most if serial; 0 takes every core
            this process may use. A cluster at an address has workers of its own: 0 there.
        address: of the scheduler of a running dask cluster, e.g. ``tcp://10.0.0.1:8786``; None starts workers on
            this machine.

    Raises:
        ConfigError: a value is out of range, or makes no sense with this name.
    """

    name: str = "threads"
    workers: int = 0
    address: str | None = None

    def __post_init__(self) -> None:
        check_choice("executor.name", self.name, EXECUTORS)
        check_whole("executor.workers", self.workers, 0, 1 if self.name == "serial" else 4096)
        if self.address is None:
            return
        if self.name != "dask":
            raise ConfigError("executor.address", f"none with executor={self.name}", self.address, "executor=dask has")
        if not isinstance(self.address, str) or not _ADDRESS.fullmatch(self.address):
            raise ConfigError("executor.address", "a scheduler's address such as tcp://10.0.0.1:8786", self.address)
        if self.workers:
            fix = "a cluster at an address has the workers that were started for it"
            raise ConfigError("executor.workers", "0 together with executor.address", self.workers, fix)

    @property
    def threads(self) -> int:
        """Number of threads that run at once, in this process or in workers that it starts."""
        if self.name == "serial":
            return 1
        return self.workers or _usable_cores()

    def check_installed(self) -> None:
        """Refuse to begin without the library that this executor needs.

        Raises:
            ExneatError: it is dask, which is not installed.
        """
        if self.name == "dask" and find_spec("distributed") is None:
            raise ExneatError("executor=dask: expected dask, which is not installed\n  pip install 'exneat[dask]'")


def _usable_cores() -> int:
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
