"""Checkpoints: the state of an unfinished run, as data.

One NPZ file per checkpoint, without pickles: columns of numbers, one member of JSON, and a SHA-256 digest of all
the others. A file that is damaged in any way is passed over for the one before it.
"""

from __future__ import annotations

import hashlib
import io
import json
import re
import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exneat_cli.errors import ExneatError
from exneat_cli.records.files import delete, read_bytes, write_whole

FORMAT = 2
KEPT = 2
"""The newest one, and one to fall back to."""
_LARGEST = 16 * 1024**3
_NAME = re.compile(r"checkpoint-(\d{6,9})\.npz")
_STATE, _DIGEST = "state", "digest"


class Checkpoint(NamedTuple):
    """What a run goes on from.

    Attributes:
        generation: how many generations are done.
        plain: numbers, strings, lists and dicts.
        arrays: columns of numbers by name.
    """

    generation: int
    plain: dict[str, Any]
    arrays: dict[str, NDArray[Any]]


def write_checkpoint(directory: Path, checkpoint: Checkpoint, configuration_hash: str) -> None:
    """Write a checkpoint, and delete those that are no longer needed.

    Args:
        directory: of the run.
        checkpoint: what to write.
        configuration_hash: of the run; a checkpoint of another one is refused.

    Raises:
        ExneatError: the file cannot be written; the older ones are still there then.
        ValueError: a number is not finite.
    """
    head = {"format": FORMAT, "configuration_hash": configuration_hash, "generation": checkpoint.generation}
    text = json.dumps({**head, **checkpoint.plain}, allow_nan=False)
    members = {**checkpoint.arrays, _STATE: np.frombuffer(text.encode(), np.uint8)}
    buffer = io.BytesIO()
    np.savez(buffer, **members, **{_DIGEST: np.frombuffer(_digest(members), np.uint8)})  # type: ignore[arg-type]
    write_whole(directory / f"checkpoint-{checkpoint.generation:06d}.npz", buffer.getvalue())
    kept = 0
    for path, generation in _found(directory):
        # One of a later generation was passed over as damaged: it must not crowd out the sound ones.
        if generation > checkpoint.generation or kept == KEPT:
            delete(path)
        else:
            kept += 1


def read_checkpoints(directory: Path, configuration_hash: str) -> Iterator[Checkpoint | str]:
    """Every checkpoint of a run, the newest first; in place of a damaged one, a line that says what is wrong.

    Args:
        directory: of the run.
        configuration_hash: of the run.
    """
    for path, generation in _found(directory):
        try:
            yield _read(path, generation, configuration_hash)
        except ExneatError as error:
            yield str(error)


def _found(directory: Path) -> list[tuple[Path, int]]:
    """Checkpoint files and their generations, the newest first."""
    found = [(path, int(name[1])) for path in directory.iterdir() if (name := _NAME.fullmatch(path.name))]
    return sorted(found, key=lambda pair: -pair[1])


def _read(path: Path, generation: int, configuration_hash: str) -> Checkpoint:
    try:
        members = _members(read_bytes(path, _LARGEST))
        if members.pop(_DIGEST).tobytes() != _digest(members):
            raise ValueError("its digest is not that of its content")
        plain = json.loads(members.pop(_STATE).tobytes())
    except _DAMAGE as error:
        raise ExneatError(f"{path}: damaged: {error or type(error).__name__}") from error
    head = {"format": FORMAT, "configuration_hash": configuration_hash, "generation": generation}
    for key, expected in head.items():
        if not isinstance(plain, dict) or plain.pop(key, None) != expected:
            raise ExneatError(f"{path}: its {key} is not {expected}: it belongs to another run or version")
    return Checkpoint(generation, plain, members)


_DAMAGE = (
    *(OSError, EOFError, KeyError, ValueError, TypeError, AttributeError, IndexError, OverflowError, SyntaxError),
    *(RecursionError, MemoryError, NotImplementedError, RuntimeError, zipfile.BadZipFile),
)
"""What reading bytes of any kind as NPZ and JSON may end in."""


def _members(data: bytes) -> dict[str, NDArray[Any]]:
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        if any(entry.compress_type != zipfile.ZIP_STORED for entry in archive.infolist()):
            raise ValueError("a member is compressed, which exneat never does")
    with np.load(io.BytesIO(data), allow_pickle=False) as archive:
        return {name: archive[name] for name in archive.files}


def _digest(members: Mapping[str, NDArray[Any]]) -> bytes:
    digest = hashlib.sha256()
    for name in sorted(members):
        column = members[name]
        digest.update(f"{name} {column.dtype.str} {column.shape}\n".encode())
        digest.update(np.ascontiguousarray(column).tobytes())
    return digest.digest()
