"""Writes that are finished before anything ends, in this process and in those that it started."""

from __future__ import annotations

import contextlib
import fcntl
import os
import threading
import time
from collections.abc import Iterator
from pathlib import Path

from exneat_cli.interruption.signals import Heard, Interrupted

GRACE = 0.8
"""Seconds that a write in hand has."""
_PAUSE = 0.01
_SHARED = "EXNEAT_WRITES"
"""Environment variable that names the file which processes of ours lock while they write."""


class Writes:
    """The writes of this process that are in hand.

    Attributes:
        lock: held while the main thread is in a block of `finishing`.
        in_hand: whether it is.
        of_children: descriptor of the file that children lock; None if there is none.
    """

    lock = threading.Lock()
    in_hand = False
    of_children: int | None = None


@contextlib.contextmanager
def uninterrupted() -> Iterator[None]:
    """Put `Interrupted` off until the block is done, if this is the main thread; the process may be ended amid it.

    For calls of compiled code with NumPy's generators: numba 0.68 crashes where a signal raises while it reads one.

    Raises:
        Interrupted: at the end of the block, if a signal came meanwhile.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    Heard.put_off += 1
    try:
        yield
    finally:
        Heard.put_off -= 1
        if Heard.waiting is not None and Heard.put_off == 0:
            number, Heard.waiting = Heard.waiting, None
            interrupt(number)


@contextlib.contextmanager
def finishing() -> Iterator[None]:
    """`uninterrupted` for a write: nor is the process ended amid it, if it takes no longer than `GRACE`.

    Raises:
        Interrupted: at the end of the block, if a signal came meanwhile.
    """
    with uninterrupted():
        if Writes.in_hand or threading.current_thread() is not threading.main_thread():
            yield
            return
        with Writes.lock, _known_to_parent():
            Writes.in_hand = True
            try:
                yield
            finally:
                Writes.in_hand = False


def interrupt(number: int) -> None:
    """Raise `Interrupted`, after children have finished their writes: whoever is told may kill them.

    Raises:
        Interrupted: always.
    """
    Heard.raised = number
    if Writes.of_children is not None:
        until = time.monotonic() + GRACE
        while time.monotonic() < until and not _locks(Writes.of_children):
            time.sleep(_PAUSE)
    raise Interrupted(number)


@contextlib.contextmanager
def of_children_watched(file: Path) -> Iterator[None]:
    """Processes that are started meanwhile lock `file` while they write.

    Args:
        file: to be made.
    """
    Writes.of_children = os.open(file, os.O_RDWR | os.O_CREAT)
    os.environ[_SHARED] = str(file)
    try:
        yield
    finally:
        del os.environ[_SHARED]
        os.close(Writes.of_children)
        Writes.of_children = None


@contextlib.contextmanager
def _known_to_parent() -> Iterator[None]:
    """Have the parent wait, if there is one that asked for it."""
    file = os.environ.get(_SHARED)
    with contextlib.ExitStack() as ending:
        if file is not None and Writes.of_children is None:
            with contextlib.suppress(OSError):  # whoever started this is gone, and the file with it
                descriptor = os.open(file, os.O_RDWR)
                ending.callback(os.close, descriptor)
                fcntl.flock(descriptor, fcntl.LOCK_SH)
        yield


def _locks(descriptor: int) -> bool:
    """Whether nobody writes now; nobody begins to after that."""
    with contextlib.suppress(OSError):
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        return True
    return False
