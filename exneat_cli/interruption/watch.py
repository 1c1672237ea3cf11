"""The thread that hears signals when the main thread cannot."""

from __future__ import annotations

import math
import os
import select
import signal
import socket
import threading
import time
from collections.abc import Callable

from exneat_cli.interruption.children import kill_descendants
from exneat_cli.interruption.last_acts import do_last_acts
from exneat_cli.interruption.scratch import delete_scratch
from exneat_cli.interruption.signals import Heard
from exneat_cli.interruption.writes import GRACE, Writes

PATIENCE = 4.0
"""Seconds after which a process that was asked to end is ended."""
HEARD = (signal.SIGINT, signal.SIGTERM)
_ECHO = 0.2
"""Seconds within which a second signal is the first one again: `timeout` signals a process, then its group."""
_PAUSE = 0.05
"""Seconds until the main thread is woken again."""


class Watch:
    """Hears signals in a thread of its own: the main thread hears none while it is in compiled code, or compiles.

    It ends the process, and what that started, `PATIENCE` seconds after the first signal or upon a second one.
    A write in hand has `GRACE` more.

    Args:
        is_heard: whether the signal of this number is one to end upon, by now.
        last_words: to be said if it came to `PATIENCE`.
    """

    def __init__(self, is_heard: Callable[[int], bool], last_words: Callable[[], None]) -> None:
        self._is_heard, self._last_words = is_heard, last_words
        self._ear, self._mouth = socket.socketpair()
        self._mouth.setblocking(False)
        self._called_off = self._kept_from_writing = False
        signal.set_wakeup_fd(self._mouth.fileno(), warn_on_full_buffer=False)
        threading.Thread(target=self._listen, daemon=True).start()

    def call_off(self) -> None:
        """Let the process live, whatever was heard; signals must go to another descriptor, or none, by now."""
        self._called_off = True
        self._mouth.close()

    def _listen(self) -> None:
        # Threads inherit what the one that starts them blocks, see `unheard_by_children`.
        signal.pthread_sigmask(signal.SIG_UNBLOCK, HEARD)
        with self._ear:
            first = self._next(math.inf)
            if not first:
                return
            began = time.monotonic()
            second = self._next(PATIENCE, not_before=began + _ECHO) or self._next_during_write()
        if not self._called_off:
            if not second:
                self._last_words()
            _end(second or first)
        if self._kept_from_writing:
            Writes.lock.release()

    def _next(self, seconds: float, not_before: float = 0.0) -> int:
        """Number of the next signal that counts; 0 if none came in time, or the watch was called off.

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
            if time.monotonic() >= not_before and self._is_heard(number[0]):
                _wake_main_thread()
                return number[0]
        return 0

    def _next_during_write(self) -> int:
        """The same until a write in hand is done; the main thread is kept from the next one, and last acts are done."""
        until = time.monotonic() + GRACE
        second = 0
        while not (self._called_off or second) and time.monotonic() < until:
            if Writes.lock.acquire(timeout=_PAUSE):
                self._kept_from_writing = True
                if not self._called_off:
                    do_last_acts()
                break
            second = self._next(_PAUSE)
        return second


def _wake_main_thread() -> None:
    """End its waiting, if another thread took the signal; once may be too early, when it is just about to wait."""
    if Heard.through_others and not Heard.anything():
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGURG)


def _end(number: int) -> None:
    try:
        kill_descendants()
        delete_scratch()
    finally:
        os._exit(128 + number)
