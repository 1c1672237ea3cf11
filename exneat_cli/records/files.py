"""Writing files so that each is whole or absent, and reading them as data."""

from __future__ import annotations

import contextlib
import json
import os
import stat
from collections.abc import Iterator
from pathlib import Path

import msgspec

from exneat_cli.errors import ExneatError

_LARGEST_TEXT = 64 * 1024**2


def write_whole(path: Path, content: str | bytes) -> None:
    """Write a file, see `replacing`."""
    with replacing(path) as temporary, temporary.open("wb") as file:
        file.write(content.encode() if isinstance(content, str) else content)
        file.flush()
        os.fsync(file.fileno())


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary file that replaces `path` at the end, so that neither a reader nor a crash leaves half a file.

    Raises:
        ExneatError: the disk is full, the directory is gone or not writable.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        yield temporary
        os.replace(temporary, path)
    except OSError as error:
        raise ExneatError(f"{path}: could not be written: {error.strerror}; check the disk and output=") from error
    finally:
        delete(temporary)


def delete(path: Path) -> None:
    """Delete a file if it exists; one that cannot be deleted stays."""
    with contextlib.suppress(OSError):
        path.unlink(missing_ok=True)


def make_directory(path: Path) -> None:
    """Make a directory and those above it, unless they exist.

    Raises:
        ExneatError: something is in the way, or it cannot be made.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
    except FileExistsError as error:
        there = next(each for each in (path, *path.parents) if os.path.lexists(each))
        came = f"a link that leads nowhere, to {os.readlink(there)}" if there.is_symlink() else "a file"
        raise ExneatError(f"{there}: expected a directory, got {came}") from error
    except OSError as error:
        fix = "set output= to a directory that you can write to"
        raise ExneatError(f"{path}: the directory cannot be made: {error.strerror}\n  {fix}") from error


def write_json(path: Path, content: object) -> None:
    """Write plain data or structs as JSON for people: indented, keys in the order given, NaN refused.

    Raises:
        ExneatError: the file cannot be written.
        ValueError: a number is not finite.
    """
    text = json.dumps(msgspec.to_builtins(content), indent=2, allow_nan=False, ensure_ascii=False)
    write_whole(path, f"{text}\n".encode(errors="replace"))  # an argument of the command line may not be UTF-8


def read_text(path: Path) -> str:
    """The text of a file, without a byte order mark, lines ended by line feeds.

    Raises:
        ExneatError: see `read_bytes`; or it is larger than 64 MiB, or not UTF-8.
    """
    data = read_bytes(path, _LARGEST_TEXT)
    try:
        return data.decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        raise ExneatError(f"{path}:{line}: expected UTF-8 text, got the byte {data[error.start]:#04x}") from error


def read_bytes(path: Path, largest: int) -> bytes:
    """The content of a file.

    Raises:
        ExneatError: it is missing, unreadable, not a file (a directory, or a pipe that would never end), or larger than
            `largest` bytes.
    """
    try:
        kind = path.stat()
        if not stat.S_ISREG(kind.st_mode):
            came = "a directory" if stat.S_ISDIR(kind.st_mode) else "a pipe or device"
            raise ExneatError(f"{path}: could not be read: expected a file, got {came}")
        if kind.st_size > largest:
            raise ExneatError(f"{path}: expected at most {largest} bytes, got {kind.st_size}")
        return path.read_bytes()
    except OSError as error:
        raise ExneatError(f"{path}: could not be read: {error.strerror}") from error
    except ValueError as error:
        raise ExneatError(f"{str(path)!r}: could not be read: {error}") from error
