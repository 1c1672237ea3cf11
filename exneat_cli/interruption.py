"""Ctrl-C, SIGTERM and similar signals raise KeyboardInterrupt in the main thread; a second Ctrl-C ends it at once.

A signal that is ignored when the program starts, as with `nohup` and in scripts, stays ignored. Files are written
atomically and checkpoints are exact, so a run may be interrupted almost anywhere, and produces the same bytes when it
is resumed. Three things need care: compiled code that reads NumPy's generators (`uninterrupted`), libraries that raise
another error instead (`signal_heard`), and the workers of Hydra's launchers (`launching`, `as_worker`).
"""

from __future__ import annotations

import contextlib
import fcntl
import importlib.util
import os
import shutil
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

SIGNALS: tuple[int, ...] = (
    *(signal.SIGTERM, signal.SIGINT, signal.SIGHUP),
    *(signal.SIGUSR1, signal.SIGUSR2, signal.SIGXCPU),  # from clusters, before a time limit kills
)
"""Signals that interrupt."""
_OF_GROUPS = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)
"""Signals that a terminal or a shell also sends to workers."""
_HELD, _STALE_SECONDS = "held", 60.0
_heard: int | None = None
_workplace: int | None = None


@contextlib.contextmanager
def listening() -> Iterator[None]:
    """In the block, raise KeyboardInterrupt upon the first of `SIGNALS` that is not ignored; for the main thread."""
    global _heard
    heeded = [number for number in SIGNALS if signal.getsignal(number) != signal.SIG_IGN]
    before, hook = _set_handlers(dict.fromkeys(heeded, _hear)), sys.unraisablehook
    try:
        yield
    finally:
        _heard, sys.unraisablehook = None, hook
        _set_handlers(before)


def name_window_library() -> None:
    """Set the library of MuJoCo's windows, unless the user has: otherwise pyGLFW queries it in another Python process.

    That process would print errors upon Ctrl-C, or when its output is no longer read.
    """
    package = importlib.util.find_spec("glfw")
    if package is None or package.origin is None:
        return
    session = os.environ.get("PYGLFW_LIBRARY_VARIANT") or os.environ.get("XDG_SESSION_TYPE", "")
    library = Path(package.origin).parent / ("wayland" if session.lower() == "wayland" else "x11") / "libglfw.so"
    if library.is_file():
        os.environ.setdefault("PYGLFW_LIBRARY", str(library))


def signal_heard() -> int | None:
    """Number of the signal received, None before: any error that surfaces after it is due to the interruption."""
    return _heard


@contextlib.contextmanager
def uninterrupted() -> Iterator[None]:
    """Defer signals until the end of the block; does nothing outside the main thread, the only one that receives them.

    numba 0.68 reads NumPy's generators through Python code, and a signal handler that raises there crashes the process.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    waiting: list[int] = []
    before = _set_handlers(dict.fromkeys(SIGNALS, lambda number, _: waiting.append(number)))
    try:
        yield
    finally:
        _set_handlers(before)
        for number in waiting:
            os.kill(os.getpid(), number)


@contextlib.contextmanager
def launching(workplace: Path) -> Iterator[None]:
    """For the launcher of workers whose jobs lock `workplace`: they ignore Ctrl-C, and a signal ends jobs first."""
    global _workplace
    if _heard is not None:  # a library may have swallowed the exception
        raise KeyboardInterrupt
    from multiprocessing import resource_tracker  # importing it takes longer than --help

    resource_tracker.ensure_running()  # its first start would unblock the signals
    over = threading.Event()
    # Children inherit the signals that the main thread blocks; this thread receives them, and Python handles them in
    # the main thread.
    threading.Thread(target=over.wait, daemon=True).start()
    _workplace = os.open(workplace, os.O_RDONLY)
    signal.pthread_sigmask(signal.SIG_BLOCK, _OF_GROUPS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _OF_GROUPS)
        os.close(_workplace)
        _workplace = None
        over.set()


@contextlib.contextmanager
def as_worker(workplace: Path) -> Iterator[None]:
    """For a job in a worker: SIGTERM interrupts it and prevents further jobs, and the process ends with its parent."""
    import ctypes
    import multiprocessing

    if _heard is not None:
        raise KeyboardInterrupt
    with contextlib.suppress(AttributeError):  # only on Linux
        ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG
    if (parent := multiprocessing.parent_process()) and parent.pid != os.getppid():
        os._exit(1)
    with contextlib.ExitStack() as ending:
        with contextlib.suppress(FileNotFoundError):  # on another machine
            lock = os.open(workplace, os.O_RDONLY)
            ending.callback(os.close, lock)
            try:
                fcntl.flock(lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
            except BlockingIOError:
                raise KeyboardInterrupt from None  # the launcher was interrupted
        signal.signal(signal.SIGTERM, _hear)
        ending.callback(signal.pthread_sigmask, signal.SIG_BLOCK, {signal.SIGTERM})
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGTERM})
        yield


@contextlib.contextmanager
def scratch_directory(prefix: str = "exneat-", parent: Path | None = None) -> Iterator[Path]:
    """A directory below TMPDIR or `parent` for the block; also removes directories left by killed processes."""
    parent = parent or Path(tempfile.gettempdir())
    for held in parent.glob(f"{prefix}*/{_HELD}"):
        with contextlib.suppress(OSError), open(os.open(held, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)) as file:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if os.fstat(file.fileno()).st_mtime < time.time() - _STALE_SECONDS:  # a newer one may not be locked yet
                shutil.rmtree(held.parent)
    with (
        tempfile.TemporaryDirectory(prefix=prefix, dir=parent, ignore_cleanup_errors=True) as name,
        open(Path(name) / _HELD, "wb") as file,
    ):
        with contextlib.suppress(OSError):  # a disk without locks, where such directories are never removed
            fcntl.flock(file, fcntl.LOCK_EX)
        yield Path(name)


def _hear(number: int, _: object) -> None:
    global _heard
    _heard, sys.unraisablehook = number, _raise_again
    ignored = [each for each in SIGNALS if each != signal.SIGINT or signal.getsignal(each) == signal.SIG_IGN]
    _set_handlers({signal.SIGINT: signal.SIG_DFL, **dict.fromkeys(ignored, signal.SIG_IGN)})
    if _workplace is not None:
        for process in _descendants(os.getpid()):
            with contextlib.suppress(OSError):
                os.kill(process, signal.SIGTERM)
        fcntl.flock(_workplace, fcntl.LOCK_EX)  # joblib kills its workers upon KeyboardInterrupt: jobs must end first
    raise KeyboardInterrupt


def _raise_again(lost: sys.UnraisableHookArgs) -> None:
    """Send the signal again if Python drops KeyboardInterrupt, as in callbacks of the import system."""
    if _heard is not None and isinstance(lost.exc_value, KeyboardInterrupt):
        signal.signal(_heard, _hear)
        threading.Timer(0.05, os.kill, (os.getpid(), _heard)).start()
    else:
        sys.__unraisablehook__(lost)


def _set_handlers(handlers: dict[int, Any]) -> dict[int, Any]:
    return {number: signal.signal(number, handler or signal.SIG_DFL) for number, handler in handlers.items()}


def _descendants(process: int) -> Iterator[int]:
    """Ids of all descendants of a process; none if /proc is missing."""
    for path in Path(f"/proc/{process}/task").glob("*/children"):
        with contextlib.suppress(OSError):
            for child in path.read_text(encoding="ascii").split():
                yield from (int(child), *_descendants(int(child)))
