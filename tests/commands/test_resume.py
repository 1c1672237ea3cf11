"""`exneat resume`: an interrupted run goes on without its settings being typed again."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest

from exneat_cli.main import main
from exneat_cli.records import RunDirectory, find_runs, read_robustness
from exneat_cli.runs import Progress

pytestmark = pytest.mark.usefixtures("no_figures")
SETTINGS = ("budget=smoke", "task=general_maze", "task.size=7", "evolution.conn_add_prob=0.4", "generations=3")
SWEEP = ("sweep=sensor_noise", "sweep.levels=[0,0.1]")


def test_the_last_line_of_an_interrupted_run_goes_on_to_the_same_bytes_wherever_the_run_lies(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    undisturbed, parts = tmp_path / "whole", tmp_path / "two parts, [v1]"
    assert main(["train", *SETTINGS, *SWEEP, f"output={undisturbed}"]) == 0
    with monkeypatch.context() as patch:
        patch.setattr(Progress, "generation", interrupt)
        assert main(["train", *SETTINGS, *SWEEP, f"output='{parts}'"]) == 130
    command = shlex.split(capsys.readouterr().err.splitlines()[-1])
    assert command[:2] == ["exneat", "resume"]
    assert not [word for word in command if word.startswith(("task", "evolution", "generations"))]
    assert main(command[1:]) == 0
    (one,), (other,) = find_runs(undisturbed), find_runs(parts)
    assert one.champion.read_bytes() == other.champion.read_bytes()
    assert read_robustness(one.robustness) == read_robustness(other.robustness) != []
    moved = RunDirectory(other.path.rename(tmp_path / other.path.name))
    assert main(["resume", f"run={moved.path}", "generations=4"]) == 0
    assert moved.read_manifest().generations == 4


def test_a_run_that_is_not_there_and_a_task_that_is_not_named_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["resume", f"run={tmp_path}"]) == 2
    assert "there is no such run" in capsys.readouterr().err
    assert main(["resume"]) == 2
    assert "run: expected a run directory" in capsys.readouterr().err
