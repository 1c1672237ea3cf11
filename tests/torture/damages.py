"""Ways to spoil a checkpoint: by accident, by somebody else's file, and by content that cannot be."""

from __future__ import annotations

import io
import json
import pickle
import random
import zipfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exneat_cli.records.checkpoint import with_digest

Arrays = dict[str, NDArray[Any]]
Plain = dict[str, Any]
_NOTHING = b""


def flipped(data: bytes, chance: random.Random) -> bytes:
    """The same with one bit turned over."""
    place = chance.randrange(len(data))
    return data[:place] + bytes([data[place] ^ 1 << chance.randrange(8)]) + data[place + 1 :]


def cut(data: bytes, chance: random.Random) -> bytes:
    """Only the beginning."""
    return data[: chance.randrange(len(data))]


def torn(data: bytes, chance: random.Random) -> bytes:
    """A stretch in the middle is zeros, as after a crash of the machine."""
    first = chance.randrange(len(data))
    length = min(len(data) - first, chance.randrange(1, 4096))
    return data[:first] + bytes(length) + data[first + length :]


def foreign(data: bytes, other_run: bytes, other_generation: bytes, chance: random.Random) -> dict[str, bytes]:
    """Whole files that are no checkpoint of this run and generation, by what they are; some have a right digest."""
    numbers = {"a": np.arange(3), "state": np.zeros(3, np.uint8)}
    return {
        "empty": _NOTHING,
        "random bytes": chance.randbytes(len(data)),
        "JSON": json.dumps({"generation": 2}).encode(),
        "a pickle": with_digest(pickle.dumps({"generation": 2})),
        "another NPZ": _npz(np.savez, numbers),
        "an NPZ without members": _npz(np.savez, {}),
        "an NPZ with pickles": _npz(np.savez, {**numbers, "b": np.array([{}, []], object)}),
        "a compressed NPZ": _npz(np.savez_compressed, _load(data)),
        "a checkpoint of another run": other_run,
        "a checkpoint of another generation": other_generation,
        "two checkpoints in one file": data + other_generation,
        "a ZIP that is no NPZ": _zip({"readme.txt": b"hello"}),
        "a ZIP with a huge declared array": _zip({"state.npy": _header("<f8", (10**15,))}),
        "a ZIP with a negative shape": _zip({"state.npy": _header("<f8", (-5,))}),
        "a directory": b"<directory>",
    }


def _npz(save: Callable[..., None], members: Mapping[str, NDArray[Any]]) -> bytes:
    buffer = io.BytesIO()
    save(buffer, **members)
    return with_digest(buffer.getvalue())


def _zip(members: Mapping[str, bytes]) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return with_digest(buffer.getvalue())


def _header(kind: str, shape: tuple[int, ...]) -> bytes:
    text = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}".ljust(117) + "\n"
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text.encode()


def _load(data: bytes) -> Arrays:
    with np.load(io.BytesIO(data)) as archive:
        return {name: archive[name] for name in archive.files}


def impossible(data: bytes) -> Iterator[tuple[str, bytes]]:
    """Checkpoints with a right digest whose content cannot have come from a run, with what is wrong in words."""
    for name, spoil in {**_WRONG_COLUMNS, **_WRONG_STATE}.items():
        arrays = _load(data)
        plain = json.loads(arrays.pop("state").tobytes())
        spoil(plain, arrays)
        arrays["state"] = np.frombuffer(json.dumps(plain).encode(), np.uint8)
        yield name, _npz(np.savez, arrays)


Spoil = Callable[[Plain, Arrays], object]


def _column(name: str, change: Callable[[NDArray[Any]], object]) -> Spoil:
    """Change a column of the first subpopulation, or put another in its place."""

    def spoil(plain: Plain, arrays: Arrays) -> None:
        column = arrays[f"current.0.{name}"].copy()
        changed = change(column)
        arrays[f"current.0.{name}"] = changed if isinstance(changed, np.ndarray) else column

    return spoil


def _set(place: int, value: float) -> Callable[[NDArray[Any]], object]:
    return lambda column: column.__setitem__(place, value)


def _close_a_cycle(plain: Plain, arrays: Arrays) -> None:
    """Let the first connection between a sensor and a node run from the node to itself."""
    arrays["current.0.connection.source"] = arrays["current.0.connection.source"].copy()
    arrays["current.0.connection.source"][0] = arrays["current.0.connection.target"][0]
    order = arrays["current.0.connections"][0]
    rows = sorted(range(order), key=lambda k: _ends(arrays, k))
    for name in [name for name in arrays if name.startswith("current.0.connection.")]:
        column = arrays[name].copy()
        column[:order] = column[:order][rows]
        arrays[name] = column


def _ends(arrays: Arrays, row: int) -> tuple[int, int]:
    return int(arrays["current.0.connection.target"][row]), int(arrays["current.0.connection.source"][row])


def _state(*path: Any, value: Any) -> Spoil:
    """Put a value into the JSON; a callable is given what was there."""

    def spoil(plain: Plain, arrays: Arrays) -> None:
        inner: Any = plain
        for step in path[:-1]:
            inner = inner[step]
        inner[path[-1]] = value(inner[path[-1]]) if callable(value) else value

    return spoil


