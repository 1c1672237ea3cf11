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
"""How often a lock is asked for, and the seconds in between: `is_held` has it for less than a moment."""
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
        _lock(directory, descriptor)
        if not _is_still(directory, descriptor):
            raise ExneatError(f"{directory}: was removed by another process at this moment; try again")
        yield
    finally:
        os.close(descriptor)


def _lock(directory: Path, descriptor: int) -> None:
    for attempt in range(1, _TRIES + 1):
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return
        except BlockingIOError:
            if attempt == _TRIES:
                holder = f"process id {_holder(descriptor)}"
                raise ExneatError(f"{directory}: another process is writing there ({holder})") from None
            time.sleep(_PAUSE)
        except OSError as error:
            why = f"{directory}: cannot be locked: {error.strerror}; set output= to a disk that knows flock"
            raise ExneatError(why) from error


def _is_still(directory: Path, descriptor: int) -> bool:
    with contextlib.suppress(OSError):
        return os.path.samestat(os.stat(directory), os.fstat(descriptor))
    return False


def is_held(directory: Path) -> bool:
    """Whether a process holds the directory now."""
    try:
        with held(directory):
            return False
    except ExneatError:
        return True


def _holder(descriptor: int) -> str:
    """Id of the process that holds the lock, where the kernel tells."""
    with contextlib.suppress(OSError):
        inode = os.fstat(descriptor).st_ino
        for fields in map(str.split, _KERNEL_LOCKS.read_text(encoding="ascii").splitlines()):
            if "FLOCK" in fields and "->" not in fields and fields[-3].endswith(f":{inode}"):
                return fields[-4]
    return "unknown"
