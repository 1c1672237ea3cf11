"""`exneat search`: trials that are all there after a kill, as without one, and a best one that its command repeats."""

from __future__ import annotations

import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from exneat_cli.main import main
from exneat_cli.records import find_runs

pytestmark = pytest.mark.usefixtures("no_figures")
ROOT = Path(__file__).parents[2]
TINY = ["task=general_maze", "budget=smoke", "generations=1", "population=6", "seed=100", "executor=serial"]
SPACE = """
settings: {algorithm: exneat, geometry: single}
space:
  evolution.weight_mutate_power: {low: 0.01, high: 3.0, log: true}
  evolution.elitism: {low: 1, high: 4}
  evolution.crossover: [choose, average]
"""


def best_of(output: str) -> tuple[str, list[str]]:
    lines = output.strip().splitlines()
    return lines[-3].partition("/")[0], shlex.split(lines[-1])


def test_a_search_that_was_killed_ends_as_one_that_was_not_and_its_command_repeats_the_best(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("optuna", reason="optuna is not installed here")
    space = tmp_path / "mine.yaml"
    space.write_text(SPACE)
    search = ["search", f"space={space}", "trials=6", *TINY]
    assert main([*search, f"output={tmp_path / 'whole'}"]) == 0
    whole = capsys.readouterr().out
    command = [sys.executable, "-c", "import exneat_cli.main as m; m.program()", *search, f"output={tmp_path / 'cut'}"]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        began = [process.stdout.readline() for _ in range(3)]
        time.sleep(0.05)
        process.send_signal(signal.SIGKILL)
    assert began[2].startswith("[3/6] validation")
    assert main([*search, f"output={tmp_path / 'cut'}"]) == 0
    rest = capsys.readouterr().out
    shown = [line for line in (*began, *rest.splitlines(keepends=True)) if line.startswith("[")]
    assert "".join(dict.fromkeys(shown)) == "".join(line for line in whole.splitlines(keepends=True) if line[0] == "[")
    assert len(find_runs(tmp_path / "cut")) == len(find_runs(tmp_path / "whole"))

    (best, train), (same, _) = best_of(whole), best_of(rest)
    assert best == same
    assert main([*train[1:], f"output={tmp_path / 'again'}"]) == 0
    (run,) = find_runs(tmp_path / "again")
    assert f"validation fitness {run.read_result().validation:.6g}," in best
    reached = [line.partition(":")[0].split()[-1] for line in whole.splitlines() if line.startswith("[")]
    equals = reached.count(f"{run.read_result().validation:.4g}")
    assert (f", the first of {equals} that reached it," in best) == (equals > 1)
    capsys.readouterr()
    assert main([*search, f"output={tmp_path / 'cut'}"]) == 0
    assert best_of(capsys.readouterr().out)[0] == best


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("space: {evolution.elitsm: [1, 2]}", "evolution.elitsm: unknown key"),
        ("space: {evolution.elitism: {low: 3, high: 1}}", "expected low <= high"),
        ("space: {evolution.elitism: {lo: 3, high: 1}}", "mine.yaml"),
        ("space: {evolution.elitism: []}", "expected at least one choice"),
        ("space: {}", "expected at least one setting to search"),
    ],
)
def test_a_space_that_makes_no_sense_is_refused_in_at_most_three_lines(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], content: str, message: str
) -> None:
    pytest.importorskip("optuna", reason="optuna is not installed here")
    (tmp_path / "mine.yaml").write_text(content)
    assert main(["search", f"space={tmp_path / 'mine.yaml'}", *TINY, f"output={tmp_path / 'out'}"]) == 2
    told = capsys.readouterr().err
    assert message in told
    assert len(told.strip().splitlines()) <= 3


def test_without_optuna_the_command_that_installs_it_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("exneat_cli.commands.search.find_spec", lambda name: None)
    assert main(["search", "space=mutation", *TINY, f"output={tmp_path / 'out'}"]) == 2
    assert "pip install 'exneat[search]'" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
