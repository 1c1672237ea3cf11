"""Ctrl-C and SIGTERM: a write in hand is finished first, then everything ends within seconds."""

from __future__ import annotations

import contextlib
import math
import os
import select
import shutil
import signal
import socket
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import ClassVar

PATIENCE = 4.0
"""Seconds after which a process that was asked to end is ended."""
_HEARD = (signal.SIGINT, signal.SIGTERM)
_TWIN = 0.2
"""Seconds within which a second signal is an echo of the first: `timeout` sends one to a process, then to its group."""
_GRACE = 0.8
"""Further seconds that a write in hand has then."""
_PAUSE = 0.05
"""Seconds until a signal is sent again, or the main thread woken again."""
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

    watch: _Watch | None = None
    raised: int | None = None
    waiting: int | None = None
    told = False
    writes_in_hand = 0
    writing = threading.Lock()
    through_others = False
    scratch: ClassVar[set[Path]] = set()
    hook_before: ClassVar[Callable[[sys.UnraisableHookArgs], object]] = sys.__unraisablehook__


class _Watch:
    """Hears signals in a thread of its own: the main thread hears none while it is in compiled code, or compiles.

    It ends the process, and what that started, `PATIENCE` seconds after the first signal or upon a second one.
    """

    def __init__(self) -> None:
        self._ear, self._mouth = socket.socketpair()
        self._mouth.setblocking(False)
        self._called_off = False
        signal.set_wakeup_fd(self._mouth.fileno(), warn_on_full_buffer=False)
        threading.Thread(target=self._listen, daemon=True).start()

    def call_off(self) -> None:
        """Let the process live, whatever was heard; signals must go to another descriptor, or none, by now."""
        self._called_off = True
        self._mouth.close()

    def _listen(self) -> None:
        # Threads inherit what the one that starts them blocks, see `unheard_by_children`.
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _HEARD)
        with self._ear:
            first = self._next(math.inf)
            if not first:
                return
            began = time.monotonic()
            second = self._next(PATIENCE, not_before=began + _TWIN) or self._next_during_write()
        if not self._called_off:
            if not second:
                tell_how_to_go_on()
            _end(second or first)

    def _next(self, seconds: float, not_before: float = 0.0) -> int:
        """Number of the next signal that `_hear` is there for; 0 if none came in time, or the watch was called off.

        Args:
            seconds: to wait.
            not_before: what comes before this time is an echo.
        """
        until = time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0:
            if not select.select([self._ear], [], [], None if left == math.inf else min(left, _PAUSE))[0]:
                _wake_main_thread()
                continue
            number = self._ear.recv(1)
            if not number:
                return 0
            if time.monotonic() >= not_before and signal.getsignal(number[0]) is _hear:
                _wake_main_thread()
                return number[0]
        return 0

    def _next_during_write(self) -> int:
        """The same until a write in hand is done; the main thread is kept from the next one."""
        until = time.monotonic() + _GRACE
        second = 0
        while not (self._called_off or second) and time.monotonic() < until:
            if _Heard.writing.acquire(timeout=_PAUSE):
                break
            second = self._next(_PAUSE)
        return second


def listen() -> None:
    """Turn Ctrl-C and SIGTERM into `Interrupted` from now on; a second one ends the process at once.

    A process that is still there after `PATIENCE` is ended too, with what it started: libraries may swallow
    an exception that comes from a signal, and compiled code hears none.
    """
    before, _Heard.watch = _Heard.watch, _Watch()
    if before is not None:
        before.call_off()
    _Heard.raised = _Heard.waiting = None
    _Heard.told = False
    if sys.unraisablehook is not _hear_again:
        _Heard.hook_before, sys.unraisablehook = sys.unraisablehook, _hear_again
    for number in _HEARD:
        signal.signal(number, _hear)


@contextlib.contextmanager
def listening() -> Iterator[None]:
    """`listen` while inside; afterwards signals, and this module, are as before."""
    handlers = {number: signal.getsignal(number) for number in _HEARD}
    descriptor = signal.set_wakeup_fd(-1)
    try:
        listen()
        yield
    finally:
        signal.set_wakeup_fd(descriptor)
        if _Heard.watch is not None:
            _Heard.watch.call_off()
        _Heard.watch = _Heard.raised = _Heard.waiting = None
        sys.unraisablehook = _Heard.hook_before
        for number, handler in handlers.items():
            signal.signal(number, handler)


