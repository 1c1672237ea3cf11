"""Processes that this one started."""

from __future__ import annotations

import contextlib
import os
import signal
import threading
from collections.abc import Iterator
from pathlib import Path

from exneat_cli.interruption.scratch import scratch_directory
from exneat_cli.interruption.signals import Heard
from exneat_cli.interruption.writes import of_children_watched


@contextlib.contextmanager
def unheard_by_children() -> Iterator[None]:
    """Processes that are started meanwhile do not hear Ctrl-C, which a terminal sends to all; this one still does.

    They would each end with a traceback, while whoever started them ends them anyway, after their writes in hand.
    Children inherit what the main thread blocks, so another thread takes the signal, and the watch wakes the main one
    by SIGURG, which nobody uses.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    from multiprocessing import resource_tracker  # here, for it takes longer to import than --help to answer

    resource_tracker.ensure_running()  # its first start would undo what comes
    with scratch_directory() as scratch, of_children_watched(scratch / "writes"):
        before = signal.signal(signal.SIGURG, lambda *_: None)
        Heard.through_others = True
        try:
            signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
            yield
        finally:
            Heard.through_others = False
            signal.signal(signal.SIGURG, before)
            signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


def kill_descendants() -> None:
    """Kill all that this process started, and what they started; nothing where /proc is missing."""
    for process in _descendants(os.getpid()):
        with contextlib.suppress(OSError):
            # A resource tracker ends with whoever started it, and takes the temporary files with it.
            if b"resource_tracker" not in Path(f"/proc/{process}/cmdline").read_bytes():
                os.kill(process, signal.SIGKILL)


def _descendants(process: int) -> list[int]:
    found = []
    with contextlib.suppress(OSError):
        for path in list(Path(f"/proc/{process}/task").glob("*/children")):
            with contextlib.suppress(OSError):
                for child in path.read_text(encoding="ascii").split():
                    found += [*_descendants(int(child)), int(child)]
    return found
