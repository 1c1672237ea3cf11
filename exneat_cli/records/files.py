"""Writing files so that each is whole or absent, and reading them as data."""

from __future__ import annotations

import contextlib
import csv
import io
import json
import math
import os
import re
import stat
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from exneat_cli.errors import ExneatError
from exneat_cli.interruption import uninterrupted

_LARGEST_TEXT = 64 * 1024**2
_TEMPORARY = re.compile(r"\..+\.(\d{1,10})\.tmp")


def write_whole(path: Path, content: str | bytes) -> None:
    """Write a file by way of a temporary one, so that a reader or a crash never meets half of it.

    Raises:
        ExneatError: the disk is full, the directory is gone or not writable.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    data = content.encode("utf-8") if isinstance(content, str) else content
    with uninterrupted():
        try:
            with temporary.open("wb") as file:
                file.write(data)
                file.flush()
                os.fsync(file.fileno())
            os.replace(temporary, path)
        except OSError as error:
            delete(temporary)
            raise ExneatError(f"{path}: could not be written: {error.strerror}; check the disk and output=") from error


def delete(path: Path) -> None:
    """Delete a file that may be there; one that cannot be deleted stays."""
    with contextlib.suppress(OSError):
        path.unlink(missing_ok=True)


def delete_orphans(directory: Path) -> None:
    """Delete temporary files of processes that were killed while they wrote there."""
    for path in directory.glob(".*.tmp"):
        maker = _TEMPORARY.fullmatch(path.name)
        if maker and not _is_alive(int(maker[1])):
            delete(path)


def _is_alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):
        return True
    return process != os.getpid()


def make_directory(path: Path) -> None:
    """Make a directory and those above it, unless they are there.

    Raises:
        ExneatError: something is in the way, or it cannot be made.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ExneatError(f"{path}: cannot be made: {error.strerror}") from error


def write_json(path: Path, content: object) -> None:
    """Write JSON for people: indented, keys in the order given, NaN refused.

    Raises:
        ExneatError: the file cannot be written.
        ValueError: a number is not finite.
    """
    write_whole(path, json.dumps(content, indent=2, allow_nan=False) + "\n")


def write_csv(path: Path, columns: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Write a table; floats keep every digit, so equal numbers are equal bytes.

    Raises:
        ExneatError: the file cannot be written.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows([repr(float(v)) if isinstance(v, float) else v for v in row] for row in rows)
    write_whole(path, text.getvalue())


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
        ExneatError: it is missing, unreadable, no file (a directory, or a pipe that would never end), or larger than
            `largest` bytes.
    """
    try:
        kind = path.stat()
        if not stat.S_ISREG(kind.st_mode):
            raise ExneatError(f"{path}: could not be read: expected a file, got {_kind_of(kind.st_mode)}")
        if kind.st_size > largest:
            raise ExneatError(f"{path}: expected at most {largest} bytes, got {kind.st_size}")
        return path.read_bytes()
    except OSError as error:
        raise ExneatError(f"{path}: could not be read: {error.strerror}") from error
    except ValueError as error:
        raise ExneatError(f"{str(path)!r}: could not be read: {error}") from error


def _kind_of(mode: int) -> str:
    return "a directory" if stat.S_ISDIR(mode) else "a pipe or device"


def read_json(path: Path) -> dict[str, Any]:
    """Read one JSON object.

    Raises:
        ExneatError: the file is missing, unreadable, or no JSON object; a key comes twice, or a number is not finite.
    """
    text = read_text(path)
    try:
        content = json.loads(
            text, object_pairs_hook=_without_twins, parse_constant=_no_constant, parse_float=_finite_float
        )
    except RecursionError as error:
        raise ExneatError(f"{path}: expected JSON, got something nested too deeply") from error
    except ValueError as error:
        raise ExneatError(f"{path}: expected JSON, got something else: {error}") from error
    if not isinstance(content, dict):
        raise ExneatError(f"{path}: expected a JSON object, got {type(content).__name__}")
    return content


def _without_twins(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    content = dict(pairs)
    if len(content) < len(pairs):
        keys = [key for key, _ in pairs]
        twin = next(key for k, key in enumerate(keys) if key in keys[:k])
        raise ValueError(f"the key {twin[:60]!r} comes twice")
    return content


def _no_constant(name: str) -> float:
    raise ValueError(f"{name} is no number")


def _finite_float(text: str) -> float:
    number = float(text)
    if not math.isfinite(number):
        raise ValueError(f"the number {text[:40]} is too large")
    return number
