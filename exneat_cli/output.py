"""Printing that never fails, even if the output cannot be written any more.

When the reader of a pipe leaves, a terminal closes, the disk of a log is full or a descriptor was never open, `print`
would raise, possibly after hours of training. Here, output that cannot be written is lost instead.
"""

from __future__ import annotations

import contextlib
import errno
import io
import os
import select
import sys
from collections.abc import Iterator
from typing import Any, TextIO

NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""Full disk, exhausted quota, limit of file size: errors of the system, not of this program."""


@contextlib.contextmanager
def forgiving_output() -> Iterator[list[OSError]]:
    """Within the block, printing to standard output and standard error never raises.

    Yields the errors of standard output so far, for lack of space only.
    """
    for descriptor in range(3):
        try:
            os.fstat(descriptor)
        except OSError:  # otherwise the next file opened would get this number, and a library's output
            os.open(os.devnull, os.O_RDWR)
    before = sys.stdout, sys.stderr
    lost: list[OSError] = []
    sys.stdout, sys.stderr = _forgiving(sys.stdout, lost), _forgiving(sys.stderr, [])
    try:
        yield lost
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        sys.stdout, sys.stderr = before


def _forgiving(stream: TextIO | None, lost: list[OSError]) -> TextIO:
    if stream is None:  # the descriptor was closed when Python started
        return open(os.devnull, "w", encoding="utf-8", errors="replace")
    try:
        raw = _Forgiving(stream.fileno(), lost)
    except (OSError, ValueError):  # a notebook's or a test's stream, which is not a file
        return stream
    # Streams that are unbuffered, as with PYTHONUNBUFFERED, become line-buffered.
    by_line = any(getattr(stream, name, True) for name in ("line_buffering", "write_through"))
    buffered = io.BufferedWriter(raw)
    return io.TextIOWrapper(buffered, stream.encoding, "backslashreplace", line_buffering=by_line)


class _Forgiving(io.FileIO):
    def __init__(self, descriptor: int, lost: list[OSError]) -> None:
        super().__init__(descriptor, "w", closefd=False)
        self._lost = lost

    def write(self, data: Any) -> int:
        """Write `data` if possible."""
        try:
            while (count := super().write(data)) is None:  # a full non-blocking pipe
                select.select((), (self,), ())
        except OSError as error:
            if error.errno in NO_ROOM:
                self._lost.append(error)
            return len(data)
        return count
