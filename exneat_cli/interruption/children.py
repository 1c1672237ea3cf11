"""Processes that this one started, and the jobs that they do."""

from __future__ import annotations

import contextlib
import fcntl
import os
import signal
import time
from collections.abc import Iterator
from pathlib import Path

from exneat_cli.interruption.signals import Interrupted

JOB_SECONDS = 2.0
"""How long the jobs of children may take to end."""
_PAUSE = 0.01
_SHARED = "EXNEAT_JOBS"
"""Environment variable that names the file which children lock while they do a job."""
_OVER = b"over"


class _Jobs:
    """The file that children lock, opened by their parent; None if there is none."""

    descriptor: int | None = None


@contextlib.contextmanager
def jobs_watched(file: Path) -> Iterator[None]:
    """Processes that are started meanwhile, and are `at_work`, lock `file`.

    Args:
        file: to be made.
    """
    _Jobs.descriptor = os.open(file, os.O_RDWR | os.O_CREAT)
    os.environ[_SHARED] = str(file)
    try:
        yield
    finally:
        del os.environ[_SHARED]
        os.close(_Jobs.descriptor)
        _Jobs.descriptor = None


@contextlib.contextmanager
def at_work() -> Iterator[None]:
    """Have whoever started this process wait for the end of the block, if they asked for it and are still there.

    Raises:
        Interrupted: at once, if they were interrupted before.
    """
    with contextlib.ExitStack() as ending:
        with contextlib.suppress(KeyError, FileNotFoundError):  # nobody asked, or on another machine, or long ago
            descriptor = os.open(os.environ[_SHARED], os.O_RDWR)
            ending.callback(os.close, descriptor)
            fcntl.flock(descriptor, fcntl.LOCK_SH)
            if os.read(descriptor, len(_OVER)):
                raise Interrupted(signal.SIGTERM)
        yield


def end_jobs_of_children() -> None:
    """Interrupt the jobs of children, and wait until they have ended, `JOB_SECONDS` at most."""
    if _Jobs.descriptor is None:
        return
    os.write(_Jobs.descriptor, _OVER)
    for child in _children(os.getpid()):
        with contextlib.suppress(OSError):
            os.kill(child, signal.SIGTERM)
    until = time.monotonic() + JOB_SECONDS
    while time.monotonic() < until and not _locks(_Jobs.descriptor):
        time.sleep(_PAUSE)


def kill_descendants() -> None:
    """Kill all that this process started, and what they started; nothing where /proc is missing."""
    for process in _descendants(os.getpid()):
        with contextlib.suppress(OSError):
            # A resource tracker ends with whoever started it, and takes the temporary files with it.
            if b"resource_tracker" not in Path(f"/proc/{process}/cmdline").read_bytes():
                os.kill(process, signal.SIGKILL)


def _locks(descriptor: int) -> bool:
    """Whether no child is at work."""
    with contextlib.suppress(OSError):
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        return True
    return False


def _descendants(process: int) -> list[int]:
    found = []
    for child in _children(process):
        found += [*_descendants(child), child]
    return found


def _children(process: int) -> list[int]:
    found = []
    with contextlib.suppress(OSError):
        for path in list(Path(f"/proc/{process}/task").glob("*/children")):
            with contextlib.suppress(OSError):
                found += [int(child) for child in path.read_text(encoding="ascii").split()]
    return found
