"""Ctrl-C and SIGTERM: a write in hand is finished first, then everything ends within seconds."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

PATIENCE = 4.0
"""Seconds after which a process that was asked to end is ended."""
_PAUSE = 0.05
"""Seconds until a signal is sent again; it must not come up in the same callback."""
GOES_ON = "exneat: interrupted; the same command goes on (a single exneat train with resume=true)"
"""The last line of whoever was interrupted."""


class Interrupted(KeyboardInterrupt):
    """Raised in the main thread when the process is asked to end.

    Attributes:
        number: of the signal.
    """

    def __init__(self, number: int) -> None:
        super().__init__(signal.Signals(number).name)
        self.number = number


class _Heard:
    """What is known of signals so far; handlers run in the main thread alone."""

    first: int | None = None
    watch: threading.Timer | None = None
    waiting: int | None = None
    writes_in_hand = 0


def listen() -> None:
    """Turn Ctrl-C and SIGTERM into `Interrupted` from now on; a second one ends the process at once.

    A process that is still there after `PATIENCE` is ended too, with what it started: libraries may swallow
    an exception that comes from a signal.
    """
    if _Heard.watch is not None:
        _Heard.watch.cancel()
    _Heard.first = _Heard.waiting = _Heard.watch = None
    sys.unraisablehook = _hear_again
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _hear)


def stop_listening() -> None:
    """Let no signal end a process that is done: Python would let it, with another exit code, while it tidies up."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)


@contextlib.contextmanager
def finishing() -> Iterator[None]:
    """Put `Interrupted` off until the block is done, if this is the main thread.

    Raises:
        Interrupted: at the end of the block, if a signal came meanwhile.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    _Heard.writes_in_hand += 1
    try:
        yield
    finally:
        _Heard.writes_in_hand -= 1
        if _Heard.waiting is not None and _Heard.writes_in_hand == 0:
            number, _Heard.waiting = _Heard.waiting, None
            raise Interrupted(number)


@contextlib.contextmanager
def unheard_by_children() -> Iterator[None]:
    """Processes that are started meanwhile do not hear Ctrl-C, which a terminal sends to all; this one still does.

    They would each end with a traceback, while whoever started them ends them anyway.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    over = threading.Event()
    waiting = threading.Thread(target=_pass_on, args=(over,), daemon=True)
    before = signal.signal(signal.SIGUSR1, lambda _, frame: _hear(signal.SIGINT, frame))
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    waiting.start()
    try:
        yield
    finally:
        over.set()
        waiting.join()
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        signal.signal(signal.SIGUSR1, before)


def _pass_on(over: threading.Event) -> None:
    """Wait for SIGINT, which no other thread hears meanwhile, and wake the main thread."""
    while not over.is_set():
        if signal.sigtimedwait({signal.SIGINT}, _PAUSE) is not None:
            signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGUSR1)


def _hear(number: int, frame: object) -> None:
    if _Heard.first is not None:
        _end(number)
    _Heard.first = number
    _Heard.watch = threading.Timer(PATIENCE, _give_up, (number,))
    _Heard.watch.daemon = True
    _Heard.watch.start()
    if _Heard.writes_in_hand:
        _Heard.waiting = number
    else:
        raise Interrupted(number)


def _hear_again(lost: sys.UnraisableHookArgs) -> None:
    """Send a signal again whose exception came up where Python drops it, as in a callback of a weak reference."""
    if not isinstance(lost.exc_value, Interrupted):
        sys.__unraisablehook__(lost)
        return
    _Heard.first = None
    again = threading.Timer(_PAUSE, os.kill, (os.getpid(), lost.exc_value.number))
    again.daemon = True
    again.start()


def _give_up(number: int) -> None:
    with contextlib.suppress(OSError):
        os.write(2, f"{GOES_ON}\n".encode())
    _end(number)


def _end(number: int) -> None:
    for process in _descendants(os.getpid()):
        with contextlib.suppress(OSError):
            os.kill(process, signal.SIGKILL)
    os._exit(128 + number)


def _descendants(process: int) -> Iterator[int]:
    """Ids of all processes that this one started, and of those that they did; none where /proc is missing."""
    for path in Path(f"/proc/{process}/task").glob("*/children"):
        with contextlib.suppress(OSError):
            for child in path.read_text(encoding="ascii").split():
                yield from _descendants(int(child))
                yield int(child)
