"""What parts sense in their own frames, against MuJoCo's and SciPy's own geometry."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from exneat_cli.tasks import RobotTask, Simulation

BAR = 1e-9
MIRROR = np.diag([1.0, -1.0, 1.0])
MIRRORED = "mirrored"

FRAMES: list[tuple[str, str | None, dict[str, Any]]] = [
    ("ant", "turn", {"front_left": 0, "back_left": 90, "back_right": 180, "front_right": 270}),
    ("ant", "mirror", {"front_left": 0, "back_left": 0, "front_right": MIRRORED, "back_right": MIRRORED}),
    (
        "hexapod",
        "turn",
        {
            "front_left": 0,
            "middle_left": 60,
            "back_left": 120,
            "back_right": 180,
            "middle_right": 240,
            "front_right": 300,
        },
    ),
    ("humanoid", None, {"left_thigh": 0, "left_upper_arm": 0, "right_thigh": MIRRORED, "right_upper_arm": MIRRORED}),
    ("half_cheetah", None, {"fthigh": 0, "bthigh": 0}),
    ("hopper", None, {"thigh": 0}),
    ("walker2d", None, {"thigh": 0, "thigh_left": 0}),
    ("swimmer", None, {"mid": 0}),
]
"""Degrees that turn the trunk's frame into each part's."""
AXES = {
    0: ("forward", "left", "up"),
    60: ("60 degrees left", "150 degrees left", "up"),
    90: ("left", "backward", "up"),
    120: ("120 degrees left", "150 degrees right", "up"),
    180: ("backward", "right", "up"),
    240: ("120 degrees right", "30 degrees right", "up"),
    270: ("right", "forward", "up"),
    300: ("60 degrees right", "30 degrees left", "up"),
    MIRRORED: ("forward", "right", "up"),
}
"""What the axes of these frames are called."""
TURNS = {frame: tuple(f"about {way}" for way in ways) for frame, ways in AXES.items()}
TURNS[MIRRORED] = ("about backward", "about left", "about down")
"""What the axes of torques and angular velocities are called: those of a mirrored frame count the other way."""
IN_THE_AIR = {"trunk height", "direction of gravity, forward", "direction of gravity, up"}
ACROSS = {f"{what}, {way}" for what in ("direction of travel", "trunk velocity") for way in ("forward", "up")}
ACROSS.add("trunk angular velocity, about left")
ON_THE_GROUND = {f"{what}, {way}" for what in ("direction of travel", "trunk velocity") for way in ("forward", "left")}
ON_THE_GROUND.add("trunk angular velocity, about up")
SEEN = dict.fromkeys(("half_cheetah", "hopper", "walker2d"), IN_THE_AIR | ACROSS) | {"swimmer": ON_THE_GROUND}
"""What of the trunk varies in a plane; all of it does elsewhere."""


def sense(task: RobotTask, simulation: Simulation, readings: NDArray[np.float64]) -> NDArray[np.float64]:
    sensed = np.zeros(task.sensed_size)
    assert simulation.sense is not None
    simulation.sense(simulation.world, readings, sensed)
    return sensed


def view(model: Any, data: Any, frame: Any) -> dict[str, float]:
    """What MuJoCo says of the trunk and of the contacts of all bodies, in a frame of `AXES`."""
    turn = MIRROR if frame == MIRRORED else Rotation.from_euler("z", -frame, degrees=True).as_matrix()
    trunk, twist = int(model.jnt_bodyid[0]), np.zeros(6)
    mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, trunk, twist, 1)
    axes, pseudo = data.xmat[trunk].reshape(3, 3), turn * np.linalg.det(turn)
    vectors = {
        "direction of gravity": turn @ axes.T @ [0.0, 0.0, -1.0],
        "direction of travel": turn @ axes.T @ [1.0, 0.0, 0.0],
        "trunk velocity": turn @ twist[3:],
        "trunk angular velocity": pseudo @ twist[:3],
    }
    for body in range(1, model.nbody):
        name = f"{model.body(body).name or f'body {body}'} contact"
        vectors[f"{name} torque"] = pseudo @ axes.T @ data.cfrc_ext[body, :3]
        vectors[f"{name} force"] = turn @ axes.T @ data.cfrc_ext[body, 3:]
    numbers = {}
    for name, vector in vectors.items():
        ways = TURNS if name.endswith(("angular velocity", "torque")) else AXES
        numbers |= {f"{name}, {way}": vector[i] for i, way in enumerate(ways[frame])}
    return {"trunk height": data.xpos[trunk, 2], **numbers}


@pytest.mark.parametrize(("name", "symmetry", "frames"), FRAMES)
def test_a_part_sees_mujocos_trunk_and_contacts_turned_or_mirrored_into_its_frame(
    name: str, symmetry: str | None, frames: dict[str, Any]
) -> None:
    task = RobotTask(model=name, symmetry=symmetry, frame="part", contact_forces=True)
    simulation, rng = task.open(training=False), np.random.default_rng(1)
    model, data = simulation.owner  # type: ignore[misc]
    data.qpos[:], data.qvel[:] = rng.uniform(-1.0, 1.0, model.nq), rng.normal(size=model.nv)
    mujoco.mj_forward(model, data)
    data.cfrc_ext[:] = rng.uniform(-1.0, 1.0, data.cfrc_ext.shape)
    readings = np.zeros(task.observation_size)
    simulation.observe(simulation.world, readings)
    sensed = sense(task, simulation, readings)
    touched: set[str] = set()
    for part in task.parts:
        expected = view(model, data, frames[part.name])
        seen = set()
        for entry in (*part.trunk, *(set(part.sensors) - set(part.joints))):
            what = task.sensor_names[entry].split(" (")[0]
            if what in expected:
                assert sensed[entry] == pytest.approx(expected[what], abs=BAR), f"{part.name}: {what}"
                seen.add(what)
        contacts = {what for what in seen if "contact" in what}
        assert seen - contacts == SEEN.get(name, {what for what in expected if "contact" not in what})
        touched_by = {what.split(" contact")[0] for what in contacts}
        assert contacts == {what for what in expected if what.split(" contact")[0] in touched_by}
        touched |= touched_by
    assert touched == {what.split(" contact")[0] for what in expected if "contact" in what}


@pytest.fixture(scope="module")
def ant() -> tuple[RobotTask, Simulation]:
    task = RobotTask(model="ant", symmetry="turn", frame="part")
    return task, task.open(training=False)


@settings(max_examples=30, deadline=None)
@given(scale=st.floats(0.1, 10.0), seed=st.integers(0, 2**32 - 1))
def test_a_quaternion_that_noise_has_scaled_gives_the_same_view(
    ant: tuple[RobotTask, Simulation], scale: float, seed: int
) -> None:
    readings = np.random.default_rng(seed).normal(size=ant[0].observation_size)
    scaled = readings.copy()
    scaled[1:5] *= scale
    np.testing.assert_allclose(sense(*ant, scaled), sense(*ant, readings), rtol=0, atol=BAR)
