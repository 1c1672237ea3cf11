"""Whether MuJoCo steps and renders on this machine, tried out in processes of their own.

A graphics driver, or a library of another version than the one compiled for, may take its process down.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import mujoco
import numpy as np

from exneat_cli.compiling import compiled
from exneat_cli.errors import ExneatError
from exneat_cli.tasks.robots.ant import AntTask
from exneat_cli.tasks.robots.mujoco_library import mj_step

STEPS = 100
"""Physics steps of 0.01 s: long enough for Ant to fall and touch the ground."""

_PHYSICS = "from exneat_cli.tasks.robots import simulator_trial; simulator_trial.print_physics()"
_FRAME = """
import json, mujoco
model = mujoco.MjModel.from_xml_string(
    '<mujoco><worldbody><light pos="0 0 3"/><geom size="1"/></worldbody></mujoco>')
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
with mujoco.Renderer(model, 240, 320) as renderer:
    renderer.update_scene(data)
    frame = renderer.render()
print(json.dumps({"brightest": int(frame.max())}))
"""


class Physics(NamedTuple):
    """How Ant runs here.

    Attributes:
        version: of MuJoCo.
        compiled: whether compiled code steps it; else Gymnasium does.
        because: why compiled code does not; empty if it does.
    """

    version: str
    compiled: bool
    because: str


def try_physics(seconds: float = 180.0) -> Physics:
    """Step Ant the way that training would, in a process of its own.

    Args:
        seconds: after which it is given up; the first time, a small function is compiled.

    Raises:
        ExneatError: it cannot be stepped, not even over Gymnasium, or it steps wrongly.
    """
    return Physics(**_in_own_process(_PHYSICS, seconds, {}))


def try_rendering(seconds: float = 60.0) -> str:
    """Draw one frame off-screen in a process of its own; returns the backend, e.g. ``egl``.

    The backend is MUJOCO_GL where that is set, else EGL, which needs no screen (on macOS MuJoCo's own choice).

    Args:
        seconds: after which it is given up.

    Raises:
        ExneatError: there was no frame, or a black one.
    """
    backend = os.environ.get("MUJOCO_GL") or ("egl" if sys.platform == "linux" else "")
    frame = _in_own_process(_FRAME, seconds, {"MUJOCO_GL": backend} if backend else {})
    if frame["brightest"] == 0:
        raise ExneatError("the frame is black")
    return backend or "MuJoCo's own choice"


def print_physics() -> None:
    """Print what `step_ant` finds, for the process that asked."""
    print(json.dumps(step_ant()._asdict()))


def step_ant() -> Physics:
    """Step Ant in this process, compiled if `AntTask.open` would.

    Raises:
        ExneatError: compiled code does not get what MuJoCo itself gets.
    """
    simulation = AntTask().open(training=False)
    _compare_with_bindings(simulation.owner)
    return Physics(mujoco.__version__, True, "")


def _compare_with_bindings(model_and_data: Any) -> None:
    model, data = model_and_data
    expected = mujoco.MjData(model)
    mujoco.mj_step(model, expected, STEPS)
    _advance(model._address, data._address, STEPS)
    if not np.array_equal(data.qpos, expected.qpos):
        raise ExneatError("compiled code steps MuJoCo otherwise than MuJoCo's own Python bindings")


@compiled
def _advance(model: int, data: int, steps: int) -> None:
    for _ in range(steps):
        mj_step(model, data)


def _in_own_process(code: str, seconds: float, environment: Mapping[str, str]) -> dict[str, Any]:
    """What the code prints last, read as JSON.

    Raises:
        ExneatError: it failed, crashed, or took too long.
    """
    # -P keeps files of the working directory from standing in for libraries; this very exneat may lie there, though.
    place = str(Path(__file__).parents[3])
    findable = f"import sys; sys.path[:0] = [] if {place!r} in sys.path else [{place!r}]\n"
    try:
        done = subprocess.run(
            [sys.executable, "-P", "-c", findable + code],
            env={**os.environ, **environment},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=seconds,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise ExneatError(f"no answer within {seconds:g} s") from None
    if done.returncode < 0:
        raise ExneatError(f"its process was ended by {signal.Signals(-done.returncode).name}")
    if done.returncode > 0:
        last = (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]
        raise ExneatError(last.removeprefix(f"{ExneatError.__module__}.{ExneatError.__name__}: "))
    answer: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return answer
