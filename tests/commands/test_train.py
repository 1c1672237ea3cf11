"""`exneat train` and `exneat inspect` as users run them."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import yaml

from exneat_cli.commands.composition import configuration_directory
from exneat_cli.main import main
from exneat_cli.records import RunDirectory
from exneat_cli.runs import RunSettings
from exneat_cli.tasks import TASKS


def train(*arguments: str) -> int:
    return main(["train", "budget=smoke", "test_episodes=1", "validation_episodes=1", "task.max_steps=80", *arguments])


def the_run(output: Path) -> Path:
    (run,) = (output / "ant").iterdir()
    return run


def test_a_run_ends_with_its_files_and_one_sentence_and_a_second_one_repeats_it(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert train(f"output={tmp_path}", "geometry=all") == 0
    first = capfd.readouterr()
    run = the_run(tmp_path)
    for name in ("history.csv", "champion.json", "plots/training.png", "plots/training.svg", "manifest.json"):
        assert str(run / name) in first.out
        assert (run / name).stat().st_size > 0
    assert "generation 2/2" in first.err
    sentence = first.out.strip().splitlines()[-1]
    assert "for standing still and" in sentence
    assert train(f"output={tmp_path}", "geometry=all") == 0
    second = capfd.readouterr()
    assert "finished already" in second.out
    assert second.out.strip().splitlines()[-1] == sentence
    assert not second.err


def test_the_manifest_tells_where_the_run_came_from(tmp_path: Path) -> None:
    assert train(f"output={tmp_path}", "algorithm=neat", "seed=5") == 0
    manifest = json.loads((the_run(tmp_path) / "manifest.json").read_text())
    assert manifest["status"] == "done"
    assert manifest["command"][:2] == ["exneat", "train"]
    assert "seed=5" in manifest["command"]
    assert manifest["budget_spent"]["episodes"] == 20
    assert {"python", "neat-python", "mujoco", "numba"} <= set(manifest["versions"])


@pytest.mark.parametrize("task", ["track_maze", "general_maze", "foraging", "hunting"])
@pytest.mark.parametrize("algorithm", ["exneat", "neat", "linear_fusion", "random"])
def test_every_grid_world_runs_with_every_algorithm_and_shows_the_agent_at_work(
    tmp_path: Path, task: str, algorithm: str
) -> None:
    assert main(["train", "budget=smoke", f"task={task}", f"algorithm={algorithm}", f"output={tmp_path}"]) == 0
    (run,) = (tmp_path / task).iterdir()
    assert {"tiles.csv", "trace.csv", "manifest.json"} <= {path.name for path in run.iterdir()}
    assert (run / "plots" / "path.svg").stat().st_size > 0


@pytest.mark.parametrize(
    "changes", [["geometry=all", "linkage=output"], ["geometry=custom", "geometry.vector=[0,0,1,1]"]]
)
def test_grid_worlds_take_other_geometries_and_output_links(tmp_path: Path, changes: list[str]) -> None:
    assert main(["train", "budget=smoke", "task=track_maze", f"output={tmp_path}", *changes]) == 0


def test_a_saved_configuration_trains_the_same_run_elsewhere(tmp_path: Path) -> None:
    assert train(f"output={tmp_path / 'a'}", "geometry=lr", "noise=sensor") == 0
    run = the_run(tmp_path / "a")
    again = ["train", "--config-path", os.path.relpath(run), f"output={tmp_path / 'b'}"]
    assert main(again) == 0
    assert (the_run(tmp_path / "b") / "champion.json").read_bytes() == (run / "champion.json").read_bytes()


def test_a_multirun_trains_every_combination(tmp_path: Path) -> None:
    assert train("-m", f"output={tmp_path}", "algorithm=random", "seed=0,1", "noise.sensor_std=0,0.1") == 0
    assert len(list((tmp_path / "ant").iterdir())) == 4


def test_a_repeated_multirun_goes_on_with_what_is_unfinished_and_leaves_the_rest(tmp_path: Path) -> None:
    arguments = ("-m", f"output={tmp_path}", "task=track_maze", "seed=0,1")
    quick = ("budget=smoke", "test_episodes=1", "validation_episodes=1")
    assert main(["train", *quick, *arguments]) == 0
    first, second = sorted((tmp_path / "track_maze").iterdir())
    champions = [(run / "champion.json").read_bytes() for run in (first, second)]
    untouched = (first / "manifest.json").stat().st_mtime_ns
    manifest = json.loads((second / "manifest.json").read_text())
    (second / "manifest.json").write_text(json.dumps({**manifest, "status": "running"}))
    (second / "champion.json").unlink()
    assert main(["train", *quick, *arguments]) == 0
    assert [(run / "champion.json").read_bytes() for run in (first, second)] == champions
    assert (first / "manifest.json").stat().st_mtime_ns == untouched
    assert len(json.loads((second / "manifest.json").read_text())["resumed"]) == 1


def test_a_multirun_never_makes_a_finished_run_longer_unasked(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    arguments = ("task=track_maze", "budget=smoke", "test_episodes=1", "validation_episodes=1", f"output={tmp_path}")
    assert main(["train", "-m", *arguments, "generations=1,2"]) == 2
    assert "holds a finished run of 1 generations" in capfd.readouterr().err
    (run,) = (tmp_path / "track_maze").iterdir()
    assert json.loads((run / "manifest.json").read_text())["generations"] == 1


def test_inspect_calls_a_run_killed_whose_process_is_gone(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert train(f"output={tmp_path}") == 0
    run = RunDirectory(the_run(tmp_path))
    run.update_manifest(status="running")
    capfd.readouterr()
    assert main(["inspect", f"output={tmp_path}"]) == 0
    assert capfd.readouterr().out.splitlines()[1].startswith("killed ")
    with run.held():
        assert main(["inspect", f"output={tmp_path}"]) == 0
    assert capfd.readouterr().out.splitlines()[1].startswith("running ")


def test_inspect_shows_sensors_joints_and_sizes_of_every_module(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert train(f"output={tmp_path}", "geometry=cross", "linkage=full") == 0
    capfd.readouterr()
    assert main(["inspect", f"run={the_run(tmp_path)}"]) == 0
    shown = capfd.readouterr().out
    assert "5 modules, 3 subpopulations, feed-forward" in shown
    assert "senses   5-6, 19-20, 33-50" in shown
    assert "hidden 0-3 of back_left, of the previous step" in shown
    assert "drives   hip_4, ankle_4, hip_1, ankle_1, hip_2, ankle_2, hip_3, ankle_3" in shown
    assert "48 inputs" in shown


def test_inspect_lists_the_runs_with_their_results(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert main(["inspect", f"output={tmp_path}"]) == 0
    assert "No runs below" in capfd.readouterr().out
    assert train(f"output={tmp_path}", "algorithm=random") == 0
    capfd.readouterr()
    assert main(["inspect", f"output={tmp_path}"]) == 0
    listed = capfd.readouterr().out.splitlines()
    assert listed[1].startswith("done")
    assert listed[1].endswith(str(the_run(tmp_path)))
    assert main(["inspect", f"run={the_run(tmp_path)}"]) == 2
    assert "a baseline has no networks" in capfd.readouterr().err


def test_a_figure_that_was_cut_short_is_drawn_the_next_time(tmp_path: Path) -> None:
    assert train(f"output={tmp_path}") == 0
    plots = the_run(tmp_path) / "plots"
    before = (plots / "training.svg").read_bytes()
    (plots / "training.svg").unlink()
    (plots / "training.png").unlink()
    assert train(f"output={tmp_path}") == 0
    assert (plots / "training.svg").read_bytes() == before


def test_a_damaged_run_does_not_hide_the_others_from_the_list(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert train("-m", f"output={tmp_path}", "algorithm=random", "seed=0,1,2") == 0
    manifests = sorted((tmp_path / "ant").glob("*/manifest.json"))
    manifests[0].write_text("{")
    manifests[1].write_text('{"status": "done", "seed": 1, "result": null}')
    capfd.readouterr()
    assert main(["inspect", f"output={tmp_path}"]) == 0
    states = [line.split()[0] for line in capfd.readouterr().out.splitlines()[1:]]
    assert states == ["damaged", "damaged", "done"]


@pytest.mark.parametrize("damage", ["genomes", "actuators", "scores", "plan"])
def test_a_champion_whose_parts_do_not_fit_is_refused(
    damage: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert train(f"output={tmp_path}", "geometry=all") == 0
    path = the_run(tmp_path) / "champion.json"
    champion = json.loads(path.read_text())
    if damage == "plan":
        champion["plan"]["modules"][0]["pins"][0]["index"] = 10**13
    else:
        champion[damage] = type(champion[damage])()
    path.write_text(json.dumps(champion))
    capfd.readouterr()
    assert main(["inspect", f"run={the_run(tmp_path)}"]) == 2
    assert "champion.json: damaged" in capfd.readouterr().err


def test_every_command_explains_itself(capfd: pytest.CaptureFixture[str]) -> None:
    assert main(["inspect", "--help"]) == 0
    assert capfd.readouterr().out.startswith("usage: exneat inspect")


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_ctrl_c_and_sigterm_mark_the_run_interrupted_and_say_how_to_go_on(
    tmp_path: Path, number: signal.Signals, code: int
) -> None:
    program = Path(sys.executable).parent / "exneat"
    process = subprocess.Popen(
        [program, "train", f"output={tmp_path}", "population=10", "generations=100000"],
        stderr=subprocess.PIPE,
        text=True,
    )
    deadline = time.monotonic() + 120
    while not list(tmp_path.glob("ant/*/history.csv")):
        assert process.poll() is None, process.stderr
        assert time.monotonic() < deadline
        time.sleep(0.1)
    process.send_signal(number)
    _, error = process.communicate(timeout=30)
    assert process.returncode == code
    assert error.strip().splitlines()[-1].startswith("exneat: interrupted")
    assert "Traceback" not in error
    assert json.loads((the_run(tmp_path) / "manifest.json").read_text())["status"] == "interrupted"


def composed(*arguments: str) -> RunSettings:
    done = subprocess.run(
        [Path(sys.executable).parent / "exneat", "train", "--cfg", "job", "--resolve", *arguments],
        capture_output=True,
        text=True,
        check=True,
    )
    plain = yaml.safe_load(done.stdout)
    for key in ("budget", "budgets", "sweep", "sweeps"):
        del plain[key]
    return RunSettings.from_plain(plain)


@pytest.mark.parametrize("task", sorted(TASKS))
def test_the_defaults_in_conf_are_those_of_the_dataclasses(task: str) -> None:
    from_files = composed(f"task={task}").to_plain()
    from_python = RunSettings(task=TASKS[task](), name=task).to_plain()
    budget = ("generations", "population", "episodes", "validation_episodes", "test_episodes")
    for plain in (from_files, from_python) if task != "ant" else ():
        for key in budget:
            del plain[key]
    assert from_files == from_python


def test_every_key_in_conf_carries_a_comment() -> None:
    bare = []
    for path in sorted(configuration_directory().rglob("*.yaml")):
        explained_above = path.parent.name in ("algorithm", "geometry", "linkage", "budget", "sweep")
        for line in path.read_text(encoding="utf-8").splitlines():
            is_value = ":" in line and not line.rstrip().endswith(":") and not line.lstrip().startswith(("#", "-"))
            if is_value and "#" not in line and not explained_above and "name:" not in line and "{" not in line:
                bare.append(f"{path.name}: {line}")
    assert not bare


@pytest.mark.parametrize("arguments", [["--help"], ["--version"], []])
def test_help_and_version_import_nothing_heavy(arguments: list[str]) -> None:
    code = (
        "import sys\n"
        "from exneat_cli.main import main\n"
        f"assert main({arguments!r} or None if {arguments!r} else ['--help']) == 0\n"
        "heavy = {'pandas', 'matplotlib', 'numba', 'mujoco', 'gymnasium', 'hydra', 'numpy'} & set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)
