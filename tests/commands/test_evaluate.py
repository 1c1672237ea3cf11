"""`exneat evaluate` and `exneat train sweep=...`: robustness of finished runs."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import yaml

from exneat_cli.commands.command_line import read_command_line
from exneat_cli.commands.jobs import read_job
from exneat_cli.commands.shipped import shipped_directory
from exneat_cli.main import main
from exneat_cli.records import RobustnessRow, RunDirectory, read_robustness
from exneat_cli.rollouts import Noise, perturbed
from exneat_cli.tasks import TASKS
from tests.commands.figures import without_figures
from tests.commands.refusals import check_refusal

SWEEPS = sorted(path.stem for path in (shipped_directory("conf") / "sweep").glob("*.yaml") if path.stem != "none")


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    output = tmp_path_factory.mktemp("outputs")
    with without_figures():
        for algorithm in ("neat", "random", "motionless", "linear_fusion"):
            assert main(["train", "task=track_maze", "budget=smoke", f"algorithm={algorithm}", f"output={output}"]) == 0
    return output / "track_maze"


def rows_of(runs: Path, variant: str) -> list[RobustnessRow]:
    (directory,) = runs.glob(f"{variant}-*")
    return read_robustness(RunDirectory(directory).robustness)


def evaluate(*arguments: str) -> int:
    with without_figures():
        return main(["evaluate", "sweep.episodes=3", *arguments])


def test_every_run_of_a_pattern_is_tested_at_every_level(runs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert evaluate(f"run={runs}/*", "sweep=[sensor_noise,gap]") == 0
    for variant in ("neat", "random", "motionless", "linear_fusion"):
        rows = rows_of(runs, variant)
        assert [row.level for row in rows if row.parameter == "gap"] == [0, 1, 2, 3, 4, 5]
        assert len([row for row in rows if row.parameter == "sensor_noise"]) == 11
        assert {row.episodes for row in rows if row.parameter != "none"} == {3}
    before = {path: path.read_bytes() for path in runs.rglob("robustness.csv")}
    capsys.readouterr()
    assert evaluate(f"run={runs}/*", "sweep=[sensor_noise,gap]") == 0
    told = capsys.readouterr().out
    assert told.count("all levels were tested before") == 4
    for row in rows_of(runs, "neat"):
        assert re.search(rf"^ *{row.level:g}  +{row.fitness_mean:.4g}  +{row.fitness_std:.3g}$", told, re.MULTILINE)
    assert {path: path.read_bytes() for path in runs.rglob("robustness.csv")} == before


def test_other_levels_join_those_that_are_there(runs: Path) -> None:
    (neat,) = runs.glob("neat-*")
    assert evaluate(f"run={neat}", "sweep=maze_size", "sweep.levels=[9]") == 0
    assert evaluate(f"run={neat}", "sweep=maze_size", "sweep.levels=[7]") == 0
    assert [row.level for row in rows_of(runs, "neat") if row.parameter == "maze_size"] == [7, 9]


def test_rows_with_another_number_of_episodes_stand_beside_those_that_are_there(runs: Path) -> None:
    (neat,) = runs.glob("neat-*")
    for episodes in (2, 5):
        assert evaluate(f"run={neat}", "sweep=gap", "sweep.levels=[5]", f"sweep.episodes={episodes}") == 0
    assert {row.episodes for row in rows_of(runs, "neat") if (row.parameter, row.level) == ("gap", 5)} >= {2, 5}


def test_without_noise_fusion_is_perfect_and_standing_still_gets_a_quarter(runs: Path) -> None:
    assert evaluate(f"run={runs}/*", "sweep=sensor_noise", "sweep.levels=[0]") == 0
    clean = {
        variant: next(row for row in rows_of(runs, variant) if (row.parameter, row.level) == ("sensor_noise", 0.0))
        for variant in ("motionless", "linear_fusion")
    }
    assert clean["linear_fusion"].fitness_mean == 1.0
    assert clean["motionless"].fitness_mean == 0.25


def test_figures_that_a_tested_run_lacks_are_drawn(runs: Path) -> None:
    (rule,) = runs.glob("motionless-*")
    assert main(["evaluate", f"run={rule}", "sweep=gap", "sweep.levels=[1]", "sweep.episodes=1"]) == 0
    assert {path.name for path in (rule / "plots").glob("*.svg")} == {"path.svg", "robustness.svg"}


@pytest.mark.usefixtures("no_figures")
def test_training_with_a_sweep_ends_with_its_rows_and_another_sweep_does_not_train_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    common = ["train", "task=hunting", "budget=smoke", f"output={tmp_path}"]
    assert main([*common, "sweep=p_m", "sweep.levels=[0,1]"]) == 0
    assert [row.level for row in rows_of(tmp_path / "hunting", "exneat")] == [0, 1]
    capsys.readouterr()
    assert main([*common, "sweep=p_e", "sweep.levels=[0.5]"]) == 0
    assert "finished already" in capsys.readouterr().out
    assert len(rows_of(tmp_path / "hunting", "exneat")) == 3
    manifest = RunDirectory(next((tmp_path / "hunting").iterdir())).read_manifest()
    assert manifest.failed_robustness_episodes == {}


@pytest.mark.parametrize("sweep", SWEEPS)
def test_every_level_of_every_sweep_suits_the_tasks_that_it_names(sweep: str) -> None:
    entry = yaml.safe_load((shipped_directory("conf") / "sweep" / f"{sweep}.yaml").read_text())["sweeps"][sweep]
    assert entry["levels"]
    for task in ("gym" if name == "other" else name for name in entry["levels"]):
        (asked,) = read_job("", read_command_line("train", [f"task={task}", f"sweep={sweep}"])).sweeps
        for level in asked.levels:
            perturbed(TASKS[task](), Noise(), asked, level)


BAD = {
    "": "sweep: expected what to perturb",
    "sweep=wind": "sweep=wind: no such option; known:",
    "sweep=p_m": "sweep: expected a sweep that fits task=track_maze, got 'p_m'",
    "sweep=reset_noise": "sweep: expected a sweep that fits task=track_maze",
    "sweep=reset_noise sweep.levels=[0.2]": "no initial pose",
    "sweep=gap sweep.levels=[9]": "level 9 of sweep gap",
    "sweep=gap sweep.levels=[0.5]": "task.gap: expected a whole number",
    "sweep=sensor_noise sweep.levels=[-1]": "noise.sensor_std: expected",
    "sweep=sensor_noise sweep.levels=[]": "sweep.levels: expected at least one level",
    "sweep=sensor_noise sweep.levels=0.1": "sweep.levels: expected a list",
    "sweep=sensor_noise sweep.levels=[a]": "sweep.levels: expected finite numbers",
    "sweep=sensor_noise sweep.level=[1]": "sweep.level: unknown key (value [1])\n  did you mean sweep.levels?",
    "sweep=sensor_noise sweep.episodes=0": "sweep.episodes: expected",
    "sweep=sensor_noise seed=1": "seed: unknown key",
    "sweep=sensor_noise budget=smoke": "budget: expected nothing, since this command, or the chosen task,",
    "sweep=sensor_noise executor.workers=-1": "executor.workers: expected",
    "sweep=gap executor.foo=1": "executor.foo: unknown key",
}


@pytest.mark.parametrize("given", BAD)
def test_what_makes_no_sense_for_a_run_is_refused_and_leaves_no_row(
    given: str, runs: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (run,) = runs.glob("motionless-*")
    check_refusal(["evaluate", f"run={run}", *given.split()], [BAD[given]], runs, capfd)


def test_a_sweep_of_the_users_own_that_lacks_something_is_refused(
    runs: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (run,) = runs.glob("motionless-*")
    path = tmp_path / "sweep" / "wind.yaml"
    path.parent.mkdir()
    for entry, named in {
        "{parameter: task.gap, levels: {track_maze: [1]}}": "sweeps.wind.label: is missing",
        "{parameter: task.gap, label: gap, level: [1]}": "did you mean sweeps.wind.levels?",
        "{parameter: task.gap, label: gap, levels: [1]}": "sweeps.wind.levels: expected a section",
        "{parameter: task.wind, label: wind, levels: {track_maze: [1]}}": "it has no task.wind",
    }.items():
        path.write_text(f"# @package _global_\nsweeps: {{wind: {entry}}}\n")
        check_refusal(["evaluate", f"run={run}", "--config-dir", str(tmp_path), "sweep=wind"], [named], runs, capfd)
