"""Runs that are short and still go through everything, and what they leave behind."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Sequence
from pathlib import Path

from tests.torture.program import Program

TASKS = ("ant", "track_maze", "general_maze", "foraging", "hunting")
_SIZES = {
    "ant": ["generations=12", "population=16", "task.max_steps=200"],
    "track_maze": ["generations=14", "population=40", "episodes=6"],
    "general_maze": ["generations=14", "population=40", "episodes=6"],
    "foraging": ["generations=12", "population=40", "episodes=2"],
    "hunting": ["generations=12", "population=40", "episodes=4"],
}
_LINKED = {"ant": ["recipe=thesis", "geometry=all", "linkage=full"]}
_LINKED_GRID = ["geometry=all", "linkage=output"]
_ON_ANT = ("exneat", "ars", "openai_es", "cma_es")
_TINY = ["budget=smoke", "executor=serial", "validation_episodes=2", "test_episodes=2"]
_UNCOMPARED = ("manifest.json", "config.yaml")
"""They tell when, where and how a run went."""


def variants() -> list[tuple[str, list[str]]]:
    """Name and settings of NEAT and of linked ExNEAT on every task; on Ant also what shares by likeness."""
    found = []
    for task in TASKS:
        common = [f"task={task}", *_TINY, *_SIZES[task]]
        found.append((f"{task}, NEAT", [*common, "algorithm=neat"]))
        found.append((f"{task}, ExNEAT linked", [*common, *_LINKED.get(task, _LINKED_GRID)]))
    alike = ["task=ant", *_TINY, *_SIZES["ant"], "geometry=auto"]
    return found + [(f"ant, {name} alike", [*alike, f"algorithm={name}"]) for name in _ON_ANT]


def results(root: Path) -> dict[str, bytes]:
    """Every file below a root that must come out the same, by its place; `wall_seconds` is left out of histories.

    Checkpoints hold `wall_seconds` too, and are looked at elsewhere; files that are still temporary are listed,
    so that one that was left behind counts as a difference.
    """
    found = {}
    for path in sorted(root.rglob("*")):
        if path.is_file() and path.name not in _UNCOMPARED and path.suffix != ".npz":
            content = path.read_bytes()
            found[str(path.relative_to(root))] = _without_time(content) if path.name == "history.csv" else content
    return found


def difference(came: dict[str, bytes], expected: dict[str, bytes]) -> str:
    """Which files differ, are missing or too many, in words; empty if none is."""
    names = sorted({*came, *expected})
    return ", ".join(name for name in names if came.get(name) != expected.get(name))


def undisturbed(arguments: Sequence[str], folder: Path, command: str = "train") -> dict[str, bytes]:
    """The results of a run, or several, that nothing happens to.

    Raises:
        RuntimeError: it did not end well, so that nothing can be compared with it.
    """
    with Program([command, *arguments, "output=out"], folder) as program:
        if program.wait(HANGING_AT_FIRST) != 0:
            raise RuntimeError(f"the undisturbed run failed: {program.errors[-500:]}")
    return results(folder / "out")


HANGING_AT_FIRST = 900.0
"""Seconds that the first run of its kind may take: it compiles."""


def the_run(output: Path) -> Path | None:
    """The only run directory below an output root; None before there is one."""
    found = [path for path in output.glob("*/*") if path.is_dir()]
    return found[0] if found else None


def rows_of(run: Path | None) -> int:
    """Generations that a run's history.csv holds."""
    path = run / "history.csv" if run is not None else None
    return len(path.read_text(encoding="utf-8").splitlines()) - 1 if path is not None and path.exists() else 0


def status_of(run: Path | None) -> str:
    """A run's status; empty before there is one."""
    path = run / "manifest.json" if run is not None else None
    return str(json.loads(path.read_text(encoding="utf-8"))["status"]) if path is not None and path.exists() else ""


def _without_time(history: bytes) -> bytes:
    rows = [row[:-1] for row in csv.reader(io.StringIO(history.decode()))]
    return "\n".join(",".join(row) for row in rows).encode()
