"""A run directory holds one run, written by one process, and is never mistaken for another."""

from __future__ import annotations

import errno
import json
import os
from pathlib import Path
from typing import Any

import pytest
import yaml

from exneat_cli.errors import ExneatError
from exneat_cli.records import (
    DONE,
    MANIFEST_FORMAT,
    Manifest,
    Result,
    RunDirectory,
    Score,
    configuration_hash,
    find_runs,
    runs_at,
)

SETTINGS = {"generations": 5, "seed": 0, "task": {"name": "ant", "patience": 100}}
SCORE = Score(1, 0.0, 0.0, 0.0, 0.0, 0, (0.0,))


def test_the_hash_ignores_where_and_how_and_how_a_number_was_typed_but_not_what() -> None:
    base = {"seed": 1, "task": {"name": "ant", "limits": [0, 1.0]}, "executor": {"workers": 1}, "output": "a"}
    alike = {"executor": {"workers": 4}, "output": "b", "resume": True, "generations": 9}
    assert configuration_hash(base) == configuration_hash({**base, **alike})
    assert configuration_hash(base) == configuration_hash({**base, "task": {"limits": (0.0, 1), "name": "ant"}})
    assert configuration_hash(base) != configuration_hash({**base, "seed": 2})
    assert configuration_hash(base) != configuration_hash({**base, "seed": True})
    assert configuration_hash(base) != configuration_hash({**base, "task": {"name": "maze"}})
    assert configuration_hash(base, with_seed=False) == configuration_hash({**base, "seed": 2}, with_seed=False)


def claim(run: RunDirectory, *, resume: bool = False, lengthen: bool | None = None, **changes: Any) -> bool:
    """Whether the run there is finished."""
    longer = resume if lengthen is None else lengthen
    with run.claimed("hash", {**SETTINGS, **changes}, resume=resume, lengthen=longer) as is_finished:
        return is_finished


def started(path: Path, status: str, **others: Any) -> RunDirectory:
    run = RunDirectory(path)
    assert not claim(run)
    known = {"variant": "neat", "task": "ant", "seed": 0, "configuration_hash": "hash", "generations": 5, **others}
    result = Result(champion=SCORE, standing_still=SCORE) if status == DONE else None
    manifest = Manifest(format=MANIFEST_FORMAT, status=status, result=result, **known)
    run.begin(yaml.safe_dump(SETTINGS), manifest, {})
    assert run.read_manifest() == manifest
    return run


def test_a_run_is_finished_if_it_is_done_and_the_one_that_is_meant(tmp_path: Path) -> None:
    run = started(tmp_path / "ant" / "neat-s0-abcdef", "done")
    assert claim(run)
    assert claim(run, resume=True)
    assert run.is_finished("hash", 5)
    assert not run.is_finished("another hash")
    assert not run.is_finished(generations=6)
    run.update_manifest(status="interrupted")
    assert not run.is_finished()
    assert not RunDirectory(tmp_path / "nowhere").is_finished()
    assert find_runs(tmp_path) == [run]


