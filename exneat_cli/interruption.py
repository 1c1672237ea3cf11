"""Ctrl-C, SIGTERM and their like raise KeyboardInterrupt in the main thread; a second Ctrl-C ends the process at once.

A signal that is ignored when the program begins, as `nohup` and scripts arrange it, stays ignored. Files are written
atomically and checkpoints are exact, so a run may be interrupted almost anywhere and resumes to the same bytes. Three
things need care: compiled code that reads NumPy's generators (`uninterrupted`), libraries that raise another error
instead (`signal_heard`), and the workers of Hydra's launchers (`launching`, `as_worker`).
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
"""What interrupts."""
_OF_GROUPS = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)
"""Those that a terminal or a shell sends to workers too."""
_HELD, _STALE_SECONDS = "held", 60.0
_heard: int | None = None
_workplace: int | None = None


@contextlib.contextmanager
def listening() -> Iterator[None]:
    """Raise KeyboardInterrupt upon the first of `SIGNALS` that was not ignored before; for the main thread."""
    global _heard
    heeded = [number for number in SIGNALS if signal.getsignal(number) != signal.SIG_IGN]
    before, hook = _set_handlers(dict.fromkeys(heeded, _hear)), sys.unraisablehook
    try:
        yield
    finally:
        _heard, sys.unraisablehook = None, hook
        _set_handlers(before)


def name_window_library() -> None:
    """Say which library MuJoCo's windows need, unless the user did: else pyGLFW asks another Python for its version.

    That one would complain of Ctrl-C, or that nobody reads its answer any more.
    """
    package = importlib.util.find_spec("glfw")
    if package is None or package.origin is None:
        return
    session = os.environ.get("PYGLFW_LIBRARY_VARIANT") or os.environ.get("XDG_SESSION_TYPE", "")
    library = Path(package.origin).parent / ("wayland" if session.lower() == "wayland" else "x11") / "libglfw.so"
    if library.is_file():
        os.environ.setdefault("PYGLFW_LIBRARY", str(library))


def signal_heard() -> int | None:
    """Number of the signal that was heard, None before: whatever error surfaces after it is the interruption."""
    return _heard


@contextlib.contextmanager
def uninterrupted() -> Iterator[None]:
    """Put signals off until the end of the block; does nothing outside of the main thread, which alone hears them.

    numba 0.68 reads NumPy's generators through Python code, and a signal that raises there crashes the process.
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
    """For whoever starts workers, whose jobs lock `workplace`: Ctrl-C is not for them, and a signal ends jobs first."""
    global _workplace
    if _heard is not None:  # a library may have swallowed the exception
        raise KeyboardInterrupt
    from multiprocessing import resource_tracker  # takes longer to import than --help to answer

    resource_tracker.ensure_running()  # its first start would unblock the signals
    over = threading.Event()
    # Children inherit what the main thread blocks; this one takes the signals, which Python handles in the main one.
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
    """For a job in a worker: SIGTERM interrupts it and refuses the next, and the process ends with its parent."""
    import ctypes
    import multiprocessing

    if _heard is not None:
        raise KeyboardInterrupt
    with contextlib.suppress(AttributeError):  # Linux alone has it
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
    """A directory for as long as the block lasts, below TMPDIR or `parent`; those that killed processes left go too."""
    parent = parent or Path(tempfile.gettempdir())
    for held in parent.glob(f"{prefix}*/{_HELD}"):
        with contextlib.suppress(OSError), open(os.open(held, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)) as file:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if os.fstat(file.fileno()).st_mtime < time.time() - _STALE_SECONDS:  # else it may be about to be locked
                shutil.rmtree(held.parent)
    with (
        tempfile.TemporaryDirectory(prefix=prefix, dir=parent, ignore_cleanup_errors=True) as name,
        open(Path(name) / _HELD, "wb") as file,
    ):
        with contextlib.suppress(OSError):  # a disk without locks, on which nobody will sweep
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
        fcntl.flock(_workplace, fcntl.LOCK_EX)  # joblib kills its workers upon KeyboardInterrupt: let jobs end first
    raise KeyboardInterrupt


def _raise_again(lost: sys.UnraisableHookArgs) -> None:
    """Send the signal again where Python drops KeyboardInterrupt: in callbacks, such as one of the import system's."""
    if _heard is not None and isinstance(lost.exc_value, KeyboardInterrupt):
        signal.signal(_heard, _hear)
        threading.Timer(0.05, os.kill, (os.getpid(), _heard)).start()
    else:
        sys.__unraisablehook__(lost)


def _set_handlers(handlers: dict[int, Any]) -> dict[int, Any]:
    return {number: signal.signal(number, handler or signal.SIG_DFL) for number, handler in handlers.items()}


def _descendants(process: int) -> Iterator[int]:
    """Ids of the processes that one started, and so on; none where /proc is missing."""
    for path in Path(f"/proc/{process}/task").glob("*/children"):
        with contextlib.suppress(OSError):
            for child in path.read_text(encoding="ascii").split():
                yield from (int(child), *_descendants(int(child)))
