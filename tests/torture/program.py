"""exneat as a process of its own, in a session of its own, so that nothing that it starts escapes notice."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from types import TracebackType

import exneat_cli

HANGING = 180.0
"""Seconds after which a process that should end by itself is taken for stuck."""
_POLL = 0.002


class Program:
    """A started `exneat`, killed with all that it started at the end of the block.

    Args:
        arguments: as on the command line.
        folder: working directory; its streams and its temporary files lie there too.
    """

    def __init__(self, arguments: Sequence[str], folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._out, self._err, self.temporary = folder / "stdout", folder / "stderr", folder / "temporary"
        self.temporary.mkdir(exist_ok=True)
        with self._out.open("wb") as out, self._err.open("wb") as err:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "exneat_cli", *arguments],
                cwd=folder,
                env=environment(self.temporary),
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=err,
                start_new_session=True,
            )
        self.began = time.monotonic()

    def __enter__(self) -> Program:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.kill()

    @property
    def id(self) -> int:
        """Of the process, which is also that of its session."""
        return self._process.pid

    @property
    def code(self) -> int | None:
        """Exit code, negative for a signal; None while it runs."""
        return self._process.poll()

    @property
    def errors(self) -> str:
        """What it has written to standard error."""
        return self._err.read_text(encoding="utf-8", errors="replace")

    @property
    def output(self) -> str:
        """What it has written to standard output."""
        return self._out.read_text(encoding="utf-8", errors="replace")

    @property
    def listens(self) -> bool:
        """Whether it handles SIGTERM by now: Python itself, which starts first, does not, and may lose a SIGINT."""
        with contextlib.suppress(OSError):
            status = Path(f"/proc/{self.id}/status").read_text(encoding="ascii")
            caught = int(status.partition("SigCgt:")[2].split()[0], 16)
            return bool(caught >> (signal.SIGTERM - 1) & 1)
        return False

    def send(self, number: int, *, to_all: bool) -> None:
        """Send a signal to the process, or to its whole group, as a terminal does."""
        with contextlib.suppress(ProcessLookupError):
            (os.killpg if to_all else os.kill)(self.id, number)

    def wait(self, seconds: float = HANGING) -> int | None:
        """The exit code, or None if it is still running after that time."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            return self._process.wait(seconds)
        return None

    def wait_for(self, happened: Callable[[], bool], seconds: float = HANGING) -> bool:
        """Wait until something happened; False if the process ended before, or takes too long."""
        deadline = time.monotonic() + seconds
        while self.code is None and time.monotonic() < deadline:
            if happened():
                return True
            time.sleep(_POLL)
        return False

    def left_over(self) -> list[int]:
        """Ids of the processes of its session that are still there, its own not counted."""
        return [process for process in _session(self.id) if process != self.id]

    def kill(self) -> None:
        """End the whole session at once, and wait for it."""
        for process in _session(self.id):
            with contextlib.suppress(ProcessLookupError):
                os.kill(process, signal.SIGKILL)
        self._process.wait()
        deadline = time.monotonic() + HANGING
        while self.left_over() and time.monotonic() < deadline:
            time.sleep(_POLL)


def environment(temporary: Path) -> dict[str, str]:
    """The environment of a child that runs this very code and keeps its temporary files together."""
    root = str(Path(exneat_cli.__file__).parents[1])
    return {**os.environ, "PYTHONPATH": root, "TMPDIR": str(temporary), "MPLBACKEND": "Agg"}


def _session(number: int) -> Iterator[int]:
    for path in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            # The name of the program stands in brackets and may hold blanks.
            state, _, _, session, *_ = path.read_text(encoding="utf-8", errors="replace").rpartition(")")[2].split()
            if int(session) == number and state != "Z":
                yield int(path.parent.name)
