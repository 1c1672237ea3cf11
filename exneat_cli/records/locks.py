"""One writer per directory."""

from __future__ import annotations

import contextlib
import fcntl
import os
import time
from collections.abc import Iterator
from pathlib import Path

from exneat_cli.errors import ExneatError

_TRIES, _PAUSE = 3, 0.02
"""How often a lock is asked for, and the seconds in between."""
_KERNEL_LOCKS = Path("/proc/locks")


@contextlib.contextmanager
def held(directory: Path) -> Iterator[None]:
    """Hold a directory against other processes, and other threads of this one.

    The lock is on the directory itself: nothing is left behind, and a killed process frees it.

    Raises:
        ExneatError: another process holds it, or it cannot be opened.
    """
    try:
        descriptor = os.open(directory, os.O_RDONLY | os.O_DIRECTORY)
    except OSError as error:
        raise ExneatError(f"{directory}: cannot be opened: {error.strerror}") from error
    try:
        try:
            _lock(descriptor)
        except BlockingIOError:
            process = _holder(descriptor) or "unknown"
            raise ExneatError(f"{directory}: another process is writing there (process id {process})") from None
        except OSError as error:
            why = f"{directory}: cannot be locked: {error.strerror}; set output= to a disk that knows flock"
            raise ExneatError(why) from error
        if not _is_still(directory, descriptor):
            raise ExneatError(f"{directory}: was removed by another process at this moment; try again")
        yield
    finally:
        os.close(descriptor)


def _lock(descriptor: int) -> None:
    """Take the lock; whoever only asks by `is_held` has it for less than a moment, so a second try is worth it."""
    for _ in range(_TRIES - 1):
        with contextlib.suppress(BlockingIOError):
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return
        time.sleep(_PAUSE)
    fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)


def is_held(directory: Path) -> bool:
    """Whether a process holds the directory now."""
    try:
        descriptor = os.open(directory, os.O_RDONLY | os.O_DIRECTORY)
    except OSError:
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except OSError as error:
        return isinstance(error, BlockingIOError)
    finally:
        os.close(descriptor)
    return False


def _is_still(directory: Path, descriptor: int) -> bool:
    try:
        return os.path.samestat(os.stat(directory), os.fstat(descriptor))
    except OSError:
        return False


def _holder(descriptor: int) -> int | None:
    """Id of the process that holds the lock; None where the kernel does not tell."""
    inode = os.fstat(descriptor).st_ino
    try:
        lines = _KERNEL_LOCKS.read_text(encoding="ascii").splitlines()
    except OSError:
        return None
    for fields in (line.split() for line in lines):
        if "FLOCK" in fields and "->" not in fields and fields[-3].endswith(f":{inode}"):
            return int(fields[-4])
    return None
