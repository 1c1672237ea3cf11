"""From a signal to the exception that ends the program, and to its last line."""

from __future__ import annotations

import contextlib
import os
import select
import signal
import sys
import threading
from collections.abc import Callable, Iterator

from exneat_cli.interruption.signals import Heard, Interrupted
from exneat_cli.interruption.watch import HEARD, Watch
from exneat_cli.interruption.writes import interrupt

GOES_ON = "exneat: interrupted; the same command goes on (a single exneat train with resume=true)"
"""The last line of whoever was interrupted."""
_PAUSE = 0.05
"""Seconds until a signal is sent again; it must not come up in the same callback."""


class _Now:
    """What this process listens with."""

    watch: Watch | None = None
    told = False
    hook_before: Callable[[sys.UnraisableHookArgs], object] = staticmethod(sys.__unraisablehook__)


def listen() -> None:
    """Turn Ctrl-C and SIGTERM into `Interrupted` from now on; a second one ends the process at once.

    A process that is still there seconds later is ended too, with what it started: libraries may swallow
    an exception that comes from a signal, and compiled code hears none.
    """
    before, _Now.watch = _Now.watch, Watch(_is_heard, tell_how_to_go_on)
    if before is not None:
        before.call_off()
    Heard.forget()
    _Now.told = False
    if sys.unraisablehook is not _hear_again:
        _Now.hook_before, sys.unraisablehook = sys.unraisablehook, _hear_again
    for number in HEARD:
        signal.signal(number, _hear)


@contextlib.contextmanager
def listening() -> Iterator[None]:
    """`listen` while inside; afterwards signals, and this module, are as before. From the main thread alone."""
    handlers = {number: signal.getsignal(number) for number in HEARD}
    hook, watch, told = _Now.hook_before, _Now.watch, _Now.told
    _Now.watch, shown = None, sys.unraisablehook
    descriptor = signal.set_wakeup_fd(-1)
    try:
        listen()
        yield
    finally:
        signal.set_wakeup_fd(descriptor)
        if _Now.watch is not None:
            _Now.watch.call_off()
        _Now.hook_before, _Now.watch, _Now.told = hook, watch, told
        Heard.forget()
        sys.unraisablehook = shown
        for number, handler in handlers.items():
            signal.signal(number, handler)


def tell_how_to_go_on() -> None:
    """Say, once, how to go on; where nobody reads, nothing."""
    if _Now.told:
        return
    _Now.told = True
    with contextlib.suppress(OSError, ValueError):
        if threading.current_thread() is threading.main_thread():
            print(GOES_ON, file=sys.stderr, flush=True)
        elif select.select([], [2], [], 0.0)[1]:  # the main thread may be in the midst of printing
            os.write(2, f"{GOES_ON}\n".encode())


def stop_listening() -> None:
    """Let no signal end a process that is done: Python would let it, with another exit code, while it tidies up."""
    for number in HEARD:
        signal.signal(number, signal.SIG_IGN)


@contextlib.contextmanager
def heeding() -> Iterator[None]:
    """Whatever error leaves the block after a signal is `Interrupted`: libraries make others of it, as in a C callback.

    Raises:
        Interrupted: instead of that error.
    """
    try:
        yield
    except Exception as error:
        if Heard.raised is None:
            raise
        raise Interrupted(Heard.raised) from error


def _hear(number: int, _: object) -> None:
    if Heard.anything():
        return  # the watch sees to it, while what the first one began goes on
    if Heard.put_off:
        Heard.waiting = number
    else:
        interrupt(number)


def _hear_again(lost: sys.UnraisableHookArgs) -> None:
    """Send a signal again whose exception came up where Python drops it, as in a callback of a weak reference."""
    if not isinstance(lost.exc_value, Interrupted):
        _Now.hook_before(lost)
        return
    listen()
    again = threading.Timer(_PAUSE, os.kill, (os.getpid(), lost.exc_value.number))
    again.daemon = True
    again.start()


def _is_heard(number: int) -> bool:
    return signal.getsignal(number) is _hear
