"""What is written is whole, repeats, and is read back as data."""

from __future__ import annotations

import csv
import itertools
import json
import math
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml

from exneat_cli.errors import ExneatError
from exneat_cli.records import (
    MANIFEST_FORMAT,
    Claim,
    HistoryRow,
    RunDirectory,
    configuration_hash,
    find_runs,
    is_held,
    read_champion,
    read_json,
    write_csv,
    write_history,
    write_json,
    write_whole,
)


def test_a_failed_write_keeps_the_old_file_and_leaves_no_other(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "history.csv"
    write_whole(path, "old")

    def full_disk(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full_disk)
    with pytest.raises(ExneatError, match=r"history\.csv: could not be written: No space left"):
        write_whole(path, "new")
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_floats_in_csv_keep_every_bit(tmp_path: Path) -> None:
    values = [0.1 + 0.2, math.pi, 1e-300, -0.0, 5.0]
    write_csv(tmp_path / "t.csv", ["a"], [[value] for value in values])
    with (tmp_path / "t.csv").open() as file:
        assert [float(row["a"]) for row in csv.DictReader(file)] == values


def test_json_with_nan_is_refused_before_anything_is_written(tmp_path: Path) -> None:
    with pytest.raises(ValueError):
        write_json(tmp_path / "m.json", {"x": math.nan})
    assert not list(tmp_path.iterdir())


def test_history_has_the_columns_of_the_design(tmp_path: Path) -> None:
    write_history(tmp_path / "history.csv", [HistoryRow(1, 2.0, 1.0, 1.5, 2.0, 10, 500, 1, 96, 4, 0, 0, 0.1)])
    header, row = (tmp_path / "history.csv").read_text().splitlines()
    assert header == (
        "generation,best_fitness,mean_fitness,median_fitness,best_so_far,episodes,env_steps,species,"
        "connections,hidden_nodes,failed_episodes,extinctions,wall_seconds"
    )
    assert row == "1,2.0,1.0,1.5,2.0,10,500,1,96,4,0,0,0.1"


@pytest.mark.parametrize("content", ["", "[1]", "{", "\xff\x00", "null"])
def test_what_is_no_json_object_is_refused_by_name(tmp_path: Path, content: str) -> None:
    path = tmp_path / "manifest.json"
    path.write_text(content, encoding="latin-1")
    with pytest.raises(ExneatError, match=r"manifest\.json(:1)?: expected"):
        read_json(path)


def test_the_hash_ignores_where_and_how_but_not_what() -> None:
    base = {
        "seed": 1,
        "task": {"name": "ant"},
        "executor": {"workers": 1},
        "output": "a",
        "name": None,
        "resume": False,
    }
    elsewhere = {**base, "executor": {"workers": 4}, "output": "b", "name": "n", "resume": True}
    assert configuration_hash(base) == configuration_hash(elsewhere)
    assert configuration_hash(base) != configuration_hash({**base, "seed": 2})
    assert configuration_hash(base, with_seed=False) == configuration_hash({**base, "seed": 2}, with_seed=False)
    assert configuration_hash(base) != configuration_hash({**base, "task": {"name": "maze"}})


SETTINGS = {"generations": 5, "seed": 0, "task": {"name": "ant", "patience": 100}}


def claim(
    run: RunDirectory, full_hash: str, *, resume: bool = False, lengthen: bool | None = None, **changes: Any
) -> Claim:
    longer = resume if lengthen is None else lengthen
    with run.claimed(full_hash, {**SETTINGS, **changes}, resume=resume, lengthen=longer) as claim:
        return claim


def started(path: Path, status: str, full_hash: str = "hash") -> RunDirectory:
    run = RunDirectory(path)
    assert claim(run, full_hash) is Claim.BEGIN
    head = {"format": MANIFEST_FORMAT, "configuration_hash": full_hash, "generations": 5}
    run.begin(yaml.safe_dump(SETTINGS), {**head, "status": status, "process": 12345})
    return run


def test_a_new_directory_is_claimed_and_a_finished_run_is_found(tmp_path: Path) -> None:
    run = started(tmp_path / "ant" / "neat-s0-abcdef", "done")
    assert claim(run, "hash") is Claim.FINISHED
    assert claim(run, "hash", resume=True) is Claim.FINISHED
    assert [found.path for found in find_runs(tmp_path)] == [run.path]


@pytest.mark.parametrize("status", ["running", "failed", "interrupted"])
def test_an_unfinished_run_is_refused_naming_resume(tmp_path: Path, status: str) -> None:
    run = started(tmp_path / "ant" / "run", status)
    with pytest.raises(ExneatError, match=f"{status}.*\n.*resume=true"):
        claim(run, "hash")
    assert claim(run, "hash", resume=True) is Claim.CONTINUE


@pytest.mark.parametrize("status", ["done", "running"])
def test_a_run_may_be_made_longer_by_resume_and_never_shorter(tmp_path: Path, status: str) -> None:
    run = started(tmp_path / "run", status)
    with pytest.raises(ExneatError, match=r"resume=true"):
        claim(run, "hash", generations=6)
    assert claim(run, "hash", resume=True, generations=6) is Claim.CONTINUE
    if status == "done":
        with pytest.raises(ExneatError, match=r"holds a finished run of 5 generations\n.*resume=true"):
            claim(run, "hash", resume=True, lengthen=False, generations=6)
    with pytest.raises(ExneatError, match="holds a run of 5 generations, and 4 are asked for"):
        claim(run, "hash", resume=True, generations=4)


def test_a_run_of_another_format_is_refused_by_its_number(tmp_path: Path) -> None:
    run = started(tmp_path / "run", "done")
    run.update_manifest(format=1)
    with pytest.raises(ExneatError, match=f"holds a run of format 1, expected {MANIFEST_FORMAT}"):
        claim(run, "hash", resume=True)


@pytest.mark.parametrize("resume", [True, False])
def test_somebody_elses_directory_is_never_claimed(tmp_path: Path, resume: bool) -> None:
    notes = RunDirectory(tmp_path / "notes")
    notes.path.mkdir()
    (notes.path / "thoughts.txt").write_text("mine")
    with pytest.raises(ExneatError, match=r"without manifest\.json"):
        claim(notes, "hash", resume=resume)
    other = started(tmp_path / "other", "done", "another hash")
    asked = {"task": {"name": "ant", "patience": 7}}
    with pytest.raises(ExneatError, match=r"holds another run: task\.patience is 100 there, 7 here"):
        claim(other, "hash", resume=resume, **asked)


@pytest.mark.parametrize("resume", [True, False])
def test_what_a_run_left_that_was_killed_before_its_manifest_is_taken_up(tmp_path: Path, resume: bool) -> None:
    begun = RunDirectory(tmp_path / "begun")
    begun.path.mkdir()
    assert claim(begun, "hash", resume=resume) is Claim.BEGIN
    (begun.path / ".manifest.json.7.tmp").write_text("half")
    assert claim(begun, "hash", resume=resume) is Claim.BEGIN


def test_what_was_being_written_at_a_kill_is_gone_after_the_next_claim_and_what_others_write_is_not(
    tmp_path: Path,
) -> None:
    dead = subprocess.run([sys.executable, "-c", "import os; print(os.getpid())"], capture_output=True, check=True)
    run = started(tmp_path / "run", "running")
    run.plots.mkdir()
    orphans = [folder / f".x.csv.{int(dead.stdout)}.tmp" for folder in (run.path, run.plots)]
    others = [run.plots / f".x.svg.{os.getppid()}.tmp", run.path / ".of-somebody-else.tmp"]
    for path in (*orphans, *others):
        path.write_text("half")
    claim(run, "hash", resume=True)
    assert not any(path.exists() for path in orphans)
    assert all(path.exists() for path in others)


def test_a_second_writer_is_refused_while_the_first_one_lives(tmp_path: Path) -> None:
    run = started(tmp_path / "run", "running")
    assert not is_held(run.path)
    refused = pytest.raises(ExneatError, match=rf"another process .* \(process id {os.getpid()}\)")
    with run.claimed("hash", SETTINGS, resume=True, lengthen=True), refused:
        assert is_held(run.path)
        claim(run, "hash", resume=True)
    assert claim(run, "hash", resume=True) is Claim.CONTINUE


@pytest.mark.parametrize("failing", [1, 2])
def test_a_start_that_cannot_be_written_leaves_no_directory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, failing: int
) -> None:
    run = RunDirectory(tmp_path / "run")
    claim(run, "hash")
    calls = itertools.count(1)

    def full_disk(descriptor: int) -> None:
        if next(calls) == failing:
            raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full_disk)
    with pytest.raises(ExneatError, match="No space left"):
        run.begin("seed: 0\n", {})
    assert not run.path.exists()


def test_beginning_again_forgets_what_the_last_try_left_in_the_manifest(tmp_path: Path) -> None:
    run = started(tmp_path / "run", "failed")
    run.update_manifest(error="boom")
    run.begin("seed: 0\n", {"status": "running"})
    assert run.read_manifest() == {"status": "running"}


def test_the_hash_does_not_depend_on_how_a_number_was_typed() -> None:
    assert configuration_hash({"a": {"b": [0, 1.0]}}) == configuration_hash({"a": {"b": [0.0, 1]}})
    assert configuration_hash({"a": 0.5}) != configuration_hash({"a": 0})
    assert configuration_hash({"a": True}) != configuration_hash({"a": 1})


@pytest.mark.parametrize(
    "content",
    [
        {},
        {"format": 2},
        {"format": 1},
        {"format": 1, "variant": "x", "task": {}, "actuators": [], "plan": {"modules": [1]}},
    ],
)
def test_a_damaged_champion_is_refused_by_name(tmp_path: Path, content: dict[str, object]) -> None:
    path = tmp_path / "champion.json"
    path.write_text(json.dumps(content))
    with pytest.raises(ExneatError, match=r"champion\.json: (expected|damaged)"):
        read_champion(path)