_FIRST = ("search", "subpopulations", 0)
_NAN = float("nan")
_WRONG_COLUMNS: dict[str, Spoil] = {
    "a missing column": lambda plain, arrays: arrays.pop("current.0.node.bias"),
    "a missing subpopulation": lambda plain, arrays: [
        arrays.pop(name) for name in list(arrays) if name.startswith("current.0.")
    ],
    "a NaN weight": _column("connection.weight", _set(0, np.nan)),
    "an infinite bias": _column("node.bias", _set(0, np.inf)),
    "weights of another type": _column("connection.weight", lambda column: column.astype(np.float32)),
    "weights in two dimensions": _column("connection.weight", lambda column: column.reshape(-1, 1)),
    "weights too few": _column("connection.weight", lambda column: column[:-1]),
    "a negative number of nodes": _column("nodes", _set(0, -1)),
    "a huge number of nodes": _column("nodes", _set(0, 2**62)),
    "numbers of nodes that overflow": _column("nodes", lambda column: np.full_like(column, 2**62)),
    "a genome that comes twice": _column("id", lambda column: np.full_like(column, column[0])),
    "an unknown genome": _column("id", _set(0, 10**9)),
    "a node that comes twice": _column("node.key", lambda column: np.zeros_like(column)),
    "a connection to an unknown node": _column("connection.target", _set(0, 10**9)),
    "a connection from an unknown node": _column("connection.source", _set(0, 10**9)),
    "a connection from an unknown sensor": _column("connection.source", _set(0, -(10**9))),
    "an unknown activation": _column("node.activation", _set(0, 99)),
    "an unknown team in the hall of fame": lambda plain, arrays: _name_strangers(arrays, "hall_of_fame.ids"),
    "an unknown first team": lambda plain, arrays: _name_strangers(arrays, "first_generation.ids"),
    "a network without outputs": lambda plain, arrays: _empty_first_genome(arrays),
    "a network that feeds itself": _close_a_cycle,
}
_WRONG_STATE: dict[str, Spoil] = {
    "a negative generation": _state("generation", value=-2),
    "no history": _state("history", value=[]),
    "a NaN in the history": _state("history", 0, "best_fitness", value=_NAN),
    "a history that lacks a column": lambda plain, arrays: plain["history"][0].pop("best_so_far"),
    "a word in the history": _state("history", 0, "best_fitness", value="much"),
    "rows of history in another order": _state("history", value=lambda rows: rows[::-1]),
    "a NaN in the hall of fame": _state("search", "hall_of_fame", 0, 0, value=_NAN),
    "a hall of fame of the future": _state("search", "hall_of_fame", 0, 1, value=99),
    "a NaN fitness": _state("search", "fitness", 0, value=_NAN),
    "a fitness too few": _state("search", "fitness", value=lambda values: values[:-1]),
    "a team too few": _state("search", "teams", value=lambda teams: teams[:-1]),
    "an unknown team": _state("search", "teams", 0, 0, value=10**9),
    "a team that comes twice": _state("search", "teams", value=lambda teams: [teams[1], *teams[1:]]),
    "a subpopulation too many": _state("search", "subpopulations", value=lambda all_: [*all_, all_[0]]),
    "no random state": _state(*_FIRST, "random", value=None),
    "a random state that is too short": _state(*_FIRST, "random", 1, value=lambda words: words[:-1]),
    "a random state of words": _state(*_FIRST, "random", 1, value=lambda words: ["a"] * len(words)),
    "a species without members": _state(*_FIRST, "species", 0, "members", value=[]),
    "a species of strangers": _state(*_FIRST, "species", 0, "members", 0, value=10**9),
    "an unknown representative": _state(*_FIRST, "species", 0, "representative", value=10**9),
    "a species that comes twice": _state(*_FIRST, "species", value=lambda all_: [*all_, all_[0]]),
    "a NaN in a species' fitness": _state(*_FIRST, "species", 0, "fitness_history", value=[_NAN]),
    "the next genome below those there are": _state(*_FIRST, "next_genome", value=1),
    "a negative next species": _state(*_FIRST, "next_species", value=-5),
    "the next node below those there are": _state(*_FIRST, "next_node", value=0),
    "a next genome of words": _state(*_FIRST, "next_genome", value="ten"),
    "a pairing generator of another kind": _state("search", "pairing", value={"bit_generator": "MT19937"}),
    "a list in place of the state": _state("search", value=[]),
}


def _empty_first_genome(arrays: Arrays) -> None:
    nodes, connections = int(arrays["current.0.nodes"][0]), int(arrays["current.0.connections"][0])
    for name in list(arrays):
        for prefix, many in (("current.0.node.", nodes), ("current.0.connection.", connections)):
            if name.startswith(prefix):
                arrays[name] = arrays[name][many:]
    for name in ("current.0.nodes", "current.0.connections"):
        arrays[name] = arrays[name].copy()
        arrays[name][0] = 0


def _name_strangers(arrays: Arrays, name: str) -> None:
    arrays[name] = np.full_like(arrays[name], 10**9)


def put(path: Path, data: bytes) -> None:
    """Put a spoilt file, or a directory, in the place of a checkpoint."""
    if data == b"<directory>":
        path.mkdir()
    else:
        path.write_bytes(data)
