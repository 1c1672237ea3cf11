"""YAML of a user's own, for --config-dir, --config-path and experiment=: refused with file and line, or taken."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from exneat_cli.main import main
from tests.commands.refusals import TASK, check_refusal

pytestmark = pytest.mark.usefixtures("no_figures")


def size(text: bytes) -> bytes:
    """The sound task with something else in its line 6."""
    return TASK.replace(b"  size: 7\n", text)


def evolution(text: bytes) -> bytes:
    return TASK.replace(b"/evolution: recurrent", text)


NO_YAML = {
    # unusable whatever a YAML file is for
    "tab": (size(b"\tsize: 7\n"), ":6: cannot be read as YAML: found character '\\t'"),
    "bracket": (size(b"  size: [7\n"), "cannot be read as YAML"),
    "two_documents": (TASK + b"---\nb: 1\n", ":9: cannot be read as YAML: but found another document"),
    "twice_at_the_top": (TASK + b"task: {name: ant}\n", ":9: cannot be read as YAML: found duplicate key task"),
    "twice_below": (size(b"  size: 7\n  size: 9\n"), ":7: cannot be read as YAML: found duplicate key size"),
    "latin": (TASK + b"# gr\xf6\xdfe\n", ": expected UTF-8 text, got the byte 0xf6"),
    "no_alias": (TASK + b"a: *nope\n", ":9: cannot be read as YAML: found undefined alias 'nope'"),
    "python_tag": (size(b"  size: !!python/object/apply:os.mkdir [pwned]\n"), ":6: cannot be read as YAML"),
    "own_tag": (size(b"  size: !foo 7\n"), ":6: cannot be read as YAML: could not determine a constructor"),
}
NO_TASK = {
    "empty": (b"", "budgets.smoke.generations' not found"),
    "a_list": (b"- a\n- b\n", "budgets.smoke.generations' not found"),
    "no_package": (TASK.split(b"\n", 1)[1], "budgets.smoke.generations' not found\n  a YAML file of your own"),
    "refers_to_nothing": (size(b"  size: ${nowhere.x}\n"), "task.size: Interpolation key 'nowhere.x' not found"),
    "cycle": (size(b"  size: ${task.gap}\n  gap: ${task.size}\n"), "task.size: Recursive interpolation"),
    "no_variable": (size(b"  size: ${oc.env:EXNEAT_NO_SUCH}\n"), "Environment variable 'EXNEAT_NO_SUCH' not found"),
    "no_resolver": (size(b"  size: ${foo:1}\n"), "task.size: Unsupported interpolation type foo"),
    "half_interpolation": (size(b"  size: ${oops\n"), "task.size: no viable alternative at input '${oops'"),
    "missing": (size(b"  size: ???\n"), "task.size: Missing mandatory value"),
    "unknown_key": (size(b"  siez: 7\n"), "task.siez: unknown key (value 7)\n  did you mean task.size?"),
    "unknown_section": (TASK + b"wurst: 3\n", "wurst: unknown key"),
    "wrong_type": (size(b"  size: [7]\n"), "task.size: expected a whole number from 5 to 99, got [7]"),
    "a_date": (size(b"  size: 2020-01-01\n"), "task.size: expected a whole number from 5 to 99, got '2020-01-01'"),
    "leads_back": (evolution(b"leads_back"), "includes itself"),
    "default_of_nothing": (evolution(b"/evolution: nowhere"), "evolution=nowhere: no such option; known: feed_forward"),
    "default_number": (evolution(b"3"), "Unsupported type in defaults"),
    "budget": (TASK.replace(b"population: 6", b"popluation: 6"), "population: Interpolation key"),
    "ant": (TASK, "exneat has a task/ant.yaml of its own, which would be used instead; rename yours"),
}


@pytest.mark.parametrize("name", [*NO_YAML, *NO_TASK])
def test_a_task_file_that_cannot_be_used_is_refused_before_anything_is_made(
    name: str, tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    content, named = {**NO_YAML, **NO_TASK}[name]
    path = tmp_path / "mine" / "task" / f"{name}.yaml"
    path.parent.mkdir(parents=True)
    path.write_bytes(content)
    where = [f"{name}.yaml"] if name in NO_YAML else []
    command = ["train", "--config-dir", "mine", f"task={name}", "budget=smoke", "output=out"]
    check_refusal(command, [*where, named], tmp_path, capfd)


@pytest.mark.parametrize("name", NO_YAML)
def test_an_experiment_that_is_no_yaml_is_refused_with_its_line(
    name: str, tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "own.yaml").write_bytes(NO_YAML[name][0])
    check_refusal(["sweep", "experiment=own.yaml", "output=out"], ["own.yaml", NO_YAML[name][1]], tmp_path, capfd)


def test_a_configuration_that_is_not_the_one_of_a_run_is_refused(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    config = tmp_path / "mine" / "config.yaml"
    config.parent.mkdir()
    for content, named in {
        b"\tseed: 1\n": "mine/config.yaml:1: cannot be read as YAML",
        b"seed: 1\nseed: 2\n": "mine/config.yaml:2: cannot be read as YAML: found duplicate key seed",
        b"sed: 1\n": "sed: unknown key",
        b"task: {name: atn}\n": "task.name: expected one of",
    }.items():
        config.write_bytes(content)
        check_refusal(["train", "--config-path", "mine", "output=out"], [named], tmp_path, capfd)
    check_refusal(["train", "--config-dir", "mine"], ["mine/config.yaml: exneat has a config.yaml"], tmp_path, capfd)


@pytest.mark.parametrize("command", ["train", "train -m hydra/launcher=joblib"])
def test_nothing_in_a_file_of_the_users_own_is_called(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    calls = "{_target_: os.mkdir, path: called}"
    logging = "{version: 1, handlers: {x: {'()': os.mkdir, path: called}}}"
    hydras = f"hydra: {{callbacks: {{x: {calls}}}, job_logging: {logging}, run: {{dir: called}}}}\n"
    (tmp_path / "mine" / "task").mkdir(parents=True)
    (tmp_path / "mine" / "task" / "own.yaml").write_bytes(TASK + hydras.encode())
    own = ["--config-dir", "mine", "task=own", "algorithm=motionless", "budget=smoke", "output=out"]
    assert main([*command.split(), *own]) == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mine", "out"]


def test_a_launcher_of_the_users_own_is_taken_unless_it_calls_something_else(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("hydra_plugins.hydra_joblib_launcher")
    monkeypatch.chdir(tmp_path)
    launchers = tmp_path / "mine" / "hydra" / "launcher"
    launchers.mkdir(parents=True)
    target = "_target_: hydra_plugins.hydra_joblib_launcher.joblib_launcher.JoblibLauncher\nn_jobs: 1\n"
    (launchers / "sound.yaml").write_text(target)
    (launchers / "strange.yaml").write_text("_target_: os.mkdir\npath: called\n")
    (launchers / "nested.yaml").write_text(target + "verbose: {_target_: os.mkdir, path: called}\n")
    (launchers / "made.yaml").write_text(target + """verbose: "${oc.create:'{_target_: os.mkdir}'}"\n""")
    (launchers / "logging.yaml").write_text(target + "x: {'()': os.mkdir}\n")
    train = ["train", "-m", "--config-dir", "mine", "task=track_maze", "algorithm=motionless", "budget=smoke"]
    for name in ("nested", "made", "logging"):
        check_refusal([*train, f"hydra/launcher={name}"], ["a configuration may not call code"], tmp_path, capfd)
    check_refusal([*train, "hydra/launcher=strange"], ["Invalid plugin 'os.mkdir'"], tmp_path, capfd)
    assert main([*train, "hydra/launcher=sound"]) == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mine", "outputs"]


EXPERIMENT = """claim: It works with mine.
settings: {algorithm: motionless, noise.sensor_std: 1e-2, noise: {reset_scale: 1e-1}}
variants: {still: {label: still, settings: {task: mine}}}
conditions: {clean: {label: clean, settings: {}, sweeps: [sensor_noise]}}
runs: {smoke: 1}
"""


def test_files_with_other_line_ends_and_letters_in_places_with_spaces_or_links_are_taken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "my own files" / "task").mkdir(parents=True)
    (tmp_path / "real").mkdir()
    (tmp_path / "out puts").symlink_to(tmp_path / "real")
    monkeypatch.chdir(tmp_path)
    task = TASK + "# größe, 大きさ\nname: my_mazes\nseed: 3\ntest_episodes: 3\n".encode()
    (tmp_path / "my own files" / "task" / "mine.yaml").write_bytes(task.replace(b"\n", b"\r\n"))
    own = ["--config-dir", "my own files", "budget=smoke", "output=out puts"]
    assert main(["train", *own, "task=mine", "algorithm=motionless", "seed=5"]) == 0
    (run,) = (tmp_path / "real" / "my_mazes").iterdir()
    written = yaml.safe_load((run / "config.yaml").read_text())
    # what a task file sets counts more than the default and less than the command line
    assert (written["seed"], written["test_episodes"], written["task"]["size"]) == (5, 3, 7)
    (tmp_path / "my experiment.yaml").write_bytes(EXPERIMENT.replace("\n", "\r\n").encode())
    (tmp_path / "my_experiment.yaml").symlink_to(tmp_path / "my experiment.yaml")
    assert main(["sweep", "experiment=my_experiment.yaml", *own]) == 0
    (run,) = (tmp_path / "real").glob("my_experiment-clean-smoke/*")
    assert yaml.safe_load((run / "config.yaml").read_text())["noise"] == {"sensor_std": 0.01, "reset_scale": 0.1}


@pytest.mark.parametrize(
    ("command", "text", "named"),
    [
        ("inspect", "output: out", "run: is missing"),
        ("doctor", "", "output: is missing"),
        ("evaluate", "run: out", "task: is missing"),
        ("evaluate", "{run: out, task: {}}", "sweeps: is missing"),
        ("report", "{output: out, budget: smoke}", "experiment: is missing"),
        ("sweep", "budget: smoke", "experiment: is missing"),
        ("train", "output: out", "task: expected a section"),
        ("inspect", "runs: out", "runs: unknown key (value 'out')"),
    ],
)
def test_a_configuration_of_a_users_own_that_lacks_a_key_is_refused(
    command: str, text: str, named: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "mine.yaml").write_text(text)
    check_refusal([command, "-cp", str(tmp_path), "-cn", "mine"], [named], tmp_path, capfd)
