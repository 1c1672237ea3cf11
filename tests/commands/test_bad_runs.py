"""Run directories from strangers: evaluate, inspect, report and train name file and field, and change nothing."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from exneat_cli.main import main
from exneat_cli.records import RunDirectory
from tests.commands.refusals import check_message, check_refusal

TRAIN = ["train", "task=track_maze", "budget=smoke", "generations=1", "population=4", "algorithm=neat"]


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    output = tmp_path_factory.mktemp("sound")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("exneat_cli.commands.train.draw_what_is_missing", lambda *arguments, **options: None)
        assert main([*TRAIN, f"output={output}"]) == 0
    (run,) = (output / "track_maze").iterdir()
    return run


def manifest_with(**entries: object) -> Callable[[RunDirectory], None]:
    def spoil(run: RunDirectory) -> None:
        run.manifest.write_text(json.dumps({**json.loads(run.manifest.read_text()), **entries}))

    return spoil


def champion_with(*place: object, value: object) -> Callable[[RunDirectory], None]:
    def spoil(run: RunDirectory) -> None:
        content = json.loads(run.champion.read_text())
        inside = content
        for key in place[:-1]:
            inside = inside[key]
        inside[place[-1]] = value
        run.champion.write_text(json.dumps(content))

    return spoil


def config_with(old: str, new: str) -> Callable[[RunDirectory], None]:
    return lambda run: (run.config.write_text(run.config.read_text().replace(old, new)), None)[1]


def as_pipe(run: RunDirectory) -> None:
    run.champion.unlink()
    os.mkfifo(run.champion)


def as_directory(run: RunDirectory) -> None:
    run.manifest.unlink()
    run.manifest.mkdir()


MANIFESTS = {
    "empty": (lambda run: run.manifest.write_bytes(b""), ["manifest.json: expected JSON"]),
    "latin": (lambda run: run.manifest.write_bytes(b'{"variant": "\xe4"}'), ["manifest.json:1: expected UTF-8"]),
    "deep": (lambda run: run.manifest.write_text("[" * 100_000), ["manifest.json: ", "nested too deeply"]),
    "nan": (lambda run: run.manifest.write_text('{"seed": NaN}'), ["manifest.json: expected JSON"]),
    "format": (manifest_with(format=2), ["manifest.json: expected format 3, got 2"]),
    "directory": (as_directory, ["manifest.json: ", "a directory"]),
    "status": (manifest_with(status="\x1b[31mdone"), ["manifest.json: damaged: status: expected text", "running|done"]),
    "seed": (manifest_with(seed=-1), ["manifest.json: damaged: seed: expected"]),
    "variant": (manifest_with(variant="\x1b[31m"), ["manifest.json: damaged: variant: expected text"]),
    "result": (manifest_with(result=[1]), ["manifest.json: damaged: result: expected a section"]),
    "figures": (manifest_with(result={"champion": {}}), ["manifest.json: damaged: result.champion: object missing"]),
}
"""How a manifest is spoilt, and what evaluate and inspect must name."""

OTHERS = {
    "unfinished": (manifest_with(status="failed"), ["expected a finished run, got status 'failed'"]),
    "tab": (lambda run: run.config.write_text("a:\n\tb: 1\n"), ["config.yaml:2: expected YAML"]),
    "twice": (lambda run: run.config.write_text("a: 1\na: 2\n"), ["config.yaml:2: the key 'a' comes twice"]),
    "code": (lambda run: run.config.write_text("a: !!python/name:os.mkdir ''\n"), ["config.yaml:1: ", "python/name"]),
    "key": (config_with("seed: 0", "sed: 0"), ["sed: unknown key"]),
    "value": (config_with("size: 13", "size: 12"), ["config.yaml: task.size: expected an odd number"]),
    "other_run": (config_with("size: 13", "size: 15"), ["config.yaml: does not describe the run beside it"]),
    "no_champion": (lambda run: run.champion.unlink(), ["champion.json: could not be read"]),
    "pipe": (as_pipe, ["champion.json: could not be read", "a pipe"]),
    "champion_field": (champion_with("wurst", value=1), ["damaged: object contains unknown field wurst"]),
    "champion_variant": (
        champion_with("variant", value="random"),
        ["champion.json: expected a champion of neat, got random"],
    ),
    "champion_pin": (
        champion_with("plan", "modules", 0, "pins", 0, "index", value=10**13),
        ["champion.json: damaged: body has a pin that reads what does not exist"],
    ),
    "champion_plan": (
        champion_with("plan", "observation_size", value=9),
        ["champion.json: is wired differently from what config.yaml beside it says"],
    ),
    "champion_kind": (champion_with("feed_forward", value=True), ["champion.json: damaged: ", "feeds itself"]),
}
"""How a run is spoilt otherwise, and what evaluate must name."""


def spoilt(sound: Path, folder: Path, spoil: object) -> Path:
    path = Path(shutil.copytree(sound, folder / "outputs" / "track_maze" / sound.name))
    spoil(RunDirectory(path))  # type: ignore[operator]
    return path


@pytest.mark.parametrize("name", [*MANIFESTS, *(f"other {name}" for name in OTHERS)])
def test_evaluate_refuses_a_spoilt_run(
    name: str, sound: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    spoil, named = OTHERS[name[6:]] if name.startswith("other ") else MANIFESTS[name]
    run = spoilt(sound, tmp_path, spoil)
    check_refusal(["evaluate", f"run={run}", "sweep=gap", "sweep.levels=[1]"], named, tmp_path, capfd)


@pytest.mark.parametrize("name", [*MANIFESTS, "pipe", "champion_field", "champion_pin"])
def test_inspect_refuses_a_spoilt_run_and_lists_it_as_damaged(
    name: str, sound: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    spoil, named = MANIFESTS.get(name) or OTHERS[name]
    run = spoilt(sound, tmp_path, spoil)
    check_refusal(["inspect", f"run={run}"], named, tmp_path, capfd)
    assert main(["inspect", f"output={tmp_path / 'outputs'}"]) == 0
    assert (capfd.readouterr().out.splitlines()[1].split()[0] == "damaged") == (name in MANIFESTS)


def test_training_again_refuses_a_finished_run_without_a_result(
    sound: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    def without_result(run: RunDirectory) -> None:
        content = json.loads(run.manifest.read_text())
        del content["result"]
        run.manifest.write_text(json.dumps(content))

    spoilt(sound, tmp_path, without_result)
    command = [*TRAIN, f"output={tmp_path / 'outputs'}"]
    check_refusal(command, ["manifest.json: damaged: result: expected the figures"], tmp_path, capfd)


COMMANDS = [
    (["fly"], ["fly: expected a command, one of train"]),
    (["\x1b[31mfly"], ["fly: expected a command"]),
    (["inspect", "run=nowhere"], ["run=nowhere: no run is there"]),
    (["inspect", "run="], ["run=: expected run="]),
    (["inspect", "--all"], ["--all: expected run="]),
    (["inspect", "run=a\x00b"], ["run=a\\x00b: no run is there"]),
    (["evaluate"], ["sweep: expected what to perturb"]),
    (["evaluate", "sweep=gap"], ["run: expected a run directory"]),
    (["evaluate", "run=nowhere", "sweep=gap"], ["run=nowhere: no run is there"]),
    (["evaluate", "run=a_file", "sweep=gap"], ["run=a_file: no run is there"]),
    (["evaluate", "run=no*thing", "sweep=gap"], ["run: expected a run directory, or a pattern"]),
    (["evaluate", "run=[a", "sweep=gap"], ["run=[a: expected key=value"]),
    (["evaluate", "run=3", "sweep=gap"], ["run: expected a run directory", "got 3"]),
    (["evaluate", "--what", "sweep=gap"], ["--what: unknown flag"]),
    (["report", "budget=huge"], ["budget: expected one of paper"]),
    (["report", "budget="], ["budget=: expected key=value"]),
    (["report", "only=figure-9.9"], ["only: expected one of figure-4.1"]),
    (["report", "axis=time"], ["axis: expected one of generation"]),
    (["report", "experiment=../x"], ["experiment: expected one of ant"]),
    (["report", "seed"], ["seed: expected key=value"]),
    (["sweep"], ["experiment: expected a name or a YAML file"]),
    (["sweep", "experiment="], ["experiment: expected a name or a YAML file"]),
    (["sweep", "experiment=nowhere.yaml"], ["nowhere.yaml: could not be read"]),
    (["sweep", "experiment=track_maze", "budget="], ["budget: expected one"]),
    (["sweep", "experiment=track_maze", "~seed"], ["~seed: a setting cannot be deleted"]),
    (["sweep", "experiment=track_maze", "noise.sensor_std=nan"], ["noise.sensor_std: expected", "nan"]),
    (["sweep", "experiment=track_maze", "task=../x"], ["task: expected the name of an option"]),
    (["sweep", "experiment=track_maze", "hydra.sweep.subdir=x"], ["exneat sets hydra.sweep.subdir itself"]),
]


@pytest.mark.parametrize(("arguments", "named"), COMMANDS, ids=[ascii(" ".join(given))[:60] for given, _ in COMMANDS])
def test_a_command_that_makes_no_sense_is_refused(
    arguments: list[str],
    named: list[str],
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a_file").touch()
    check_refusal(arguments, named, tmp_path, capfd)


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["train", "+sed=3", "output=out"], ["sed: unknown key"]),
        (["train", "--config-dir", "mine", "output=out"], ["own.yaml:2: the key 'a' comes twice"]),
        (["inspect", "run=mine"], ["no run is there"]),
    ],
)
def test_the_installed_program_refuses_in_the_same_words(
    arguments: list[str], named: list[str], tmp_path: Path
) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "own.yaml").write_text("a: 1\na: 2\n")
    code = f"import sys; from exneat_cli.main import main; sys.exit(main({arguments!r}))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False, cwd=tmp_path)
    check_message(done.returncode, done.stderr, named)
    assert [path.name for path in tmp_path.iterdir()] == ["mine"]
