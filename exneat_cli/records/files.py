"""Writing files so that each is whole or absent, and reading them as data."""

from __future__ import annotations

import contextlib
import csv
import io
import json
import os
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import yaml

from exneat_cli.errors import ExneatError
from exneat_cli.interruption import finishing

_TEMPORARY = re.compile(r"\..+\.(\d{1,10})\.tmp")


def write_whole(path: Path, content: str | bytes) -> None:
    """Write a file by way of a temporary one, so that a reader or a crash never meets half of it.

    Raises:
        ExneatError: the disk is full, the directory is gone or not writable.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    data = content.encode("utf-8") if isinstance(content, str) else content
    with finishing():
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


class _StrictLoader(yaml.SafeLoader):
    """Refuses a key that comes twice, where plain YAML would drop the first one silently."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        keys = [self.construct_object(key, deep=True) for key, _ in node.value]
        for key in keys:
            if keys.count(key) > 1:
                raise yaml.constructor.ConstructorError(None, None, f"the key {key!r} comes twice", node.start_mark)
        return super().construct_mapping(node, deep)


def read_yaml(path: Path) -> dict[str, Any]:
    """Read keys with values from YAML, as data.

    Raises:
        ExneatError: the file is missing, unreadable, no YAML, names a key twice, or holds something else.
    """
    try:
        content = yaml.load(path.read_text(encoding="utf-8"), Loader=_StrictLoader)
    except OSError as error:
        raise ExneatError(f"{path}: could not be read: {error.strerror}") from error
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise ExneatError(f"{path}: expected YAML, got something else: {' '.join(str(error).split())}") from error
    if not isinstance(content, dict):
        raise ExneatError(f"{path}: expected keys with values, got {type(content).__name__}")
    return content


def read_json(path: Path) -> dict[str, Any]:
    """Read one JSON object.

    Raises:
        ExneatError: the file is missing, unreadable, or no JSON object.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ExneatError(f"{path}: could not be read: {error.strerror}") from error
    except ValueError as error:
        raise ExneatError(f"{path}: expected JSON, got something else: {error}") from error
    if not isinstance(content, dict):
        raise ExneatError(f"{path}: expected a JSON object, got {type(content).__name__}")
    return content
