"""`exneat sweep`: experiments as data, jobs that stand alone, and a summary that tells the truth."""

from __future__ import annotations

import contextlib
import datetime
import io
import json
import re
import shutil
from pathlib import Path

import pytest
import yaml

from exneat_cli.commands.command_line import read_command_line
from exneat_cli.commands.jobs import Job
from exneat_cli.commands.shipped import shipped_files
from exneat_cli.commands.sweep import plan_jobs, read_experiment
from exneat_cli.errors import ExneatError
from exneat_cli.main import main
from exneat_cli.records import RunDirectory, read_robustness
from exneat_cli.runs import RunSettings
from tests.commands.refusals import check_refusal, contents

SMALL = {
    "claim": "Modules beat one network.",
    "settings": {"task": "track_maze"},
    "variants": {
        "neat": {"label": "NEAT", "settings": {"algorithm": "neat"}},
        "exneat": {"label": "ExNEAT", "settings": {"geometry": "custom", "geometry.vector": [0, 0, 1, 1]}},
    },
    "conditions": {
        "gap_1": {"label": "gap of 1", "settings": {"task.gap": 1}, "sweeps": ["gap"]},
        "clean": {"label": "clean", "settings": {}, "sweeps": None},
    },
    "runs": {"smoke": 1, "quick": 2},
}


def write(folder: Path, **changes: object) -> Path:
    path = folder / "small.yaml"
    path.write_text(yaml.safe_dump({**SMALL, **changes}))
    return path


def sweep(folder: Path, *arguments: str) -> int:
    path = folder / "small.yaml"
    return main(["sweep", f"experiment={path}", "budget=smoke", f"output={folder / 'out'}", *arguments])


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """A folder in which all jobs are trained, tested and drawn, and what was printed meanwhile."""
    folder, printed = tmp_path_factory.mktemp("swept"), io.StringIO()
    write(folder)
    with contextlib.redirect_stdout(printed):
        assert sweep(folder) == 0
    return folder, printed.getvalue()


@pytest.fixture
def finished(swept: tuple[Path, str], tmp_path: Path) -> Path:
    """A copy of that folder."""
    return Path(shutil.copytree(swept[0], tmp_path, dirs_exist_ok=True))


def plan(folder: Path, *settings: str, name: str = "", budget: str = "smoke") -> list[Job]:
    line = read_command_line("sweep", [f"output={folder / 'out'}", *settings])
    return plan_jobs(read_experiment(name or str(folder / "small.yaml")), budget, line, ("experiment", "publish"))


def test_all_jobs_are_trained_tested_and_drawn_and_a_second_call_changes_nothing(
    swept: tuple[Path, str], capsys: pytest.CaptureFixture[str]
) -> None:
    folder, printed = swept
    assert "4 runs done, 0 skipped (already finished), 0 failed" in printed
    folders = sorted(path.name for path in (folder / "out").iterdir())
    assert folders == ["small-clean-smoke", "small-gap_1-smoke"]
    for run in (folder / "out").glob("*/*"):
        levels = [row.level for row in read_robustness(RunDirectory(run).robustness)]
        assert levels == ([0, 1, 2, 3, 4, 5] if "gap_1" in str(run) else [])
        drawn = {"training", "path", "network", *(["robustness"] if levels else [])}
        assert {path.stem for path in (run / "plots").glob("*.svg")} == drawn
    before = contents(folder / "out")
    assert sweep(folder) == 0
    assert "0 runs done, 4 skipped (already finished), 0 failed" in capsys.readouterr().out
    assert contents(folder / "out") == before


