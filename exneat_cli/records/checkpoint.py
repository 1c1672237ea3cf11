"""Checkpoints: the state of an unfinished run, as data.

One NPZ file per checkpoint, without pickles: columns of numbers and one member of JSON, followed by the SHA-256
digest of the archive. A damaged file is skipped, and the one before it is used.
"""

from __future__ import annotations

import hashlib
import io
import json
import re
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exneat_cli.algorithms import State
from exneat_cli.errors import ExneatError
from exneat_cli.records.files import delete, read_bytes, write_whole

FORMAT = 2
KEPT = 2
"""The newest one, and one to fall back to."""
_LARGEST = 16 * 1024**3
_NAME = re.compile(r"checkpoint-(\d{6,9})\.npz")
_STATE, _DIGEST_SIZE = "state", hashlib.sha256().digest_size


def write_checkpoint(directory: Path, checkpoint: State, configuration_hash: str) -> None:
    """Write a checkpoint of the run with this hash, and delete those that are no longer needed.

    The plain part says under ``generation`` how many generations are done.

    Raises:
        ExneatError: the file cannot be written; the older ones are kept then.
        ValueError: a number is not finite.
    """
    plain, arrays = checkpoint
    newest = plain["generation"]
    state = {"format": FORMAT, "configuration_hash": configuration_hash, **plain}
    text = np.frombuffer(json.dumps(state, allow_nan=False).encode(), np.uint8)
    buffer = io.BytesIO()
    np.savez(buffer, **arrays, **{_STATE: text})  # type: ignore[arg-type]
    write_whole(directory / f"checkpoint-{newest:06d}.npz", with_digest(buffer.getvalue()))
    # A checkpoint of a later generation was skipped as damaged: it must not displace sound ones.
    kept = [path for path, generation in _found(directory) if generation <= newest][:KEPT]
    for path, _ in _found(directory):
        if path not in kept:
            delete(path)


def with_digest(archive: bytes) -> bytes:
    """The bytes followed by their digest; readers of ZIP files ignore what follows the archive."""
    return archive + hashlib.sha256(archive).digest()


def read_checkpoints(directory: Path, configuration_hash: str) -> Iterator[State | str]:
    """Every checkpoint of a run, as it was written, the newest first; in place of a damaged one, what is wrong."""
    for path, generation in _found(directory):
        try:
            yield _read(path, {"format": FORMAT, "configuration_hash": configuration_hash, "generation": generation})
        except ExneatError as error:
            yield str(error)


def _found(directory: Path) -> list[tuple[Path, int]]:
    """Checkpoint files and their generations, the newest first."""
    found = [(path, int(name[1])) for path in directory.iterdir() if (name := _NAME.fullmatch(path.name))]
    return sorted(found, key=lambda pair: -pair[1])


def _read(path: Path, head: dict[str, Any]) -> State:
    """A checkpoint whose plain part must begin with `head`."""
    data = read_bytes(path, _LARGEST)
    try:
        arrays = _arrays(data)
        plain = dict(json.loads(arrays.pop(_STATE).tobytes()))
    except Exception as error:  # NumPy and the ZIP reader raise errors of many classes on arbitrary bytes
        raise ExneatError(f"{path}: damaged: {error or type(error).__name__}") from error
    for key, expected in head.items():
        if plain.pop(key, None) != expected:
            raise ExneatError(f"{path}: its {key} is not {expected}: it belongs to another run or version")
    return {"generation": head["generation"], **plain}, arrays


def _arrays(data: bytes) -> dict[str, NDArray[Any]]:
    archive, digest = data[:-_DIGEST_SIZE], data[-_DIGEST_SIZE:]
    if hashlib.sha256(archive).digest() != digest:
        raise ValueError("its digest is not that of its content")
    with zipfile.ZipFile(io.BytesIO(archive)) as members:
        if any(entry.compress_type != zipfile.ZIP_STORED for entry in members.infolist()):
            raise ValueError("a member is compressed, which exneat never does")
    with np.load(io.BytesIO(archive), allow_pickle=False) as columns:
        return dict(columns)
