"""What a process prints, where nobody may read it any more: that ends or fails nothing.

The reader of a pipe leaves, a terminal closes, a disk under a log is full, a descriptor was never open: `print` would
raise, amid a run of hours. What cannot be written is lost instead.
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
"""Full disk, used-up quota, limit of file size: no fault of ours, wherever it is met."""


@contextlib.contextmanager
def forgiving_output() -> Iterator[list[OSError]]:
    """Print to standard output and error without errors within the block.

    Yields what went wrong with standard output so far, but for a reader that left.
    """
    for descriptor in range(3):
        try:
            os.fstat(descriptor)
        except OSError:  # else the next file that is opened would have this number, and a library's words in it
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
    if stream is None:  # the descriptor was closed when Python began
        return open(os.devnull, "w", encoding="utf-8", errors="replace")
    try:
        raw = _Forgiving(stream.fileno(), lost)
    except (OSError, ValueError):  # a notebook's or a test's, which is no file
        return stream
    # Unbuffered, as by PYTHONUNBUFFERED, Python keeps no lines: then a line is written when it ends.
    by_line = any(getattr(stream, name, True) for name in ("line_buffering", "write_through"))
    buffered = io.BufferedWriter(raw)
    return io.TextIOWrapper(buffered, stream.encoding, "backslashreplace", line_buffering=by_line)


class _Forgiving(io.FileIO):
    def __init__(self, descriptor: int, lost: list[OSError]) -> None:
        super().__init__(descriptor, "w", closefd=False)
        self._lost = lost

    def write(self, data: Any) -> int:
        """Write what can be written."""
        try:
            while (count := super().write(data)) is None:  # a pipe that does not wait, and is full
                select.select((), (self,), ())
        except OSError as error:
            if error.errno in NO_ROOM:
                self._lost.append(error)
            return len(data)
        return count
