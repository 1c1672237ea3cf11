"""Checkpoints are whole, of this run and of this version, or they are not read."""

from __future__ import annotations

import io
import json
import os
import pickle
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from exneat_cli.algorithms import State
from exneat_cli.records.checkpoint import read_checkpoints, with_digest, write_checkpoint

ARRAYS = {"0.current.id": np.arange(5), "0.current.node.bias": np.linspace(0.0, 1.0, 7)}
PLAIN = {"teams": [[1, 2], [3, 4]], "fitness": [0.1, -1e300]}


def written(directory: Path, generation: int = 3, configuration_hash: str = "hash") -> Path:
    write_checkpoint(directory, ({"generation": generation, **PLAIN}, ARRAYS), configuration_hash)
    return directory / f"checkpoint-{generation:06d}.npz"


def read(directory: Path) -> list[State | str]:
    return list(read_checkpoints(directory, "hash"))


def is_whole(found: State | str, generation: int = 3) -> bool:
    if isinstance(found, str):
        return False
    plain, arrays = found
    assert plain == {"generation": generation, **PLAIN}
    assert arrays.keys() == ARRAYS.keys()
    return all(np.array_equal(arrays[name], column) for name, column in ARRAYS.items())


def test_what_was_written_is_read_the_newest_first_and_only_two_are_kept(tmp_path: Path) -> None:
    for generation in (9, 10, 11, 1000000):
        written(tmp_path, generation)
    newest, before = read(tmp_path)
    assert is_whole(newest, 1000000)
    assert is_whole(before, 11)
    assert len(list(tmp_path.iterdir())) == 2


def test_it_is_a_plain_npz_that_needs_no_pickle(tmp_path: Path) -> None:
    with np.load(written(tmp_path), allow_pickle=False) as archive:
        assert set(archive.files) == {*ARRAYS, "state"}
        assert json.loads(archive["state"].tobytes())["fitness"] == PLAIN["fitness"]


def test_a_number_that_is_not_finite_is_never_written(tmp_path: Path) -> None:
    with pytest.raises(ValueError):
        write_checkpoint(tmp_path, ({"generation": 1, "fitness": [float("nan")]}, {}), "hash")
    assert list(tmp_path.iterdir()) == []


@given(position=st.floats(0.0, 1.0, exclude_max=True), bit=st.none() | st.integers(0, 7))
@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_flipped_bit_and_a_missing_end_are_noticed(tmp_path: Path, position: float, bit: int | None) -> None:
    path = written(tmp_path)
    data = bytearray(path.read_bytes())
    place = int(position * len(data))
    if bit is None:
        del data[place:]
    else:
        data[place] ^= 1 << bit
    path.write_bytes(bytes(data))
    (found,) = read(tmp_path)
    assert str(found).startswith(f"{path}: damaged: ")


def npz(compressed: bool = False, **members: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    (np.savez_compressed if compressed else np.savez)(buffer, **members)  # type: ignore[arg-type]
    return with_digest(buffer.getvalue())


class Bomb:
    """Would run code if it were ever unpickled."""

    def __reduce__(self) -> tuple[Callable[[str], object], tuple[str]]:
        return pytest.fail, ("a checkpoint was unpickled",)


FOREIGN = {
    "nothing": b"",
    "JSON": with_digest(b'{"format": 1}'),
    "a pickle": with_digest(pickle.dumps({"a": 1})),
    "an NPZ with a pickled object": npz(state=np.array([Bomb()], dtype=object)),
    "a compressed NPZ": npz(compressed=True, state=np.zeros(10**6, np.uint8)),
    "a list": npz(state=np.frombuffer(b"[1]", np.uint8)),
    "deep JSON": npz(state=np.full(10**5, ord("["), np.uint8)),
}


@pytest.mark.parametrize("name", FOREIGN)
def test_a_foreign_file_is_refused_by_its_path(tmp_path: Path, name: str) -> None:
    path = tmp_path / "checkpoint-000003.npz"
    path.write_bytes(FOREIGN[name])
    (found,) = read(tmp_path)
    assert isinstance(found, str)
    assert found.startswith(f"{path}: damaged")


def test_a_checkpoint_of_another_run_or_under_another_number_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path, configuration_hash="other")
    assert "its configuration_hash is not hash" in str(read(tmp_path)[0])
    path.unlink()
    written(tmp_path).rename(tmp_path / "checkpoint-000004.npz")
    assert "its generation is not 4" in str(read(tmp_path)[0])


def test_a_damaged_checkpoint_of_a_later_generation_never_crowds_out_a_sound_one(tmp_path: Path) -> None:
    written(tmp_path, 6).write_bytes(b"damaged")
    written(tmp_path, 7).unlink()
    os.mkfifo(tmp_path / "checkpoint-000007.npz")
    assert "expected a file, got a pipe" in str(read(tmp_path)[0])
    for generation in (1, 2, 3):
        written(tmp_path, generation)
        assert is_whole(read(tmp_path)[0], generation)
    assert [found[0]["generation"] for found in read(tmp_path) if not isinstance(found, str)] == [3, 2]
