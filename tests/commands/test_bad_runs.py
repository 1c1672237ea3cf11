"""Run directories from strangers: evaluate, inspect, report and train name file and field, and change nothing."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from exneat_cli.main import main
from exneat_cli.records import RunDirectory
from tests.commands.figures import without_figures
from tests.commands.refusals import check_refusal

TRAIN = ["train", "task=track_maze", "budget=smoke", "generations=1", "population=4", "algorithm=neat"]


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    output = tmp_path_factory.mktemp("sound")
    with without_figures():
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


MANIFESTS = {
    "empty": (lambda run: run.manifest.write_bytes(b""), "manifest.json: expected JSON"),
    "cut": (lambda run: run.manifest.write_text("{"), "manifest.json: expected JSON"),
    "latin": (lambda run: run.manifest.write_bytes(b'{"variant": "\xe4"}'), "manifest.json:1: expected UTF-8"),
    "status": (manifest_with(status="\x1b[31mdone"), "manifest.json: damaged: status: "),
    "seed": (manifest_with(seed=-1), "manifest.json: damaged: seed: expected"),
    "result": (manifest_with(result=[1]), "manifest.json: damaged: result: expected a section"),
    "figures": (manifest_with(result={"champion": {}}), "manifest.json: damaged: result.champion: "),
}
"""How a manifest is spoilt, and what must be named."""

CHAMPIONS = {
    "field": (champion_with("wurst", value=1), "champion.json: damaged: object contains unknown field wurst"),
    "pin": (champion_with("plan", "modules", 0, "pins", 0, "index", value=10**13), "damaged: body has a pin"),
    "genomes": (champion_with("genomes", value=[]), "champion.json: damaged"),
    "actuators": (champion_with("actuators", value=[]), "champion.json: damaged"),
    "scores": (champion_with("scores", value={}), "champion.json: damaged"),
}
"""How a champion is spoilt, and what must be named."""

OTHERS = {
    "old": (manifest_with(format=2), "manifest.json: expected format 4, got 2"),
    "unfinished": (manifest_with(status="failed"), "expected a finished run, got status 'failed'"),
    "running": (manifest_with(status="running"), "expected a finished run, got status 'running'"),
    "hash": (manifest_with(configuration_hash="0"), "config.yaml: does not describe this run"),
    "no_config": (lambda run: run.config.unlink(), "config.yaml: could not be read"),
    "list": (lambda run: run.config.write_text("[1]"), "config.yaml: expected keys with values, got list"),
    "tab": (lambda run: run.config.write_text("a:\n\tb: 1\n"), "config.yaml:2: expected YAML"),
    "code": (lambda run: run.config.write_text("a: !!python/name:os.mkdir ''\n"), "config.yaml:1: expected YAML"),
    "key": (config_with("seed: 0", "sed: 0"), "sed: unknown key"),
    "value": (config_with("size: 13", "size: 12"), "config.yaml: task.size: expected an odd number"),
    "other_run": (config_with("size: 13", "size: 15"), "config.yaml: does not describe this run"),
    "no_champion": (lambda run: run.champion.unlink(), "champion.json: could not be read"),
    "no_json": (lambda run: run.champion.write_text("{}"), "champion.json: "),
    "other_variant": (champion_with("variant", value="random"), "expected a champion of neat, got random"),
    "other_plan": (
        champion_with("plan", "modules", 0, "position", value=[1.0, 0.0]),
        "champion.json: its wiring is not the one",
    ),
    "other_kind": (champion_with("feed_forward", value=True), "champion.json: "),
    "table": (lambda run: run.robustness.write_text("x"), "robustness.csv"),
}
"""How a run is spoilt otherwise, and what evaluate must name."""


def spoilt(sound: Path, folder: Path, spoil: object) -> Path:
    path = Path(shutil.copytree(sound, folder / "outputs" / "track_maze" / sound.name))
    spoil(RunDirectory(path))  # type: ignore[operator]
    return path


@pytest.mark.parametrize("name", [*MANIFESTS, *CHAMPIONS, *OTHERS])
def test_evaluate_refuses_a_spoilt_run(
    name: str, sound: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    spoil, named = {**MANIFESTS, **CHAMPIONS, **OTHERS}[name]
    run = spoilt(sound, tmp_path, spoil)
    check_refusal(["evaluate", f"run={run}", "sweep=gap", "sweep.levels=[1]"], [named], tmp_path, capfd)


@pytest.mark.parametrize("name", ["status", "pin"])
def test_inspect_refuses_a_spoilt_run_and_lists_it_as_damaged_if_its_manifest_is(
    name: str, sound: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    spoil, named = {**MANIFESTS, **CHAMPIONS}[name]
    run = spoilt(sound, tmp_path, spoil)
    check_refusal(["inspect", f"run={run}"], [named], tmp_path, capfd)
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