def test_folders_that_cannot_be_read_are_told_and_the_others_searched(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for place in ("a/deep/er", "b/two", "b/one", ".hidden/run", "top"):
        (tmp_path / place).mkdir(parents=True)
        (tmp_path / place / "manifest.json").touch()
    (tmp_path / "closed").mkdir()

    def scan(path: str) -> Any:
        if Path(path).name == "closed":  # what a superuser may read all the same
            raise PermissionError(errno.EACCES, "Permission denied", path)
        return scandir(path)

    scandir, told = os.scandir, []
    monkeypatch.setattr("os.scandir", scan)
    assert [run.path for run in find_runs(tmp_path, told.append)] == [tmp_path / p for p in ("top", "b/one", "b/two")]
    assert [error.filename for error in told] == [str(tmp_path / "closed")]
    assert find_runs(tmp_path / "nowhere", told.append) == find_runs(tmp_path / "closed") == []
    assert len(told) == 1
    assert [run.path.name for run in runs_at(tmp_path / "b" / "*")] == ["one", "two"]
    assert runs_at(tmp_path / "nowhere" / "*") == []
    for pattern in ("closed/*", "*/*"):
        with pytest.raises(ExneatError, match="closed: cannot be read: Permission denied"):
            runs_at(tmp_path / pattern)


@pytest.mark.parametrize("status", ["running", "failed", "interrupted"])
def test_an_unfinished_run_is_refused_naming_resume(tmp_path: Path, status: str) -> None:
    run = started(tmp_path / "ant" / "run", status)
    run.history.touch()
    with pytest.raises(ExneatError, match=f"{status}.*\n.*resume=true"):
        claim(run)
    assert not claim(run, resume=True)


def test_a_run_that_failed_before_anything_was_trained_blocks_nothing(tmp_path: Path) -> None:
    assert not claim(started(tmp_path / "ant" / "run", "failed"))


def test_a_run_that_cannot_be_read_is_not_taken_for_none(tmp_path: Path) -> None:
    run = started(tmp_path / "ant" / "run", "done")
    run.manifest.unlink()
    assert not run.is_there()
    run.manifest.symlink_to(run.manifest)
    with pytest.raises(ExneatError, match="run: cannot be read: Too many levels of symbolic links"):
        run.is_there()


@pytest.mark.parametrize("status", ["done", "running"])
def test_a_run_may_be_made_longer_by_resume_and_never_shorter(tmp_path: Path, status: str) -> None:
    run = started(tmp_path / "run", status)
    with pytest.raises(ExneatError, match=r"resume=true"):
        claim(run, generations=6)
    assert not claim(run, resume=True, generations=6)
    if status == "done":
        with pytest.raises(ExneatError, match=r"holds a finished run of 5 generations\n.*resume=true"):
            claim(run, resume=True, lengthen=False, generations=6)
    with pytest.raises(ExneatError, match="holds a run of 5 generations, but 4 are asked for"):
        claim(run, resume=True, generations=4)


def test_a_manifest_of_the_last_format_is_read_where_worlds_are_as_they_were(tmp_path: Path) -> None:
    run = started(tmp_path / "run", "done")
    run.manifest.write_text(json.dumps({**json.loads(run.manifest.read_text()), "format": 3, "task": "ant"}))
    assert run.read_manifest().format == 3


@pytest.mark.parametrize(
    ("entries", "named"),
    [
        ({"format": 3, "task": "hunting"}, "expected format 4, got 3: task=hunting was a different world then"),
        ({"format": 2}, "expected format 4, got 2: another version of exneat wrote it"),
        ({"status": "\x1b[31mdone"}, "damaged: status: invalid enum value"),
        ({"wurst": 1}, "damaged: object contains unknown field wurst"),
        ({"result": {"champion": {}}}, "damaged: result.champion: object missing required field episodes"),
        ({"result": None}, "damaged: result: expected the figures of a finished run, got nothing"),
    ],
)
def test_a_manifest_that_is_of_another_format_or_damaged_is_refused_by_field(
    tmp_path: Path, entries: dict[str, Any], named: str
) -> None:
    run = started(tmp_path / "run", "done")
    run.manifest.write_text(json.dumps({**json.loads(run.manifest.read_text()), **entries}))
    for read in (run.read_manifest, run.is_finished, lambda: claim(run, resume=True)):
        with pytest.raises(ExneatError, match=rf"manifest\.json: {named}") as refused:
            read()
        assert "\n" not in str(refused.value)


@pytest.mark.parametrize("resume", [True, False])
def test_somebody_elses_directory_is_never_claimed(tmp_path: Path, resume: bool) -> None:
    notes = RunDirectory(tmp_path / "notes")
    notes.path.mkdir()
    (notes.path / "thoughts.txt").write_text("mine")
    with pytest.raises(ExneatError, match=r"without manifest\.json"):
        claim(notes, resume=resume)
    (tmp_path / "file").touch()
    with pytest.raises(ExneatError, match="expected a directory, got a file"):
        claim(RunDirectory(tmp_path / "file"), resume=resume)


def test_of_another_run_at_most_three_settings_that_differ_are_named(tmp_path: Path) -> None:
    other = started(tmp_path / "other", "done", configuration_hash="another hash")
    with pytest.raises(ExneatError, match=r"holds another run: task\.patience is 100 there, 7 here\n"):
        claim(other, task={"name": "ant", "patience": 7})
    named = r"linkage is unset there, full here; seed is 0 there, 1 here; task\.name is ant there, maze here; \.\.\.\n"
    with pytest.raises(ExneatError, match=named):
        claim(other, task={"name": "maze"}, linkage="full", seed=1)
    other.config.write_text("- 1")
    with pytest.raises(ExneatError, match=r"its config\.yaml cannot be read"):
        claim(other)


def test_what_a_killed_run_left_is_taken_up_and_its_unfinished_writes_are_gone(tmp_path: Path) -> None:
    begun = RunDirectory(tmp_path / "begun")
    begun.path.mkdir()
    (begun.path / ".manifest.json.7.tmp").write_text("half")
    assert not claim(begun)
    assert not list(begun.path.iterdir())
    run = started(tmp_path / "run", "running")
    run.plots.mkdir()
    for path in (run.path / ".x.csv.7.tmp", run.plots / ".x.svg.7.tmp", run.path / ".of-somebody-else.tmp"):
        path.write_text("half")
    claim(run, resume=True)
    assert [path.name for path in run.path.rglob("*.tmp")] == [".of-somebody-else.tmp"]


def test_a_second_writer_is_refused_while_the_first_one_lives(tmp_path: Path) -> None:
    run = started(tmp_path / "run", "running")
    assert not run.is_held()
    refused = pytest.raises(ExneatError, match=rf"another process .* \(process id {os.getpid()}\)")
    with run.claimed("hash", SETTINGS, resume=True, lengthen=True), refused:
        assert run.is_held()
        claim(run, resume=True)
    assert not claim(run, resume=True)


def test_a_directory_that_was_removed_while_it_was_locked_is_not_held(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = RunDirectory(tmp_path / "run")
    run.path.mkdir()

    def remove_and_make_anew(*_: object) -> None:
        run.path.rename(tmp_path / "gone")
        run.path.mkdir()

    monkeypatch.setattr("fcntl.flock", remove_and_make_anew)
    with pytest.raises(ExneatError, match="has just been removed by another process"), run.held():
        pass
