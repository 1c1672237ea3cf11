"""Damaged checkpoints: each is refused, so that the one before it is taken, or else loads as what it was."""

from __future__ import annotations

import random
import shutil
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from exneat_cli.algorithms import State
from exneat_cli.records.checkpoint import read_checkpoints
from exneat_cli.runs import RunSettings, train
from exneat_cli.runs.training import Training
from exneat_cli.tasks import AntTask, TrackMaze
from exneat_cli.wiring import Geometry
from tests.torture.damages import cut, flipped, foreign, impossible, put, torn
from tests.torture.findings import Finding, Mistakes, exactly

_SMALL: dict[str, Any] = {"generations": 4, "population": 12, "validation_episodes": 1, "test_episodes": 1}
_RUNS = {
    "ant": RunSettings(
        task=AntTask(max_steps=40, patience=20), geometry=Geometry("all"), linkage="full", seed=1, **_SMALL
    ),
    "track maze": RunSettings(task=TrackMaze(), geometry=Geometry("all"), linkage="output", seed=1, **_SMALL),
}


class _Original(NamedTuple):
    """A run with its two checkpoints, as files and as what they restore."""

    settings: RunSettings
    newest: Path
    data: bytes
    before: bytes
    of_another_run: bytes
    restored: dict[int, State]


def damage_checkpoints(count: int, seed: int) -> list[Finding]:
    """Spoil the newest checkpoint of a run and restore; returns the figures.

    Args:
        count: bit flips; a tenth as many files are cut, and as many torn. Foreign and impossible ones all come once.
        seed: of the places.
    """
    tried: dict[str, int] = {}
    fell_back = 0
    mistakes = Mistakes()
    with tempfile.TemporaryDirectory() as folder:
        for number, (name, settings) in enumerate(_RUNS.items()):
            original = _original(settings, Path(folder) / name)
            share = max(1, count // len(_RUNS) + (number < count % len(_RUNS)))
            for kind, what, data in _damaged(original, share, random.Random(f"{seed} {name}")):
                tried[kind] = tried.get(kind, 0) + 1
                outcome = _restore(original, data)
                fell_back += outcome == "fell back"
                if outcome not in ("fell back", "the same"):
                    mistakes.add(f"{name}, {kind}, {what}: {outcome}")
    total = sum(tried.values())
    note = ", ".join(f"{times} {kind}" for kind, times in tried.items())
    return [
        exactly("bit flips", tried["bit flips"], max(count, len(_RUNS))),
        exactly("damaged checkpoints restored from", total, total, note),
        mistakes.none_of(
            "damaged checkpoints that loaded wrongly or stopped the run", f"{fell_back} refused, the others whole"
        ),
    ]


def _original(settings: RunSettings, folder: Path) -> _Original:
    settings = replace(settings, output=str(folder / "out"))
    run = train(settings).directory
    other = train(replace(settings, seed=2, output=str(folder / "other"))).directory
    before, newest = sorted(run.path.glob("checkpoint-*.npz"))
    restored = {
        each[0]["generation"]: each
        for each in read_checkpoints(run.path, settings.full_hash)
        if not isinstance(each, str)
    }
    other_data = (other.path / newest.name).read_bytes()
    return _Original(settings, newest, newest.read_bytes(), before.read_bytes(), other_data, restored)


def _damaged(original: _Original, flips: int, chance: random.Random) -> Iterator[tuple[str, str, bytes]]:
    """Kind, description and bytes of each damage."""
    data = original.data
    for number in range(flips):
        yield "bit flips", str(number), flipped(data, chance)
    for number in range(max(1, flips // 10)):
        yield "truncations", str(number), cut(data, chance)
        yield "torn pages", str(number), torn(data, chance)
    for what, content in foreign(data, original.of_another_run, original.before, chance).items():
        yield "foreign files", what, content
    for what, content in impossible(data):
        yield "impossible contents", what, content


def _restore(original: _Original, data: bytes) -> str:
    """What comes of restoring with `data` in the place of the newest checkpoint, in words."""
    settings, newest = original.settings, original.newest
    newest.unlink()
    put(newest, data)
    said: list[str] = []
    try:
        checkpoints = read_checkpoints(newest.parent, settings.full_hash)
        restored = Training.resumed(settings, checkpoints, said.append)
        generation = len(restored.history)
        if generation == 0:
            return "began from the beginning"
        same = _same(restored.checkpoint(), original.restored[generation])
    except Exception as error:
        return f"stopped the run: {error!r}"
    finally:
        shutil.rmtree(newest) if newest.is_dir() else newest.unlink()
        newest.write_bytes(original.data)
    if not same:
        return f"generation {generation} was restored as something else"
    return "the same" if generation == settings.generations else "fell back"


def _same(one: State, other: State) -> bool:
    """Whether two checkpoints hold the same; NaN equals nothing, not even itself."""
    (plain, arrays), (others_plain, others) = one, other
    if arrays.keys() != others.keys():
        return False
    same = [np.array_equal(arrays[name], others[name]) for name in arrays]
    return all(same) and _plain(plain) == _plain(others_plain)


def _plain(value: Any) -> Any:
    """With tuples as lists, as JSON has them."""
    if isinstance(value, dict):
        return {key: _plain(each) for key, each in value.items()}
    return [_plain(each) for each in value] if isinstance(value, list | tuple) else value
