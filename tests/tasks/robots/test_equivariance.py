"""Equivariance: relabelled legs sense, act and move the same, and so do mirrored ones in a reflected world."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, NamedTuple

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from exneat_cli.tasks import FAILED, RobotTask
from exneat_cli.wiring import LINKAGES

BAR = 1e-9
STEPS = 20
MIRROR = np.array([1.0, -1.0, 1.0])


class Symmetry(NamedTuple):
    """A relabelling of a body, worked out by hand (see test_body).

    Attributes:
        angle: that the trunk's frame turns by; None reflects the world instead.
        parts: whose observations each part takes over.
        joints: whose position, velocity and torque each joint takes over, times a sign.
    """

    angle: float | None
    parts: dict[str, str]
    joints: dict[str, tuple[str, int]]


def ring(*names: str) -> dict[str, str]:
    """Each one takes over from the next."""
    return dict(zip(names, (*names[1:], names[0]), strict=True))


def both_ways(sign: int, pairs: dict[str, str]) -> dict[str, tuple[str, int]]:
    return {a: (b, sign) for one, other in pairs.items() for a, b in ((one, other), (other, one))}


# Counter-clockwise from front left: legs 1, 2, 3, 4, of which 2 and 3 have their ankles the other way round.
ANT_TURN = Symmetry(
    math.pi / 2,
    ring("front_left", "back_left", "back_right", "front_right"),
    {hip: (other, 1) for hip, other in ring("hip_1", "hip_2", "hip_3", "hip_4").items()}
    | {"ankle_1": ("ankle_2", -1), "ankle_2": ("ankle_3", 1), "ankle_3": ("ankle_4", -1), "ankle_4": ("ankle_1", 1)},
)
SIXTHS = ring("front_left", "middle_left", "back_left", "back_right", "middle_right", "front_right")
HEXAPOD_TURN = Symmetry(
    math.pi / 3,
    SIXTHS,
    {f"{leg}_{joint}": (f"{other}_{joint}", 1) for leg, other in SIXTHS.items() for joint in ("hip", "knee")},
)
SIDES = ring("front_left", "front_right") | ring("back_left", "back_right")
ANT_MIRROR = Symmetry(
    None,
    SIDES,
    both_ways(-1, {"hip_1": "hip_4", "hip_2": "hip_3"}) | both_ways(1, {"ankle_1": "ankle_4", "ankle_2": "ankle_3"}),
)
# Legs roll about x, which a mirroring reverses, and swing about y, which it keeps; right knees are reversed.
DOG_MIRROR = Symmetry(
    None,
    SIDES,
    {
        f"{leg}_{joint}": (f"{other}_{joint}", s)
        for leg, other in SIDES.items()
        for joint, s in (("roll", -1), ("swing", 1), ("knee", -1))
    }
    | {"yaw": ("yaw", -1), "pitch": ("pitch", 1)},
)
HUMANOID_MIRROR = Symmetry(
    None,
    ring("left_upper_arm", "right_upper_arm") | ring("left_thigh", "right_thigh"),
    both_ways(-1, {f"left_{joint}": f"right_{joint}" for joint in ("shoulder1", "shoulder2")})
    | both_ways(1, {f"left_{joint}": f"right_{joint}" for joint in ("elbow", "hip_x", "hip_y", "hip_z", "knee")})
    | {"abdomen_x": ("abdomen_x", -1), "abdomen_y": ("abdomen_y", 1), "abdomen_z": ("abdomen_z", -1)},
)


def dog_leg(name: str, x: float, side: int) -> str:
    roll, knee = ("-20 40", "-80 60") if side > 0 else ("-40 20", "-60 80")
    return f"""<body name="{name}" pos="{x} {0.12 * side} 0"><joint name="{name}_roll" axis="1 0 0" range="{roll}"/>
        <geom fromto="0 0 0 0 {0.05 * side} 0"/><body pos="0 {0.05 * side} 0">
          <joint name="{name}_swing" axis="0 1 0" range="-60 60"/><geom fromto="0 0 0 0 0 -.25"/>
          <body pos="0 0 -.25"><joint name="{name}_knee" axis="0 {side} 0" range="{knee}"/>
            <geom fromto="0 0 0 .05 0 -.25"/></body></body></body>"""


@pytest.fixture(scope="module")
def dog(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A quadruped with left and right legs that mirror each other, front and back ones alike, and a tail."""
    legs = {
        f"{end}_{side}": (x, s)
        for end, x in (("front", 0.3), ("back", -0.3))
        for side, s in (("left", 1), ("right", -1))
    }
    motors = "".join(
        f'<motor joint="{leg}_{joint}" gear="{-20 if (joint, side) == ("knee", -1) else 20}"/>'
        for leg, (_, side) in legs.items()
        for joint in ("roll", "swing", "knee")
    )
    text = f"""<mujoco><compiler autolimits="true"/><option timestep="0.01"/>
      <default><geom type="capsule" size=".03" conaffinity="0"/><joint damping="1" armature=".02"/>
        <motor ctrlrange="-1 1"/></default>
      <worldbody><geom type="plane" size="9 9 1" conaffinity="1"/><body name="trunk" pos="0 0 .55"><freejoint/>
        <geom type="box" size=".3 .1 .06"/>{"".join(dog_leg(leg, *place) for leg, place in legs.items())}
        <body name="tail" pos="-.3 0 .05"><joint name="yaw" axis="0 0 1"/><joint name="pitch" axis="0 1 0"/>
          <geom fromto="0 0 0 -.3 0 .1"/></body></body></worldbody>
      <actuator>{motors}<motor joint="yaw" gear="5"/><motor joint="pitch" gear="5"/></actuator></mujoco>"""
    path: Path = tmp_path_factory.mktemp("models") / "dog.xml"
    path.write_text(text, encoding="utf-8")
    return str(path)


