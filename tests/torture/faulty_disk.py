"""exneat in a process whose disk fails at a chosen write, started from one that has imported everything."""

from __future__ import annotations

import contextlib
import errno
import multiprocessing
import os
import resource
import sys
import tempfile
import traceback
from collections.abc import Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from exneat_cli.main import main

_PRELOADED = [
    *("tests.torture.faulty_disk", "exneat_cli.commands.train", "exneat_cli.analysis", "exneat_cli.rollouts.episode"),
    "matplotlib.backends.backend_agg",
]
_WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT


@dataclass(frozen=True)
class Fault:
    """What the disk does.

    Attributes:
        first: number of the write, from 1, that fails first: a directory made, a file opened, flushed or renamed;
            0 lets all pass.
        stays: whether all later writes fail too, as on a full disk, or that one alone.
        file_size: bytes that no file may exceed; None sets no limit.
    """

    first: int = 0
    stays: bool = False
    file_size: int | None = None

    def __str__(self) -> str:
        if self.file_size is not None:
            return f"files limited to {self.file_size} bytes"
        return f"write {self.first} {'and all later ones fail' if self.stays else 'fails'}"


@dataclass(frozen=True)
class Ended:
    """How exneat ended: exit code, what it said on both streams, and how many writes it tried."""

    code: int
    said: str
    writes: int


def run_exneat(arguments: Sequence[str], fault: Fault, temporary: Path) -> Ended:
    """Run exneat under a fault, in a process of its own; `temporary` takes its temporary files."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(_PRELOADED)
    temporary.mkdir(parents=True, exist_ok=True)
    (said, speaks), (counted, counts) = context.Pipe(duplex=False), context.Pipe(duplex=False)
    process = context.Process(target=_child, args=(list(arguments), fault, str(temporary), speaks, counts))
    process.start()
    speaks.close()
    counts.close()
    text = b""
    while part := os.read(said.fileno(), 65536):
        text += part
    process.join()
    writes = 0
    with contextlib.suppress(EOFError):
        writes = counted.recv()
    return Ended(process.exitcode or 0, text.decode(errors="replace"), writes)


def _child(arguments: list[str], fault: Fault, temporary: str, speaks: Connection, counts: Connection) -> None:
    os.dup2(speaks.fileno(), 1)
    os.dup2(speaks.fileno(), 2)
    speaks.close()
    sys.stdout, sys.stderr = (os.fdopen(number, "w", buffering=1) for number in (1, 2))
    os.environ["TMPDIR"] = temporary
    tempfile.tempdir = None
    writes = _spoil(fault)
    try:
        code = main(arguments)
    except BaseException:
        traceback.print_exc()
        code = 1
    counts.send(writes[0])
    counts.close()
    os._exit(code)


def _spoil(fault: Fault) -> list[int]:
    """Let the disk fail from now on; gives the number of writes so far, which goes on counting."""
    writes = [0]

    def pass_or_fail() -> None:
        writes[0] += 1
        if fault.first and (writes[0] == fault.first or (fault.stays and writes[0] > fault.first)):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    def audit(event: str, arguments: tuple[Any, ...]) -> None:
        opened = event == "open" and isinstance(arguments[2], int) and arguments[2] & _WRITING
        if event in ("os.mkdir", "os.rename") or (opened and isinstance(arguments[0], str | bytes | os.PathLike)):
            pass_or_fail()

    flush = os.fsync

    def flush_or_fail(file: int) -> None:
        pass_or_fail()
        flush(file)

    os.fsync = flush_or_fail
    sys.addaudithook(audit)
    if fault.file_size is not None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (fault.file_size, fault.file_size))
    return writes
