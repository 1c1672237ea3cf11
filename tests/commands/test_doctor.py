"""`exneat doctor`: each state of each line, its remedy, the exit code, and nothing left behind."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from exneat_cli.commands import doctor
from exneat_cli.errors import ExneatError
from exneat_cli.main import main

CHECKS = ["python", "packages", "loading", "compiled MuJoCo", "rendering", "compile cache", "output root", "memory"]
LINE = re.compile(r"^(ok|degraded|broken) +(\S+(?: \S+)*?)(?:  +|$)", re.MULTILINE)
Ask = Callable[..., tuple[int, dict[str, str], str]]


@pytest.fixture
def ask(tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Ask:
    """Runs the doctor, with processes of its own that answer at once; gives exit code, states and all that it said."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(doctor, "said_by", lambda *arguments, **environment: "fine")

    def asked(*arguments: str) -> tuple[int, dict[str, str], str]:
        code = main(["doctor", *arguments])
        said = capfd.readouterr()
        assert not said.err
        states = {name: state for state, name in LINE.findall(said.out)}
        assert said.out.count("remedy: ") == sum(state != "ok" for state in states.values())
        assert code == (1 if "broken" in states.values() else 0)
        return code, states, said.out

    return asked


def test_a_sound_machine_gets_a_line_for_everything_and_keeps_no_trace(ask: Ask, tmp_path: Path) -> None:
    code, states, said = ask()
    assert code == 0
    assert list(states) == [*CHECKS, "disk space"]
    assert set(states.values()) == {"ok"}
    assert said.endswith("9 ok, 0 degraded, 0 broken: this machine can run exneat.\n")
    assert not list(tmp_path.iterdir())


def test_this_very_machine_steps_mujoco_from_compiled_code() -> None:
    assert "steps from compiled code" in doctor.said_by(["-c", doctor._PHYSICS])


@pytest.mark.parametrize(
    ("name", "function", "state"),
    [
        ("packages", "said_by", "degraded"),
        ("compiled MuJoCo", "said_by", "broken"),
        ("rendering", "said_by", "degraded"),
        ("compile cache", "_cache", "degraded"),
        ("output root", "_output", "broken"),
        ("memory", "_memory", "degraded"),
        ("disk space", "_disk_space", "degraded"),
    ],
)
def test_what_fails_has_its_state_and_remedy_and_the_rest_is_looked_at(
    ask: Ask, monkeypatch: pytest.MonkeyPatch, name: str, function: str, state: str
) -> None:
    def fail(*arguments: object, **options: object) -> str:
        raise ExneatError("it does not work")

    monkeypatch.setattr(doctor, function, fail)
    _, states, said = ask()
    assert states[name] == state
    assert f"{name}  " in said
    assert len(states) == 9


def test_a_part_that_cannot_be_loaded_ends_the_visit(ask: Ask, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "_ROOMS", ("exneat_cli.no_such_room",))
    code, states, said = ask()
    assert code == 1
    assert list(states) == ["python", "packages", "loading"]
    assert "No module named 'exneat_cli.no_such_room'" in said


def test_little_memory_or_disk_is_degraded(ask: Ask, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "LEAST", 10**18)
    code, states, _ = ask()
    assert code == 0
    assert (states["memory"], states["disk space"]) == ("degraded", "degraded")


def test_an_output_root_that_is_a_file_is_broken(ask: Ask, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    code, states, _ = ask(f"output={tmp_path / 'file'}")
    assert code == 1
    assert states["output root"] == "broken"


@pytest.mark.parametrize(
    ("code", "words"),
    [
        ("raise SystemExit('no frame')", "no frame"),
        ("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)", "killed by SIGSEGV"),
        ("import time; time.sleep(60)", "no answer within 0.5 s"),
    ],
)
def test_a_process_that_fails_crashes_or_hangs_is_an_error_in_words(code: str, words: str) -> None:
    with pytest.raises(ExneatError, match=words):
        doctor.said_by(["-c", code], 0.5)
