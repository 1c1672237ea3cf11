"""task=gym on the command line: trained, resumed, evaluated, reported; and code that only its user may name."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import gymnasium
import pytest
import yaml

from exneat_cli.main import main
from exneat_cli.records import RunDirectory, find_runs, read_robustness
from exneat_cli.records.champion import read_champion
from exneat_cli.tasks.environments import interface_of
from exneat_cli.tasks.user_code import NAMED
from tests.commands.refusals import check_refusal
from tests.torture.small_runs import difference, results

pytestmark = pytest.mark.usefixtures("no_figures")
SMALL = ["task=gym", "budget=smoke", "task.max_steps=60", "population=8"]
TWO_LEGS = (
    "task.parts={back: {sensors: [2, 3, 4], actuators: [0, 1, 2]}, front: {sensors: [5, 6, 7], actuators: [3, 4, 5]}}"
)
ENVIRONMENTS = {
    "CartPole-v1": [],
    "HalfCheetah-v5": [TWO_LEGS, "linkage=output", "geometry=single"],
    "BipedalWalker-v3": [],
}


def the_run(output: Path) -> RunDirectory:
    (run,) = find_runs(output)
    return run


@pytest.mark.parametrize("env_id", ENVIRONMENTS)
def test_an_environment_is_trained_resumed_to_the_same_bytes_evaluated_and_reported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], env_id: str
) -> None:
    if env_id.startswith("Bipedal") and find_spec("Box2D") is None:
        pytest.skip("Box2D is not installed")
    common = ["train", *SMALL, f"task.env_id={env_id}", *ENVIRONMENTS[env_id]]
    assert main([*common, "generations=3", "executor=serial", f"output={tmp_path / 'serial'}"]) == 0
    assert "plain Python, which is slower" in capsys.readouterr().out
    expected, output = results(tmp_path / "serial"), tmp_path / "processes"
    assert main([*common, "generations=2", "executor.workers=2", f"output={output}"]) == 0
    assert main([*common, "generations=3", "executor.workers=2", f"output={output}", "resume=true"]) == 0
    assert yaml.safe_load(the_run(output).config.read_text())["executor"]["name"] == "processes"
    assert not difference(results(output), expected)
    run = the_run(output)
    sweep = ["sweep=sensor_noise", "sweep.levels=[0,0.5]", "sweep.episodes=2"]
    assert main(["evaluate", f"run={run.path}", *sweep, "executor.workers=2"]) == 0
    assert main(["evaluate", f"run={the_run(tmp_path / 'serial').path}", *sweep, "executor=serial"]) == 0
    assert run.robustness.read_bytes() == the_run(tmp_path / "serial").robustness.read_bytes()
    assert [row.level for row in read_robustness(run.robustness)] == [0.0, 0.5]
    assert main(["inspect", f"run={run.path}"]) == 0
    assert "action_0" in capsys.readouterr().out


def test_an_experiment_over_environments_with_parts_is_swept(tmp_path: Path) -> None:
    legs = {"back": {"sensors": [2, 3, 4], "actuators": [0, 1, 2]}, "front": {"sensors": [5], "actuators": [3]}}
    cheetah = {"task": "gym", "task.env_id": "HalfCheetah-v5", "task.max_steps": 20, "population": 4, "generations": 1}
    plan = {
        "claim": "Legs walk.",
        "settings": cheetah,
        "variants": {
            "neat": {"label": "NEAT", "settings": {"algorithm": "neat"}},
            "legs": {"label": "legs", "settings": {"geometry": "all", "task.parts": legs}},
        },
        "conditions": {"clean": {"label": "clean", "settings": {}, "sweeps": ["sensor_noise"]}},
        "runs": {"smoke": 1},
    }
    (tmp_path / "legs.yaml").write_text(yaml.safe_dump(plan, sort_keys=False))
    common = [f"experiment={tmp_path / 'legs.yaml'}", "budget=smoke", f"output={tmp_path / 'out'}"]
    assert main(["sweep", *common, "executor=serial"]) == 0
    champions = [read_champion(run.champion) for run in find_runs(tmp_path / "out")]
    assert sorted(m.name for each in champions for m in each.plan.modules) == ["back", "body", "front"]


LOUD = """
import gymnasium
print("imported")
gymnasium.register("Loud-v0", "gymnasium.envs.classic_control:CartPoleEnv", max_episode_steps=20)
"""
NAMED_BY = "task.env_id=exneat_loud:Loud-v0"


@pytest.fixture
def loud(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Iterator[Path]:
    """A finished run whose environment is in a module that says when it is imported, which nobody has done since."""
    (tmp_path / "code").mkdir()
    (tmp_path / "code" / "exneat_loud.py").write_text(LOUD)
    monkeypatch.syspath_prepend(str(tmp_path / "code"))
    monkeypatch.chdir(tmp_path)
    assert main(["train", *SMALL, NAMED_BY, "executor=serial", "output=out"]) == 0
    assert "imported" in capfd.readouterr().out
    forget()
    yield the_run(tmp_path / "out").path
    forget()


def forget() -> None:
    sys.modules.pop("exneat_loud", None)
    gymnasium.registry.pop("Loud-v0", None)
    interface_of.cache_clear()
    NAMED.discard("exneat_loud:Loud-v0")


REFUSED = "task.env_id: expected code that is registered, or that you name yourself, got 'exneat_loud:Loud-v0'"


def test_a_run_directory_never_has_code_imported(loud: Path, capfd: pytest.CaptureFixture[str]) -> None:
    sweep = ["sweep=sensor_noise", "sweep.levels=[0]", "sweep.episodes=1", "executor=serial"]
    for refused in (
        ["evaluate", f"run={loud}", *sweep],
        ["train", "--config-path", str(loud), "output=elsewhere"],
        ["train", "--config-path", str(loud), "output=out", "resume=true", "generations=3"],
        ["sweep", "--config-path", str(loud), "--config-name", "config", "experiment=ant", "budget=smoke"],
    ):
        check_refusal(refused, [], loud.parents[2], capfd)
        assert "exneat_loud" not in sys.modules
    check_refusal(["evaluate", f"run={loud}", *sweep], [REFUSED, f"add {NAMED_BY}"], loud, capfd)
    for harmless in (
        ["inspect", f"run={loud}"],
        ["inspect", "output=out"],
        ["train", "--config-path", str(loud), "--help"],
    ):
        assert main(harmless) == 0
        assert "imported" not in capfd.readouterr().out
    assert main(["report", "output=out"]) == 2
    assert "exneat_loud" not in sys.modules


@pytest.mark.parametrize(
    "allowed",
    [
        ["evaluate", "run={}", "sweep=sensor_noise", "sweep.levels=[0]", "executor=serial", NAMED_BY],
        ["train", "--config-path", "{}", "output=elsewhere", "executor.name=serial", NAMED_BY],
        ["train", *SMALL, NAMED_BY, "executor=serial", "output=out", "resume=true", "generations=3"],
    ],
)
def test_who_names_the_code_himself_has_it_imported(
    loud: Path, capfd: pytest.CaptureFixture[str], allowed: list[str]
) -> None:
    assert main([word.format(loud) for word in allowed]) == 0
    assert "imported" in capfd.readouterr().out


def test_a_file_that_the_user_names_may_name_code(loud: Path, capfd: pytest.CaptureFixture[str]) -> None:
    own = loud.parents[2] / "mine" / "task" / "own.yaml"
    own.parent.mkdir(parents=True)
    own.write_text("# @package _global_\ndefaults: [gym]\ntask: {env_id: 'exneat_loud:Loud-v0'}\n")
    assert main(["train", "--config-dir", "mine", "task=own", "budget=smoke", "executor=serial", "output=mine2"]) == 0
    assert "imported" in capfd.readouterr().out