class Robot:
    """A robot with one network for all parts of the same size, wired by ``linkage=joints`` and ``trunk=shared``.

    A part on the middle plane has no partner, so it gets no torque.
    """

    def __init__(self, model: str, symmetry: str | None = None) -> None:
        self.task = RobotTask(model=model, symmetry=symmetry, frame="part", contact_forces=True)
        self.simulation = self.task.open(training=False)
        self.world = self.simulation.world
        self.model: Any
        self.data: Any
        self.model, self.data = self.simulation.owner  # type: ignore[misc]

    def start(self, qpos: NDArray[np.float64], qvel: NDArray[np.float64]) -> None:
        self.simulation.reset(self.world, np.random.default_rng(0))
        self.world.qpos[:], self.world.qvel[:] = qpos, qvel
        mujoco.mj_forward(self.model, self.data)
        mujoco.mj_rnePostConstraint(self.model, self.data)

    def read(self) -> NDArray[np.float64]:
        readings = np.zeros(self.task.observation_size)
        self.simulation.observe(self.world, readings)
        return readings

    def sense(self, readings: NDArray[np.float64]) -> NDArray[np.float64]:
        sensed = np.zeros(self.task.sensed_size)
        assert self.simulation.sense is not None
        self.simulation.sense(self.world, readings, sensed)
        return sensed

    def act(self) -> tuple[dict[str, NDArray[np.float64]], NDArray[np.float64]]:
        """What each part's network is told, and the action that follows."""
        sensed, told, action = self.sense(self.read()), {}, np.zeros(self.model.nu)
        outputs = [len(part.actuators) for part in self.task.parts]
        for own, part in enumerate(self.task.parts):
            peers = [pin.index for pin in LINKAGES["joints"](self.task.parts, own, outputs, 0)]
            told[part.name] = sensed[[*part.sensors, *part.trunk, *peers]]
            if abs(part.position[1]) > 1e-6:
                shape = len(part.actuators), told[part.name].size
                weights = np.random.default_rng(shape).normal(0.0, 0.03, shape)
                action[list(part.actuators)] = np.tanh(weights @ told[part.name])
        assert self.simulation.drive is not None
        self.simulation.drive(self.world, action)
        return told, action

    def torques(self, action: NDArray[np.float64]) -> dict[str, float]:
        """N m by joint, from MuJoCo's own gears and ranges."""
        joints = [self.model.joint(joint).name for joint in self.model.actuator_trnid[:, 0]]
        span = self.model.actuator_ctrlrange[:, 1]
        return dict(zip(joints, self.model.actuator_gear[:, 0] * span * action, strict=True))