@pytest.mark.usefixtures("no_figures")
def test_a_job_that_fails_leaves_the_others_alone_and_is_named_at_the_end(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write(tmp_path)
    jobs = plan(tmp_path)
    spoilt = jobs[1].settings.directory.path
    spoilt.parent.mkdir(parents=True)
    spoilt.write_text("in the way")
    assert sweep(tmp_path) == 1
    shown = capsys.readouterr()
    assert "3 runs done, 0 skipped (already finished), 1 failed" in shown.out
    assert shown.err.splitlines()[-2].startswith(f"  {jobs[1].name}: {spoilt}: expected a directory, got a file")
    assert [job.is_finished() for job in jobs] == [True, False, True, True]
    spoilt.unlink()
    assert sweep(tmp_path) == 0
    assert "1 runs done, 3 skipped (already finished), 0 failed" in capsys.readouterr().out


def test_a_run_that_was_trained_but_not_tested_is_finished_without_training_again(finished: Path) -> None:
    (run,) = (finished / "out").glob("small-gap_1-smoke/neat-*")
    rows = (run / "robustness.csv").read_bytes()
    history = (run / "history.csv").stat().st_mtime_ns
    (run / "robustness.csv").unlink()
    assert sweep(finished) == 0
    assert (run / "robustness.csv").read_bytes() == rows
    assert (run / "history.csv").stat().st_mtime_ns == history


def test_the_users_own_settings_win_over_the_experiments(tmp_path: Path) -> None:
    write(tmp_path)
    jobs = plan(tmp_path, "generations=3", "task.gap=2", "seed=7", budget="quick")
    assert {job.settings.generations for job in jobs} == {3}
    assert {job.settings.task.gap for job in jobs} == {2}  # type: ignore[attr-defined]
    assert sorted({job.settings.seed for job in jobs}) == [7, 8]


@pytest.mark.parametrize("name", shipped_files("experiments"))
def test_no_two_jobs_of_an_experiment_share_a_directory(name: str, tmp_path: Path) -> None:
    jobs = plan(tmp_path, name=name, budget="paper")  # smaller budgets have the same jobs, with fewer seeds
    assert len({job.settings.directory.path for job in jobs}) == len(jobs) == len({job.name for job in jobs})


def test_experiments_have_ten_runs_on_paper_and_three_when_quick() -> None:
    for name in shipped_files("experiments"):
        assert read_experiment(name).runs == {"paper": 10, "quick": 3, "smoke": 1}


def test_sections_within_sections_mean_the_same_as_dotted_names(tmp_path: Path) -> None:
    def planned(**settings: object) -> list[RunSettings]:
        write(tmp_path, settings={"task": "hunting"}, conditions={"calm": {"label": "calm", "settings": settings}})
        return [job.settings for job in plan(tmp_path)]

    dotted = planned(**{"task.p_m": 0.1, "task.p_e": 0.2, "noise.sensor_std": 0.1})
    assert planned(task={"p_m": 0.1, "p_e": 0.2}, noise={"sensor_std": 0.1}) == dotted


def test_words_with_special_characters_arrive_as_they_are_written(tmp_path: Path) -> None:
    one = {"label": "NEAT", "settings": {"evolution.activation_default": "a [b], 'c' ~{d}"}}
    write(tmp_path, variants={"one": one})
    with pytest.raises(ExneatError, match=re.escape("""got "a [b], 'c' ~{d}\"""")):
        plan(tmp_path)


def test_damage_in_one_run_leaves_the_others_finished_and_is_named(
    finished: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (manifest,) = (finished / "out").glob("small-gap_1-smoke/neat-*/manifest.json")
    manifest.write_text("{")
    assert sweep(finished) == 1
    shown = capsys.readouterr()
    assert "0 runs done, 3 skipped (already finished), 1 failed" in shown.out
    assert "gap_1/neat/0" in shown.err
    assert "expected JSON" in shown.err


def test_figures_that_are_missing_are_drawn_by_the_next_call(finished: Path) -> None:
    (picture,) = (finished / "out").glob("small-gap_1-smoke/neat-*/plots/network.svg")
    before = picture.read_bytes()
    picture.unlink()
    assert sweep(finished) == 0
    assert picture.read_bytes() == before


def test_side_by_side_a_failure_is_named_with_its_reason(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("hydra_plugins.hydra_joblib_launcher")
    write(tmp_path, conditions={"clean": {"label": "clean"}})
    jobs = plan(tmp_path)
    spoilt = jobs[1].settings.directory.path
    spoilt.parent.mkdir(parents=True)
    spoilt.write_text("in the way")
    assert sweep(tmp_path, "hydra/launcher=joblib", "hydra.launcher.n_jobs=2", "executor=serial") == 1
    shown = capsys.readouterr()
    assert "1 runs done, 0 skipped (already finished), 1 failed" in shown.out
    assert f"  {jobs[1].name}: {spoilt}: expected a directory, got a file" in shown.err


def variant(**entries: object) -> dict[str, object]:
    return {"variants": {"neat": {"label": "NEAT", "settings": {}, **entries}}}


def condition(**entries: object) -> dict[str, object]:
    return {"conditions": {"a": {"label": "a", "settings": {}, **entries}}}


NONSENSE = [
    ({"variants": {}}, "variants: expected at least one entry"),
    ({"conditions": {}}, "conditions: expected at least one entry"),
    ({"variants": ["neat"]}, "variants: expected a section with keys of its own, got ['neat']"),
    ({"variants": {"neat": {"settings": {}}}}, "variants.neat.label: is missing"),
    ({"variants": {"neat": "NEAT"}}, "variants.neat: expected a section"),
    (variant(settings=[1]), "variants.neat.settings: expected a section"),
    (variant(label=[1]), "variants.neat.label: expected text, got [1]"),
    (variant(against="neta"), "variants.neat.against: expected one of"),
    (variant(swept="no"), "variants.neat.swept: expected true or false, got 'no'"),
    (variant(setings={}), "did you mean variants.neat.settings?"),
    ({"variants": {"a/b": {"label": "NEAT", "settings": {}}}}, "name: expected at most 40 letters"),
    (variant(settings={"seed": 3}), "variants.neat.settings.seed: expected another setting"),
    (variant(settings={"++seed": 3}), "variants.neat.settings.++seed: expected another"),
    ({"settings": {"output": "elsewhere"}}, "settings.output: expected another setting"),
    ({"settings": {"sweep": {"levels": [1]}}}, "settings.sweep.levels: expected another setting"),
    ({"settings": {"hydra.job.name": "x"}}, "settings.hydra.job.name: expected another setting"),
    (variant(settings={"algorithm": {"name": "nead"}}), "algorithm: expected one of"),
    (variant(runs=0), "variants.neat.runs: expected"),
    (variant(runs=True), "variants.neat.runs: expected"),
    (variant(settings={"algorithm": "nead"}), "algorithm=nead: no such option"),
    (variant(settings={"sed": 3}), "small, clean, neat: sed: unknown key (value 3)\n  did you mean seed?"),
    ({"variants": {k: {"label": k, "settings": {}} for k in "ab"}}, "clean/a/0 and clean/b/0 are the same run"),
    (condition(settings={"task.gap": 99}), "small, a, exneat: task.gap: expected"),
    (condition(settings={"task.gap": datetime.date(2020, 1, 1)}), "task.gap: expected"),
    (condition(sweeps="gap"), "conditions.a.sweeps: expected a list of sweep names, got 'gap'"),
    (condition(sweeps=[1]), "conditions.a.sweeps: expected a list of sweep names"),
    (condition(sweeps=["p_m"]), "fits task=track_maze"),
    (condition(sweeps=["wind"]), "sweep=wind: no such option"),
    ({"runs": {}}, "runs: expected at least one entry"),
    ({"runs": {"smoke": 0}}, "runs.smoke: expected"),
    ({"runs": {"quick": 1}}, "budget: expected one that small has runs for, quick, got 'smoke'"),
    ({"runs": {"large": 1}}, "runs: expected one of paper, quick, smoke, got 'large'"),
    ({"claim": 3}, "claim: expected text, got 3"),
    ({"claims": "two"}, "claims: unknown key (value 'two')\n  did you mean claim?"),
    ({"name": "mine"}, "name: unknown key"),
]


@pytest.mark.parametrize(("changes", "named"), NONSENSE, ids=[named for _, named in NONSENSE])
def test_an_experiment_that_makes_no_sense_is_refused_before_anything_runs(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], changes: dict[str, object], named: str
) -> None:
    path = write(tmp_path, **changes)
    check_refusal(["sweep", f"experiment={path}", "budget=smoke", "output=out"], [named], tmp_path, capfd)


def test_a_run_of_the_plan_that_is_still_going_is_not_counted_as_finished(finished: Path) -> None:
    job = plan(finished)[0]
    assert job.is_finished()
    manifest = job.settings.directory.manifest
    manifest.write_text(json.dumps({**json.loads(manifest.read_text()), "status": "running"}))
    assert not job.is_finished()


@pytest.mark.usefixtures("no_figures")
def test_settings_may_be_left_out_and_a_report_names_the_experiment_that_there_are_runs_of(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("exneat_cli.commands.report.read_published", lambda path: [])
    path = tmp_path / "small.yaml"
    random = {"label": "random", "settings": {"task": "general_maze", "algorithm": "random"}}
    parts = {"conditions": {"clean": {"label": "clean"}}, "claim": "None.", "runs": {"smoke": 1}}
    path.write_text(yaml.safe_dump({**parts, "variants": {"random": random, "plain": {"label": "as it comes"}}}))
    assert [job.settings.task.name for job in plan(tmp_path)] == ["ant", "general_maze"]
    path.write_text(yaml.safe_dump({**parts, "variants": {"random": random}}))
    assert sweep(tmp_path) == 0
    capsys.readouterr()
    assert main(["report", f"output={tmp_path / 'out'}"]) == 2
    assert f"exneat report experiment={path} output={tmp_path / 'out'}" in capsys.readouterr().err
    alone = f"output={tmp_path / 'alone'}"
    assert main(["train", "task=general_maze", "algorithm=random", "budget=smoke", alone]) == 0
    capsys.readouterr()
    assert main(["report", "experiment=ant", alone]) == 2
    assert capsys.readouterr().err.splitlines()[1:] == [
        f"  there are runs outside of experiments, which exneat inspect {alone} compares; to run an experiment:",
        f"  exneat sweep experiment=ant budget=quick {alone}",
    ]
    folder = tmp_path / "alone" / f"ant-{next(iter(read_experiment('ant').conditions))}-quick"
    folder.symlink_to(folder)
    assert main(["report", "experiment=ant", alone]) == 2
    assert capsys.readouterr().err == f"exneat: {folder}: cannot be read: Too many levels of symbolic links\n"


@pytest.mark.parametrize("label", ["", " ", "NEAT", " NEAT "])
def test_labels_that_nobody_could_tell_apart_are_refused(tmp_path: Path, label: str) -> None:
    neat, exneat = SMALL["variants"].values()  # type: ignore[attr-defined]
    write(tmp_path, variants={"neat": neat, "exneat": {**exneat, "label": label}})
    with pytest.raises(ExneatError, match=r"small\.yaml: variants\.\w+\.label: expected "):
        read_experiment(str(tmp_path / "small.yaml"))
