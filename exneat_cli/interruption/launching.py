"""A launcher's processes: Ctrl-C is heard by the one that started them, which ends their jobs."""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Iterator

from exneat_cli.interruption.children import at_work, jobs_watched
from exneat_cli.interruption.handlers import listening
from exneat_cli.interruption.scratch import scratch_directory
from exneat_cli.interruption.signals import Heard


@contextlib.contextmanager
def unheard_by_children() -> Iterator[None]:
    """Processes that are started meanwhile do not hear Ctrl-C, which a terminal sends to all; this one still does.

    They would each end with a traceback, while whoever started them ends them anyway, after their jobs `as_worker`
    have ended. Children inherit what the main thread blocks, so another thread takes the signal, and the watch wakes
    the main one by SIGURG, which nobody uses.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    from multiprocessing import resource_tracker  # here, for it takes longer to import than --help to answer

    resource_tracker.ensure_running()  # its first start would undo what comes
    with scratch_directory() as scratch, jobs_watched(scratch / "jobs"):
        before = signal.signal(signal.SIGURG, lambda *_: None)
        Heard.through_others = True
        try:
            signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
            yield
        finally:
            Heard.through_others = False
            signal.signal(signal.SIGURG, before)
            signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


@contextlib.contextmanager
def as_worker() -> Iterator[None]:
    """For a job in such a process: SIGTERM interrupts it, and Ctrl-C is left to whoever started it.

    Raises:
        Interrupted: by SIGTERM; or at once, if whoever started the process was interrupted before.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with listening():
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        with at_work():
            yield
