"""YAML of a user's own, for --config-dir, --config-path and experiment=: refused with file and line, or taken."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
import yaml

from exneat_cli.main import main
from tests.commands.refusals import TASK, check_refusal

BOMB = b"a: &a [x,x,x,x,x,x,x,x,x]\n" + b"".join(
    b"%c: &%c [%s]\n" % (c, c, b",".join([b"*%c" % (c - 1)] * 9)) for c in b"bcdefghijk"
)


def size(text: bytes) -> bytes:
    """The sound task with something else in its line 6."""
    return TASK.replace(b"  size: 7\n", text)


def defaults(text: bytes) -> bytes:
    return TASK.replace(b"defaults:\n  - /evolution: recurrent\n", text)


ANYWHERE = {
    # unusable whatever a YAML file is for; the line that the message names comes first
    "empty": (b"", ["empty file"]),
    "comments": (b"# nothing\n", ["empty file"]),
    "a_list": (b"- a\n- b\n", [":1: expected keys with values, got a list"]),
    "a_number": (b"7\n", [":1: expected keys with values, got '7'"]),
    "tab": (size(b"\tsize: 7\n"), [":6: expected YAML", "indent with spaces"]),
    "bracket": (size(b"  size: [7\n"), ["expected YAML"]),
    "two_documents": (TASK + b"---\nb: 1\n", [":9: expected YAML", "another document"]),
    "twice_at_the_top": (TASK + b"task: {name: ant}\n", [":9: the key 'task' comes twice, first on line 4"]),
    "twice_below": (size(b"  size: 7\n  size: 9\n"), [":7: the key 'size' comes twice, first on line 6"]),
    "latin": (TASK + b"# gr\xf6\xdfe\n", [":9: expected UTF-8 text, got the byte 0xf6"]),
    "utf16": (TASK.decode().encode("utf-16"), [":1: expected UTF-8 text"]),
    "nul": (TASK + b"\x00\n", [":9: expected YAML, got the character 0x0"]),
    "escape": (TASK + b"# \x1b[31m\n", [":9: expected YAML, got the character 0x1b"]),
    "python_tag": (
        size(b"  size: !!python/object/apply:os.mkdir [pwned]\n"),
        [":6: ", "!!python/object/apply:os.mkdir"],
    ),
    "own_tag": (size(b"  size: !foo 7\n"), [":6: ", "!foo"]),
    "binary": (size(b"  size: !!binary aGVsbG8=\n"), [":6: ", "!!binary"]),
    "bomb": (TASK + BOMB, ["at most 100000 values"]),
    "own_alias": (TASK + b"a: &a [*a]\n", [":9: an alias that contains itself"]),
    "no_alias": (TASK + b"a: *nope\n", [":9: ", "undefined alias 'nope'"]),
    "deep": (TASK + b"a: " + b"[" * 3000 + b"]" * 3000 + b"\n", ["at most 50 levels"]),
    "deep_sections": (TASK + b"a: " + b"{a: " * 60 + b"1" + b"}" * 60 + b"\n", [":9: ", "at most 50 levels"]),
    "huge_number": (size(b"  size: " + b"9" * 5000 + b"\n"), ["cannot be read"]),
    "list_as_key": (TASK + b"? [a, b]\n: x\n", [":9: expected a word as a key"]),
    "no_key": (TASK + b"? \n: x\n", [":9: expected a word as a key, got nothing"]),
}

AS_TASK = {
    "calls_code": (
        TASK + b"hydra:\n  callbacks:\n    x:\n      _target_: os.mkdir\n",
        [":12: _target_ would call os.mkdir"],
    ),
    "refers_to_nothing": (size(b"  size: ${nowhere.x}\n"), ["task.size: refers to nowhere.x"]),
    "cycle": (size(b"  size: ${task.gap}\n  gap: ${task.size}\n"), ["task.size: Recursive interpolation"]),
    "no_variable": (size(b"  size: ${oc.env:EXNEAT_NO_SUCH}\n"), ["task.size: ", "EXNEAT_NO_SUCH"]),
    "no_resolver": (size(b"  size: ${foo:1}\n"), ["task.size: ", "foo"]),
    "half_interpolation": (size(b"  size: ${oops\n"), ["task.size: ", "${oops"]),
    "missing": (size(b"  size: ???\n"), ["task.size: Missing mandatory value"]),
    "unknown_key": (size(b"  siez: 7\n"), ["task.siez: unknown key", "did you mean task.size?"]),
    "unknown_section": (TASK + b"wurst: 3\n", ["wurst: unknown key"]),
    "wrong_type": (size(b"  size: [7]\n"), ["task.size: expected a whole number from 5 to 99, got [7]"]),
    "a_date": (size(b"  size: 2020-01-01\n"), ["task.size: expected", "2020-01-01"]),
    "a_nan": (size(b"  size: .nan\n"), ["task.size: expected", "nan"]),
    "leads_back": (defaults(b"defaults:\n  - leads_back\n"), ["leads back to itself"]),
    "default_of_nothing": (defaults(b"defaults:\n  - /evolution: nowhere\n"), ["evolution=nowhere: no such option"]),
    "default_number": (defaults(b"defaults: 3\n"), ["default_number.yaml: defaults: expected a list"]),
    "default_entry": (defaults(b"defaults: [3]\n"), ["default_entry.yaml: defaults: expected", "got 3"]),
    "no_package": (TASK.split(b"\n", 1)[1], ["generations: refers to budgets.smoke.generations"]),
    "ant": (TASK, ["task/ant.yaml", "rename yours"]),
    "mark": (b"\xef\xbb\xbf" + TASK, ["task/mark.yaml: begins with a byte order mark"]),
}


@pytest.mark.parametrize("name", [*ANYWHERE, *AS_TASK])
def test_a_task_file_that_cannot_be_used_is_refused_before_anything_is_made(
    name: str, tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    content, named = {**ANYWHERE, **AS_TASK}[name]
    path = tmp_path / "mine" / "task" / f"{name}.yaml"
    path.parent.mkdir(parents=True)
    path.write_bytes(content)
    where = [f"{name}.yaml"] if name in ANYWHERE else []
    command = ["train", "--config-dir", "mine", f"task={name}", "budget=smoke", "output=out"]
    check_refusal(command, [*where, *named], tmp_path, capfd)


@pytest.mark.parametrize("name", ANYWHERE)
def test_an_experiment_that_is_no_yaml_is_refused_with_its_line(
    name: str, tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    content, named = ANYWHERE[name]
    (tmp_path / "own.yaml").write_bytes(content)
    for command in ("sweep", "report"):
        check_refusal([command, "experiment=own.yaml", "output=out"], ["own.yaml", *named], tmp_path, capfd)


@pytest.mark.parametrize(
    ("flag", "path", "content", "named"),
    [
        ("--config-dir", "mine", b"x", ["mine: expected a directory with configuration files, got a file"]),
        ("--config-dir", "mine/config.yaml", b"seed: 1\n", ["rename yours"]),
        ("--config-dir", "mine/task/own.yml", TASK, ["Hydra passes over .yml; rename it to own.yaml"]),
        ("--config-dir", "mine/never_chosen.yaml", b"a: 1\na: 2\n", ["never_chosen.yaml:2: the key 'a' comes twice"]),
        ("--config-path", "mine/config.yaml", b"\tseed: 1\n", ["mine/config.yaml:1: expected YAML"]),
        (
            "--config-path",
            "mine/config.yaml",
            b"seed: 1\nseed: 2\n",
            ["mine/config.yaml:2: the key 'seed' comes twice"],
        ),
    ],
)
def test_a_directory_that_cannot_be_used_is_refused(
    flag: str,
    path: str,
    content: bytes,
    named: list[str],
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / path).write_bytes(content)
    check_refusal(["train", flag, "mine", "output=out"], named, tmp_path, capfd)


def test_a_pipe_in_the_directory_is_refused_instead_of_waited_for(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    os.mkfifo(tmp_path / "own.yaml")
    for command in (["train", "--config-dir", "."], ["sweep", "experiment=own.yaml"]):
        check_refusal([*command, "output=out"], ["own.yaml", "a pipe"], tmp_path, capfd)


EXPERIMENT = """claim: It works with mine.
settings: {task: track_maze, algorithm: random}
variants: {random: {label: random, settings: {}}}
conditions: {clean: {label: clean, settings: {}}}
runs: {smoke: 1}
"""


@pytest.mark.parametrize(
    "spell",
    [
        lambda text: text.replace(b"\n", b"\r\n"),
        lambda text: text + "# größe, 大きさ\n".encode(),
    ],
    ids=["crlf", "comment"],
)
def test_files_from_other_systems_and_places_with_spaces_or_links_are_taken(
    spell: object, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "my own files" / "task").mkdir(parents=True)
    (tmp_path / "real").mkdir()
    (tmp_path / "out puts").symlink_to(tmp_path / "real")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my own files" / "task" / "mine.yaml").write_bytes(spell(TASK))  # type: ignore[operator]
    own = ["--config-dir", "my own files", "task=mine", "algorithm=motionless", "budget=smoke"]
    monkeypatch.setattr("exneat_cli.commands.train.draw_what_is_missing", lambda *arguments, **options: None)
    monkeypatch.setattr("exneat_cli.commands.sweep.draw_what_is_missing", lambda *arguments, **options: None)
    assert main(["train", *own, "output=out puts"]) == 0
    (run,) = (tmp_path / "real" / "track_maze").iterdir()
    assert "size: 7" in (run / "config.yaml").read_text()
    (tmp_path / "my_experiment.yaml").write_bytes(spell(EXPERIMENT.encode()))  # type: ignore[operator]
    assert main(["sweep", "experiment=my_experiment.yaml", "budget=smoke", "output=out puts"]) == 0
    assert len(list((tmp_path / "real").glob("my_experiment-*/*"))) == 1


def test_what_a_task_file_sets_counts_more_than_the_default_and_less_than_the_command_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "mine" / "task").mkdir(parents=True)
    (tmp_path / "mine" / "task" / "own.yaml").write_bytes(TASK + b"name: my_mazes\nseed: 3\ntest_episodes: 3\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("exneat_cli.commands.train.draw_what_is_missing", lambda *arguments, **options: None)
    own = ["--config-dir", "mine", "task=own", "algorithm=motionless", "budget=smoke", "output=out", "seed=5"]
    assert main(["train", *own]) == 0
    (run,) = (tmp_path / "out" / "my_mazes").iterdir()
    written = yaml.safe_load((run / "config.yaml").read_text())
    assert (written["seed"], written["test_episodes"]) == (5, 3)
