"""Temporary files that are deleted also where the process must be ended."""

from __future__ import annotations

import contextlib
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

from exneat_cli.interruption.writes import finishing, uninterrupted

_there: set[Path] = set()


@contextlib.contextmanager
def scratch_directory(prefix: str = "exneat-", above: Path | None = None) -> Iterator[Path]:
    """A new directory for temporary files; it is deleted with the block, also where a watch ends the process amid it.

    Args:
        prefix: of its name.
        above: the directory that it is made in; the system's for temporary files without it.

    Raises:
        OSError: it cannot be made.
    """
    with contextlib.ExitStack() as ending:
        with uninterrupted():
            path = Path(tempfile.mkdtemp(prefix=prefix, dir=above))
            _there.add(path)
            ending.callback(_delete, path)
        yield path


def delete_scratch() -> None:
    """Delete all such directories now."""
    for path in tuple(_there):
        shutil.rmtree(path, ignore_errors=True)


def _delete(path: Path) -> None:
    with finishing():
        shutil.rmtree(path, ignore_errors=True)
        _there.discard(path)
