"""Trying out MuJoCo in processes of their own."""

from __future__ import annotations

from pathlib import Path

import pytest

from exneat_cli.errors import ExneatError
from exneat_cli.tasks.robots import ant, mujoco_library, simulator_trial
from exneat_cli.tasks.robots.simulator_trial import step_ant, try_physics, try_rendering


@pytest.fixture
def unreachable(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mujoco_library, "unreachable_because", lambda: "no MuJoCo library beside its Python bindings")


def test_compiled_code_steps_as_the_bindings_do_wherever_training_would_use_it() -> None:
    physics = step_ant()
    assert physics.compiled == (mujoco_library.unreachable_because() is None)
    assert bool(physics.because) != physics.compiled


@pytest.mark.usefixtures("unreachable")
def test_without_the_library_ant_steps_over_gymnasium_and_the_reason_is_told() -> None:
    physics = step_ant()
    assert not physics.compiled
    assert physics.because == "no MuJoCo library beside its Python bindings"


@pytest.mark.usefixtures("unreachable")
def test_where_gymnasium_fails_too_nothing_is_claimed(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*arguments: object, **options: object) -> None:
        raise RuntimeError("no Ant-v5")

    monkeypatch.setattr(ant.ant_gymnasium.gymnasium, "make", fail)
    with pytest.raises(RuntimeError, match="no Ant-v5"):
        step_ant()


def test_steps_that_differ_from_the_bindings_are_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(simulator_trial, "_advance", lambda model, data, steps: None)
    monkeypatch.setattr(mujoco_library, "unreachable_because", lambda: None)
    with pytest.raises(ExneatError, match="otherwise than MuJoCo's own"):
        step_ant()


def test_without_compilation_stepping_from_compiled_code_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
    if mujoco_library.unreachable_because() is not None:
        pytest.skip("compiled code cannot reach MuJoCo here")
    with pytest.raises(ExneatError, match=r"^compiled code steps MuJoCo otherwise"):
        try_physics()


def test_a_backend_that_cannot_draw_is_an_error_in_words(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MUJOCO_GL", "off")
    with pytest.raises(ExneatError, match="GLContext"):
        try_rendering()


@pytest.mark.parametrize(
    ("code", "message"),
    [
        ("import os; os.abort()", "its process was ended by SIGABRT"),
        ("import time; time.sleep(60)", "no answer within 0.5 s"),
        ("raise SystemExit(3)", "exit code 3"),
        ("print('{\"brightest\": 0}')", "the frame is black"),
    ],
)
def test_a_process_that_dies_hangs_or_draws_nothing_is_an_error_in_words(
    code: str, message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(simulator_trial, "_FRAME", code)
    with pytest.raises(ExneatError, match=message):
        try_rendering(seconds=0.5 if "sleep" in code else 60.0)


def test_egl_is_asked_for_unless_another_backend_is_chosen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(simulator_trial.sys, "platform", "linux")
    monkeypatch.setattr(
        simulator_trial, "_FRAME", "import json, os; print(json.dumps({'brightest': os.environ['MUJOCO_GL'] == 'egl'}))"
    )
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    assert try_rendering() == "egl"
    monkeypatch.setenv("MUJOCO_GL", "glfw")
    with pytest.raises(ExneatError, match="black"):
        try_rendering()


def test_files_of_the_working_directory_do_not_stand_in_for_libraries(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "json.py").write_text("raise RuntimeError('the wrong json')")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(simulator_trial, "_FRAME", "import json; print(json.dumps({'brightest': 1}))")
    monkeypatch.setenv("MUJOCO_GL", "egl")
    assert try_rendering() == "egl"
