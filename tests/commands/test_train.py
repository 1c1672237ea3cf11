"""`exneat train` and `exneat inspect` as users run them."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
import traceback
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
import yaml

import exneat_cli
from exneat_cli.commands.command_line import read_command_line
from exneat_cli.commands.jobs import read_job
from exneat_cli.commands.shipped import shipped_directory
from exneat_cli.main import COMMANDS, main
from exneat_cli.records import RunDirectory
from exneat_cli.runs import RunSettings
from exneat_cli.tasks import ENDED, TASKS, Simulation, TrackMaze


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


@pytest.mark.usefixtures("no_figures")
def test_the_manifest_tells_where_the_run_came_from(tmp_path: Path) -> None:
    assert train(f"output={tmp_path}", "algorithm=neat", "seed=5") == 0
    manifest = json.loads((the_run(tmp_path) / "manifest.json").read_text())
    assert manifest["status"] == "done"
    assert manifest["command"][:2] == ["exneat", "train"]
    assert "seed=5" in manifest["command"]
    assert manifest["budget_spent"]["episodes"] == 20
    assert {"python", "neat-python", "mujoco", "numba"} <= set(manifest["versions"])


@pytest.mark.parametrize(
    ("task", "algorithm"),
    [("track_maze", "linear_fusion"), ("general_maze", "neat"), ("foraging", "random"), ("hunting", "exneat")],
)
def test_a_run_in_every_grid_world_shows_the_agent_at_work(tmp_path: Path, task: str, algorithm: str) -> None:
    assert main(["train", "budget=smoke", f"task={task}", f"algorithm={algorithm}", f"output={tmp_path}"]) == 0
    (run,) = (tmp_path / task).iterdir()
    assert {"tiles.csv", "trace.csv", "manifest.json"} <= {path.name for path in run.iterdir()}
    assert (run / "plots" / "path.svg").stat().st_size > 0


@pytest.mark.usefixtures("no_figures")
def test_a_saved_configuration_trains_the_same_run_elsewhere(tmp_path: Path) -> None:
    assert train(f"output={tmp_path / 'a'}", "geometry=lr", "noise=sensor") == 0
    run = the_run(tmp_path / "a")
    again = ["train", "--config-path", os.path.relpath(run), f"output={tmp_path / 'b'}"]
    assert main(again) == 0
    assert (the_run(tmp_path / "b") / "champion.json").read_bytes() == (run / "champion.json").read_bytes()


@pytest.mark.usefixtures("no_figures")
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


@pytest.mark.usefixtures("no_figures")
def test_a_multirun_never_makes_a_finished_run_longer_unasked(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    arguments = ("task=track_maze", "budget=smoke", "test_episodes=1", "validation_episodes=1", f"output={tmp_path}")
    assert main(["train", "-m", *arguments, "generations=1,2"]) == 2
    assert "holds a finished run of 1 generations" in capfd.readouterr().err
    (run,) = (tmp_path / "track_maze").iterdir()
    assert json.loads((run / "manifest.json").read_text())["generations"] == 1


@pytest.mark.usefixtures("no_figures")
def test_inspect_calls_a_run_killed_whose_process_is_gone(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert main(["inspect", f"output={tmp_path}"]) == 0
    assert "No runs below" in capfd.readouterr().out
    assert train(f"output={tmp_path}", "algorithm=random") == 0
    run = RunDirectory(the_run(tmp_path))
    run.update_manifest(status="running")
    capfd.readouterr()
    assert main(["inspect", f"output={tmp_path}"]) == 0
    assert capfd.readouterr().out.splitlines()[1].startswith("killed ")
    with run.held():
        assert main(["inspect", f"output={tmp_path}"]) == 0
    assert capfd.readouterr().out.splitlines()[1].startswith("running ")


@pytest.mark.usefixtures("no_figures")
def test_inspect_shows_sensors_joints_and_sizes_of_every_module(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert train(f"output={tmp_path}", "recipe=thesis", "geometry=cross", "linkage=full") == 0
    capfd.readouterr()
    assert main(["inspect", f"run={the_run(tmp_path)}"]) == 0
    shown = capfd.readouterr().out
    assert "5 modules, 3 subpopulations, feed-forward" in shown
    assert "senses   hip_1 position (rad); ankle_1 position (rad); hip_1 velocity (rad/s);" in shown
    assert "hidden 0, 1, 2, 3 of back_left, of the previous step" in shown
    assert "output hip_4 (150 N m), ankle_4 (150 N m), hip_1 (150 N m)" in " ".join(shown.split())
    assert "drives   hip_4 (150 N m); ankle_4 (150 N m); hip_1 (150 N m)" in shown
    assert "48 inputs" in shown


@pytest.mark.usefixtures("no_figures")
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
    assert states == ["done", "damaged", "damaged"]


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
    assert error.strip().splitlines()[-2:] == [
        "exneat: interrupted; to continue:",
        f"exneat resume run={the_run(tmp_path)}",
    ]
    assert "Traceback" not in error
    assert json.loads((the_run(tmp_path) / "manifest.json").read_text())["status"] == "interrupted"


@pytest.mark.parametrize("task", sorted(TASKS))
def test_the_defaults_in_conf_are_those_of_the_dataclasses(task: str) -> None:
    thesis = ["recipe=thesis"] if task in ("ant", "robot") else []
    from_files = read_job("", read_command_line("train", [f"task={task}", *thesis])).settings.to_plain()
    from_python = RunSettings(task=TASKS[task](), name=task).to_plain()
    budget = ("generations", "population", "episodes", "validation_episodes", "test_episodes")
    if task == "gym":  # which chooses another
        from_python["executor"]["name"] = "processes"
    for plain in (from_files, from_python) if task != "ant" else ():
        for key in budget:
            del plain[key]
    assert from_files == from_python


@pytest.mark.parametrize("algorithm", ["ars", "openai_es", "cma_es"])
@pytest.mark.parametrize("task", ["ant", "track_maze"])
def test_the_defaults_of_an_evolution_strategy_in_conf_are_those_of_its_dataclass(task: str, algorithm: str) -> None:
    line = read_command_line("train", [f"task={task}", f"algorithm={algorithm}"])
    from_files, from_python = read_job("", line).settings, RunSettings(task=TASKS[task](), algorithm=algorithm)
    assert from_files.algorithm == from_python.algorithm
    identity_of = from_python.algorithm.identity_of
    assert identity_of(from_files.evolution) == identity_of(from_python.evolution)


def test_every_key_in_conf_carries_a_comment() -> None:
    bare = []
    for path in sorted(shipped_directory("conf").rglob("*.yaml")):
        explained_above = path.parent.name in ("algorithm", "geometry", "linkage", "budget", "sweep")
        for line in path.read_text(encoding="utf-8").splitlines():
            is_value = ":" in line and not line.rstrip().endswith(":") and not line.lstrip().startswith(("#", "-"))
            if is_value and "#" not in line and not explained_above and "name:" not in line and "{" not in line:
                bare.append(f"{path.name}: {line}")
    assert not bare


LIBRARIES = ("pandas", "matplotlib", "numba", "mujoco", "gymnasium", "numpy")


@pytest.mark.parametrize("command", ["", *COMMANDS])
def test_help_imports_nothing_heavy_and_shows_every_setting_with_its_meaning(command: str) -> None:
    heavy = LIBRARIES if command else (*LIBRARIES, "hydra", "yaml")
    code = (
        "import sys\n"
        "from exneat_cli.main import main\n"
        f"assert main([*{command.split()}, '--help']) == 0\n"
        f"assert not set({heavy}) & set(sys.modules), set({heavy}) & set(sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    if command:
        assert done.stdout.startswith(f"exneat {command}: ")
        shown = re.sub(r"\s+", " ", done.stdout)
        for line in shown_settings(command) if command != "completion" else ():  # which has no settings
            assert line in shown
        assert ("seed=0" in shown) == (command in ("train", "sweep", "search"))
        assert "${" not in shown
    else:
        assert all(f"\n  {name} " in done.stdout for name in COMMANDS)


def shown_settings(command: str) -> list[str]:
    """What the help of a command must hold: keys with default and comment, wherever lines are broken."""
    of_runs = [
        "seed=0 0 to 2^64 - 1; root",
        "generations=25 whole number",
        "recipe=walking walking, thesis",
        "task.max_steps=1000 control steps after which",
        "evolution.neat_hidden=0 initial hidden nodes of NEAT's network",
        "noise.sensor_std=0.0 sd of normal noise",
    ]
    lines = {
        "train": [*of_runs, "sweep=none "],
        "resume": ["run=null a run directory", "task.kind=null", "generations=null"],
        "sweep": ["experiment=null ant, track_maze", *of_runs],
        "search": ["space=null mutation, or", "trials=20 how many", *of_runs],
        "evaluate": ["run=null a run directory", "sweep.episodes=100 test episodes", "executor=null threads"],
        "report": ["budget=null whose runs", "axis=generation horizontal axis"],
        "watch": ["run=null ", "panel=null ", "level=null "],
        "export": ["run=null ", "format=python "],
        "inspect": ["run=null a run directory", "output=outputs root", "sort=fitness order", "task=null a task"],
        "doctor": ["output=outputs root of run directories"],
    }
    return lines[command]


def test_a_configuration_is_shown_without_training(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["train", "--cfg", "job", "task=hunting", "seed=4"]) == 0
    shown = yaml.safe_load(capfd.readouterr().out)
    assert (shown["task"]["p_m"], shown["seed"], shown["generations"]) == (0.5, 4, 10)
    assert not list(tmp_path.iterdir())


def test_few_frames_of_our_own_lie_between_the_command_line_and_the_compiled_loop(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before: list[str] = []
    way: list[str] = []

    def own_frames() -> list[str]:
        package = str(Path(exneat_cli.__file__).parent)
        ours = [frame.name for frame in traceback.extract_stack() if frame.filename.startswith(package)]
        return [name for name in ours if name != "<listcomp>"]  # which are frames up to Python 3.11 alone

    def submit(pool: ThreadPoolExecutor, *arguments: Any, **options: Any) -> Any:
        before[:] = own_frames()
        return real_submit(pool, *arguments, **options)

    def reset(world: Any, rng: Any) -> None:
        of_this_thread = own_frames()[:-1]  # the loop itself is compiled otherwise
        is_main = threading.current_thread() is threading.main_thread()
        way[:] = ["program", *(of_this_thread if is_main else before + of_this_thread)]

    def do_nothing(*arguments: Any) -> int:
        return ENDED

    def opened(task: TrackMaze, *, training: bool) -> Simulation:
        return Simulation(None, reset, do_nothing, do_nothing, do_nothing, compiled=False)

    real_submit = ThreadPoolExecutor.submit
    monkeypatch.setattr(ThreadPoolExecutor, "submit", submit)
    monkeypatch.setattr(TrackMaze, "open", opened)
    monkeypatch.setattr("exneat_cli.runs.run.choose_champion", lambda *arguments: sys.exit("trained"))
    with pytest.raises(SystemExit, match="trained"):
        main(["train", "task=track_maze", "budget=smoke", "executor=serial", f"output={tmp_path}"])
    assert way[:4] == ["program", "main", "run", "do"]
    assert len(way) <= 10, way
