"""What users get wrong: at most three lines, exit code 2, no traceback, nothing half-made."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from exneat_cli.main import main

LONGEST = 3


def overrides(output: Path) -> list[str]:
    return ["budget=smoke", f"output={output}"]


CASES = [
    # what is given, and what the message must name
    (["sed=3"], "sed: unknown key"),
    (["+sed=3"], "did you mean seed?"),
    (["+task.foo=1"], "task.foo: unknown key"),
    (["task.max_step=5"], "task.max_step: unknown key"),
    (["+evolution.elitsm=1"], "did you mean evolution.elitism?"),
    (["executor=serial", "executor.workers=2"], "executor.workers: unknown key"),
    (["seed=-1"], "seed: expected a whole number from 0 to 18446744073709551615, got -1"),
    (["seed=abc"], "seed: expected"),
    (["seed=1.5"], "seed: expected"),
    (["seed=true"], "seed: expected"),
    (["seed=null"], "seed: expected"),
    (["seed=1,2"], "--multirun"),
    (["generations=0"], "generations: expected"),
    (["generations=many"], "generations: expected"),
    (["population=1"], "population: expected"),
    (["episodes=-3"], "episodes: expected"),
    (["noise.sensor_std=nan"], "noise.sensor_std: expected"),
    (["noise.sensor_std=-0.1"], "noise.sensor_std: expected"),
    (["noise.sensor_std=inf"], "noise.sensor_std: expected"),
    (["noise.reset_scale=[1]"], "noise.reset_scale: expected"),
    (["task.patience=-1"], "task.patience: expected"),
    (["task.max_steps=null"], "task.max_steps: expected"),
    (["task.reward=full"], "task.reward: expected one of thesis, gymnasium, got 'full'"),
    (["task.part_order=random"], "task.part_order: expected"),
    (["evolution.activation_default=swish"], "evolution.activation_default: expected"),
    (["evolution.survival_threshold=2"], "evolution.survival_threshold: expected"),
    (["pairing=best"], "pairing: expected"),
    (["task.patience=99999999999999999999"], "task.patience: expected"),
    (["seed=" + "9" * 300], "seed: expected"),
    (["+budgets.quik.generations=3"], "budgets.quik: expected one of paper, quick, smoke"),
    (["+budgets.smoke.generation=3"], "budgets.smoke.generation: expected one of"),
    (["task=atn"], "task=atn: no such option; known: ant, foraging, general_maze, hunting, track_maze"),
    (["geometry=triangle"], "geometry=triangle: no such option; known: all, cross, custom, fb, lr, single"),
    (["task=null"], "Config group override"),
    (["~task"], "~task: a setting cannot be deleted"),
    (["geometry=custom"], "geometry.vector: expected"),
    (["geometry=custom", "geometry.vector=[0,2]"], "without gaps"),
    (["geometry=custom", "geometry.vector=[0,1]"], "4 entries"),
    (["geometry=custom", "geometry.vector=abc"], "geometry.vector: expected"),
    (["geometry=all", "geometry.vector=[0,0,1,1]"], "geometry=custom"),
    (["algorithm=neat", "geometry=all"], "algorithm=neat has no part modules"),
    (["algorithm=random", "linkage=output"], "algorithm=random has no part modules"),
    (["linkage=feedback", "wiring.central=false"], "wiring.central=true"),
    (["linkage=hidden", "evolution.module_hidden=0"], "evolution.module_hidden"),
    (["task=track_maze", "task.size=12"], "task.size: expected an odd number"),
    (["task=track_maze", "task.size=3"], "task.size: expected a whole number from 5 to 99"),
    (["task=track_maze", "task.size=big"], "task.size: expected"),
    (["task=track_maze", "task.gap=6"], "task.gap: expected a whole number from 0 to 5, got 6"),
    (["task=track_maze", "task.cue_noise=-1"], "task.cue_noise: expected"),
    (["task=track_maze", "task.fitness=speed"], "task.fitness: expected one of time_and_progress, time"),
    (["task=track_maze", "task.patience=3"], "task.patience: unknown key"),
    (["task=track_maze", "wiring.central=true"], "task=track_maze has no trunk"),
    (["task=track_maze", "geometry=fb"], "geometry: expected single, all or custom"),
    (["task=track_maze", "linkage=hidden"], "evolution.module_hidden"),
    (["task=track_maze", "linkage=feedback"], "has no trunk for one"),
    (["task=track_maze", "noise.reset_scale=0.3"], "has no initial pose"),
    (["task=general_maze", "task.size=10"], "task.size: expected an odd number"),
    (["task=general_maze", "task.cues_removed=1.1"], "task.cues_removed: expected a number from 0 to 1"),
    (["task=general_maze", "task.walls_removed=-0.2"], "task.walls_removed: expected a number from 0 to 1"),
    (["task=general_maze", "task.gap=1"], "task.gap: unknown key"),
    (["task=foraging", "task.n_prey=100"], "task.n_prey: expected a whole number from 1 to 99, got 100"),
    (["task=foraging", "task.n_prey=0"], "task.n_prey: expected"),
    (["task=foraging", "task.steps=0"], "task.steps: expected"),
    (["task=foraging", "task.steps=23302"], "task.steps: expected at most 23301 for this size and n_prey, got 23302"),
    (["task=foraging", "task.size=99", "task.n_prey=100"], "task.steps: expected at most 32 for this size and n_prey"),
    (
        ["task=hunting", "task.steps=1000000"],
        "task.steps: expected at most 11650 for this size and n_prey, got 1000000",
    ),
    (
        ["task=hunting", "task.size=99", "task.n_prey=9800"],
        "task.n_prey: expected at most 1644 for this size, got 9800",
    ),
    (["task=foraging", "task.p_e=1.5"], "task.p_e: expected"),
    (["task=foraging", "task.p_c=nan"], "task.p_c: expected"),
    (["task=foraging", "task.p_m=0.5"], "task.p_m: unknown key"),
    (["task=foraging", "task.patch_width=4"], "task.patch_width: expected an odd number"),
    (["task=foraging", "task.size=2"], "task.size: expected"),
    (["task=hunting", "task.p_m=-0.5"], "task.p_m: expected"),
    (["task=hunting", "task.motion=random"], "task.motion: expected one of levy, brownian"),
    (["algorithm=linear_fusion"], "only grid worlds have it"),
    (["wiring.central=maybe"], "wiring.central: expected true or false"),
    (["wiring.central=false", "wiring.output_width=3"], "wiring.output_width: expected"),
    (["wiring=3"], "wiring: expected a section"),
    (["name=../../x"], "name: expected one folder name"),
    (["name=/etc"], "name: expected one folder name"),
    (["name="], "name: expected one folder name"),
    (["seed"], "missing EQUAL"),
    (["seed=[1,2"], "no viable alternative"),
    (["--bogus"], "--bogus: unknown flag"),
    (["--config-dir"], "expected a value after it"),
    (["--config-dir", "nowhere-at-all"], "nowhere-at-all"),
    (["--cfg", "everything"], "--cfg: expected one of job, hydra, all"),
]


def assert_refused(code: int, message: str, named: str) -> None:
    assert code == 2, message
    assert named in message
    assert "Traceback" not in message
    assert 1 <= len(message.strip().splitlines()) <= LONGEST, message


@pytest.mark.parametrize(("given", "named"), CASES, ids=[" ".join(given)[:60] for given, _ in CASES])
def test_bad_settings_are_refused_before_anything_is_made(
    given: list[str], named: str, tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    code = main(["train", *overrides(tmp_path / "out"), *given])
    captured = capfd.readouterr()
    assert_refused(code, captured.err, named)
    assert not captured.out
    assert not list(tmp_path.iterdir())


def test_an_output_that_is_a_file_is_refused(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").touch()
    code = main(["train", *overrides(tmp_path / "file")])
    assert_refused(code, capfd.readouterr().err, "the directory cannot be made")


@pytest.mark.skipif(os.name != "posix" or os.getuid() != 0, reason="permissions bind everyone but root")
def test_an_output_on_a_file_system_that_cannot_be_written_is_refused(capfd: pytest.CaptureFixture[str]) -> None:
    code = main(["train", *overrides(Path("/proc/exneat"))])
    assert_refused(code, capfd.readouterr().err, "/proc/exneat")


def test_an_output_with_an_overlong_name_is_refused(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    long = tmp_path / ("x" * 300)
    assert_refused(main(["train", *overrides(long)]), capfd.readouterr().err, "File name too long")
    assert_refused(main(["inspect", f"run={long}"]), capfd.readouterr().err, "no run is there")
    assert main(["inspect", f"output={long}"]) in (0, 2)
    assert "Traceback" not in capfd.readouterr().err


def test_a_directory_that_cannot_be_written_is_refused(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    if os.getuid() == 0:
        pytest.skip("root may write everywhere")
    tmp_path.chmod(0o500)
    code = main(["train", *overrides(tmp_path / "out")])
    assert_refused(code, capfd.readouterr().err, "Permission denied")


def test_a_directory_that_holds_something_else_is_refused(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert main(["train", *overrides(tmp_path), "algorithm=random"]) == 0
    (run,) = (tmp_path / "ant").iterdir()
    capfd.readouterr()
    (run / "manifest.json").unlink()
    assert_refused(main(["train", *overrides(tmp_path), "algorithm=random"]), capfd.readouterr().err, "manifest.json")
    (run / "manifest.json").write_text("{")
    assert_refused(main(["train", *overrides(tmp_path), "algorithm=random"]), capfd.readouterr().err, "manifest.json")


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["fly"], "fly: expected a command"),
        (["inspect", "run=nowhere"], "no run is there"),
        (["inspect", "somewhere"], "expected run="),
        (["inspect", "run="], "expected run="),
        (["doctor", "output="], "expected output="),
        (["doctor", "run=outputs"], "expected output="),
        (["doctor", "quickly"], "quickly: expected output="),
    ],
)
def test_bad_commands_are_refused(arguments: list[str], named: str, capfd: pytest.CaptureFixture[str]) -> None:
    assert_refused(main(arguments), capfd.readouterr().err, named)


def test_a_bad_job_of_a_multirun_leaves_the_others_alone(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    code = main(["train", "-m", *overrides(tmp_path), "algorithm=random", "seed=0,-1,2"])
    error = capfd.readouterr().err
    assert code == 2
    assert "seed=-1: seed: expected a whole number" in error
    assert "Traceback" not in error
    assert sorted(path.name.rsplit("-", 1)[0] for path in (tmp_path / "ant").iterdir()) == ["random-s0", "random-s2"]
    assert [path.name for path in tmp_path.iterdir()] == ["ant"]


def test_the_same_holds_for_the_installed_program(tmp_path: Path) -> None:
    program = Path(sys.executable).parent / "exneat"
    done = subprocess.run(
        [program, "train", "seed=x", *overrides(tmp_path / "out")], capture_output=True, text=True, check=False
    )
    assert_refused(done.returncode, done.stderr, "seed: expected")
    assert not done.stdout