def tell_how_to_go_on() -> None:
    """Say, once, how to go on."""
    if _Heard.told:
        return
    _Heard.told = True
    with contextlib.suppress(OSError, ValueError):  # nobody may be reading any more
        if threading.current_thread() is threading.main_thread():
            print(GOES_ON, file=sys.stderr, flush=True)
        else:  # the main thread may be in the midst of printing
            os.write(2, f"{GOES_ON}\n".encode())


def stop_listening() -> None:
    """Let no signal end a process that is done: Python would let it, with another exit code, while it tidies up."""
    for number in _HEARD:
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
    outermost = _Heard.writes_in_hand == 1
    try:
        with _Heard.writing if outermost else contextlib.nullcontext():
            yield
    finally:
        _Heard.writes_in_hand -= 1
        if _Heard.waiting is not None and outermost:
            _Heard.raised, _Heard.waiting = _Heard.waiting, None
            raise Interrupted(_Heard.raised)


@contextlib.contextmanager
def heeding() -> Iterator[None]:
    """Whatever error leaves the block after a signal is `Interrupted`: libraries make others of it, as in a C callback.

    Raises:
        Interrupted: instead of that error.
    """
    try:
        yield
    except Exception as error:
        if _Heard.raised is None:
            raise
        raise Interrupted(_Heard.raised) from error


@contextlib.contextmanager
def scratch_directory(prefix: str = "exneat-", above: Path | None = None) -> Iterator[Path]:
    """A new directory for temporary files; it is deleted with the block, also where the process is ended amid it.

    Args:
        prefix: of its name.
        above: the directory that it is made in; the system's for temporary files without it.

    Raises:
        OSError: it cannot be made.
    """
    path = Path(tempfile.mkdtemp(prefix=prefix, dir=above))
    _Heard.scratch.add(path)
    try:
        yield path
    finally:
        with finishing():
            shutil.rmtree(path, ignore_errors=True)
            _Heard.scratch.discard(path)


@contextlib.contextmanager
def unheard_by_children() -> Iterator[None]:
    """Processes that are started meanwhile do not hear Ctrl-C, which a terminal sends to all; this one still does.

    They would each end with a traceback, while whoever started them ends them anyway. Children inherit what the main
    thread blocks, so another thread takes the signal, and the watch wakes the main one by SIGURG, which nobody uses.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    from multiprocessing import resource_tracker  # here, for it takes longer to import than --help to answer

    resource_tracker.ensure_running()  # its first start would undo what comes
    before = signal.signal(signal.SIGURG, lambda *_: None)
    _Heard.through_others = True
    try:
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        yield
    finally:
        _Heard.through_others = False
        signal.signal(signal.SIGURG, before)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


def _wake_main_thread() -> None:
    """End its waiting, if another thread took the signal; once may be too early, when it is just about to wait."""
    if _Heard.through_others and _Heard.raised is None and _Heard.waiting is None:
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGURG)


def _hear(number: int, _: object) -> None:
    if _Heard.raised is not None or _Heard.waiting is not None:
        return  # the watch sees to it, while what the first one began goes on
    if _Heard.writes_in_hand:
        _Heard.waiting = number
    else:
        _Heard.raised = number
        raise Interrupted(number)


def _hear_again(lost: sys.UnraisableHookArgs) -> None:
    """Send a signal again whose exception came up where Python drops it, as in a callback of a weak reference."""
    if not isinstance(lost.exc_value, Interrupted):
        _Heard.hook_before(lost)
        return
    listen()
    again = threading.Timer(_PAUSE, os.kill, (os.getpid(), lost.exc_value.number))
    again.daemon = True
    again.start()


def _end(number: int) -> None:
    try:
        for process in _descendants(os.getpid()):
            with contextlib.suppress(OSError):
                # A resource tracker ends with whoever started it, and takes the temporary files with it.
                if b"resource_tracker" not in Path(f"/proc/{process}/cmdline").read_bytes():
                    os.kill(process, signal.SIGKILL)
        for path in tuple(_Heard.scratch):
            shutil.rmtree(path, ignore_errors=True)
    finally:
        os._exit(128 + number)


def _descendants(process: int) -> list[int]:
    """Ids of all processes that this one started, and of those that they did; none where /proc is missing."""
    found = []
    with contextlib.suppress(OSError):
        for path in list(Path(f"/proc/{process}/task").glob("*/children")):
            with contextlib.suppress(OSError):
                for child in path.read_text(encoding="ascii").split():
                    found += [*_descendants(int(child)), int(child)]
    return found