def relabelled(
    model: Any, symmetry: Symmetry, qpos: NDArray[np.float64], qvel: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The state in which the picture is the same, or its reflection, and every limb is where another one was."""
    new_qpos, new_qvel = qpos.copy(), qvel.copy()
    if symmetry.angle is None:
        new_qpos[:3] *= MIRROR
        new_qpos[3:7] *= (1, -1, 1, -1)
        new_qvel[:3] *= MIRROR
        new_qvel[3:6] *= -MIRROR
    else:
        half = 0.5 * symmetry.angle
        mujoco.mju_mulQuat(new_qpos[3:7], qpos[3:7], np.array([math.cos(half), 0.0, 0.0, math.sin(half)]))
        new_qvel[3:6] = Rotation.from_euler("z", -symmetry.angle).apply(qvel[3:6])
    for joint, (source, sign) in symmetry.joints.items():
        to, of = model.joint(joint), model.joint(source)
        new_qpos[to.qposadr], new_qvel[to.dofadr] = sign * qpos[of.qposadr], sign * qvel[of.dofadr]
    return new_qpos, new_qvel


def any_state(model: Any, seed: int, height: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """A tilted trunk, joints around the middle of their ranges, and all in motion."""
    rng, qpos = np.random.default_rng(seed), model.qpos0.copy()
    hinges = model.jnt_qposadr[model.jnt_limited > 0]
    qpos[hinges] = model.jnt_range[model.jnt_limited > 0].mean(axis=1)
    qpos += rng.uniform(-0.3, 0.3, model.nq)
    qpos[2] = height
    qpos[3:7] = Rotation.from_euler("zyx", rng.uniform((-3.0, -0.2, -0.2), (3.0, 0.2, 0.2))).as_quat(scalar_first=True)
    return qpos, rng.normal(size=model.nv)


def compare_acts(symmetry: Symmetry, one: Robot, other: Robot) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The actions of a robot and of its relabelled twin, once what led to them and their torques have been compared."""
    (told, action), (other_told, other_action) = one.act(), other.act()
    for part, source in symmetry.parts.items():
        np.testing.assert_allclose(other_told[part], told[source], rtol=0, atol=BAR, err_msg=part)
    torques, other_torques = one.torques(action), other.torques(other_action)
    assert action.any()
    for joint, (source, sign) in symmetry.joints.items():
        if joint in torques:
            assert other_torques[joint] == pytest.approx(sign * torques[source], abs=BAR), joint
    return action, other_action


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    ("model", "frames", "symmetry", "height"),
    [
        ("ant", "turn", ANT_TURN, 0.6),
        ("hexapod", "turn", HEXAPOD_TURN, 0.65),
        ("ant", "mirror", ANT_MIRROR, 0.6),
        ("dog", None, DOG_MIRROR, 0.5),
    ],
)
def test_a_relabelled_robot_senses_the_same_acts_the_same_and_moves_the_same(
    dog: str, model: str, frames: str | None, symmetry: Symmetry, height: float, seed: int
) -> None:
    path = dog if model == "dog" else model
    one, other, terms = Robot(path, frames), Robot(path, frames), np.zeros(4)
    touched, strongest = 0, 0.0
    start = any_state(one.model, seed, height)
    one.start(*start)
    other.start(*relabelled(one.model, symmetry, *start))
    for _ in range(STEPS):
        for robot, action in zip((one, other), compare_acts(symmetry, one, other), strict=True):
            assert robot.simulation.step(robot.world, action, terms) != FAILED
            strongest = max(strongest, np.abs(action).max())
        expected = relabelled(one.model, symmetry, one.data.qpos, one.data.qvel)
        np.testing.assert_allclose(np.concatenate(expected), np.r_[other.data.qpos, other.data.qvel], rtol=0, atol=BAR)
        touched += bool(one.data.cfrc_ext[2:].any())
    assert touched > 2
    assert strongest > 0.3


@pytest.fixture(scope="module")
def humanoids() -> tuple[Robot, Robot]:
    return Robot("humanoid"), Robot("humanoid")


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_a_mirrored_humanoid_senses_and_acts_the_same(humanoids: tuple[Robot, Robot], seed: int) -> None:
    one, other = humanoids
    start = any_state(one.model, seed, 1.3)
    one.start(*start)
    other.start(*relabelled(one.model, HUMANOID_MIRROR, *start))
    forces = np.random.default_rng(seed).uniform(-1.0, 1.0, one.data.cfrc_ext.shape)
    one.data.cfrc_ext[:] = forces
    for body in range(one.model.nbody):
        name = one.model.body(body).name
        side = name.replace("left", "*").replace("right", "left").replace("*", "right")
        other.data.cfrc_ext[body] = forces[one.model.body(side).id] * np.r_[-MIRROR, MIRROR]
    compare_acts(HUMANOID_MIRROR, one, other)


def test_a_mirrored_part_sees_a_tail_that_wags_to_the_other_side(dog: str) -> None:
    robot = Robot(dog)
    tail = next(part for part in robot.task.parts if part.name == "tail")
    yaw, pitch = robot.model.joint("yaw"), robot.model.joint("pitch")
    robot.world.qpos[[yaw.qposadr[0], pitch.qposadr[0]]] = 0.1, 0.2
    robot.world.qvel[[yaw.dofadr[0], pitch.dofadr[0]]] = 0.3, 0.4
    sensed = robot.sense(robot.read())
    assert sensed[list(tail.joints)].tolist() == [0.1, 0.2, 0.3, 0.4]
    assert sensed[list(tail.mirrored_joints)].tolist() == [-0.1, 0.2, -0.3, 0.4]
