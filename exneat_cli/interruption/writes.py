"""What must not be interrupted, and writes that are finished before the process is ended."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Iterator

from exneat_cli.interruption.children import end_jobs_of_children
from exneat_cli.interruption.signals import Heard, Interrupted

GRACE = 0.8
"""Seconds that a write in hand has, in a process that is being ended."""


class Writes:
    """The writes of this process that are in hand.

    Attributes:
        lock: held while the main thread is in a block of `finishing`; a watch that ends the process takes it too.
        in_hand: whether the main thread is in such a block.
    """

    lock = threading.Lock()
    in_hand = False


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
    """`uninterrupted` for a write: a first signal does not end the process amid it, unless it takes `GRACE` and more.

    Raises:
        Interrupted: at the end of the block, if a signal came meanwhile.
    """
    with uninterrupted():
        if Writes.in_hand or threading.current_thread() is not threading.main_thread():
            yield
            return
        with Writes.lock:
            Writes.in_hand = True
            try:
                yield
            finally:
                Writes.in_hand = False


def interrupt(number: int) -> None:
    """Raise `Interrupted`, after the jobs of children have ended: whoever is told may kill them.

    Raises:
        Interrupted: always.
    """
    Heard.raised = number
    end_jobs_of_children()
    raise Interrupted(number)
