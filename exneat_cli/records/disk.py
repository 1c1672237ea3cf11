"""Whether runs can be written to a place: files, locks and room, tried out and tidied up."""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

from exneat_cli.errors import ExneatError
from exneat_cli.records.files import write_whole
from exneat_cli.records.run_directory import RunDirectory


def nearest_directory(root: Path) -> Path:
    """A directory, or the nearest one above it that is there.

    Raises:
        ExneatError: something else is in the way, or the name is impossible.
    """
    place = Path(os.path.abspath(root))
    try:
        while not place.exists():
            if place.is_symlink():
                raise ExneatError(f"{place} is a link that leads nowhere")
            place = place.parent
    except OSError as error:
        raise ExneatError(f"the name cannot be used: {error.strerror}") from error
    if not place.is_dir():
        raise ExneatError(f"{place} is a file")
    return place


def try_writing(root: Path) -> None:
    """Write and remove a file as runs do, in a directory that is gone afterwards.

    A root that is not there is not made: the trial takes place in the nearest directory above it, so that a run
    that starts at the same moment never loses the directory that it has just found.

    Raises:
        ExneatError: the root cannot be made or written.
    """
    with _trial_directory(root) as trial:
        write_whole(trial / "trial", b"written by exneat doctor\n")


def locks_exclude(root: Path) -> bool:
    """Whether a lock keeps a second writer out; False where locks are granted to everyone.

    Raises:
        ExneatError: the root cannot be written, or its file system refuses locks.
    """
    with _trial_directory(root) as trial:
        run = RunDirectory(trial)
        with run.held():
            try:
                with run.held():
                    return False
            except ExneatError:
                return True


def free_bytes(root: Path) -> int:
    """Bytes that this user may still write below a root.

    Raises:
        ExneatError: something else than a directory is in the way.
        OSError: the file system does not say.
    """
    return shutil.disk_usage(nearest_directory(root)).free


@contextlib.contextmanager
def _trial_directory(root: Path) -> Iterator[Path]:
    above = nearest_directory(root)
    try:
        with tempfile.TemporaryDirectory(prefix=".exneat-doctor-", dir=above) as path:
            yield Path(path)
    except OSError as error:
        raise ExneatError(f"{above}: {error.strerror}") from error
    except ExneatError as error:
        if isinstance(error.__cause__, OSError):  # its message would name the trial's file, which is gone
            raise ExneatError(f"{above}: {error.__cause__.strerror}") from error
        raise
