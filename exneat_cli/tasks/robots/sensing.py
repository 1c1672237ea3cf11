"""Which sensed values belong to which part of a robot, in the world's axes or in the parts' own frames."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from exneat_cli.tasks.robots.body import Body, Limb
from exneat_cli.tasks.robots.frames import VIEW, Frames
from exneat_cli.tasks.robots.likeness import MIRROR, Pose, relate
from exneat_cli.tasks.robots.readings import FORCES, Readings, body_name, with_unit
from exneat_cli.tasks.task import Part


class Sensing(NamedTuple):
    """The sensed values, and the parts that sense them.

    Attributes:
        names: of all entries, with units. In the parts' own frames, entries with the same name have the same value.
        parts: in the body's order.
        trunk: the trunk's own entries, and the actuators of its own joints.
        frames: how readings become sensed values, where these differ.
    """

    names: tuple[str, ...]
    parts: tuple[Part, ...]
    trunk: Part
    frames: Frames


def in_the_world(model: mujoco.MjModel, body: Body, readings: Readings) -> Sensing:
    """Every part senses its readings unchanged."""

    def entries(joints: Iterable[int], bodies: Iterable[int]) -> tuple[list[int], list[int]]:
        moved = [_entries_of_joint(model, readings, joint) for joint in joints]
        positions, velocities = ([entry for each in moved for entry in each[kind]] for kind in (0, 1))
        forces = [first + k for first in readings.forces(bodies) for k in range(3 * len(FORCES))]
        return positions + velocities, forces

    core, core_forces = entries(_joints_of_core(model, body), body.core)
    trunk = Part("trunk", tuple(sorted(core)) + tuple(core_forces), _actuators_of_core(model, body), (0.0, 0.0))
    parts = []
    for limb in body.limbs:
        joints, forces = entries(limb.relation.joints, limb.relation.bodies)
        part = _part(limb, (*joints, *forces), joints, joints, trunk.sensors)
        parts.append(replace(part, is_mirrored=False))
    nothing = np.full((1, len(VIEW)), -1, np.int64)
    frames = _frames(model, body, readings, _Layout(model, readings), np.eye(3)[None], nothing)
    names = map(with_unit, readings.names, readings.units)
    return Sensing(tuple(names), tuple(parts), trunk, frames)


class _Layout:
    """The sensed values so far, and where each of them comes from."""

    def __init__(self, model: mujoco.MjModel, readings: Readings) -> None:
        self.model, self.readings = model, readings
        self.names: list[str] = []
        self.scalars: list[tuple[int, int, int]] = []
        self.vectors: list[tuple[int, int, int, bool]] = []

    def add(self, name: str, unit: str) -> int:
        self.names.append(with_unit(name, unit))
        return len(self.names) - 1

    def add_joints(self, joints: Sequence[int], signs: Sequence[int]) -> list[int]:
        """Positions of all joints, then their velocities; names begin with the sign."""
        found = []
        for kind in (0, 1):
            for joint, sign in zip(joints, signs, strict=True):
                for entry in _entries_of_joint(self.model, self.readings, joint)[kind]:
                    name = f"{'+-'[sign < 0]}{self.readings.names[entry]}".removeprefix("+")
                    found.append(self.add(name, self.readings.units[entry]))
                    self.scalars.append((entry, found[-1], sign))
        return found

    def add_forces(self, bodies: Iterable[int], frame: int, move: NDArray[np.float64]) -> list[int]:
        """Torque and force on each body, in the frame with this move."""
        found = []
        for body in bodies:
            for first in self.readings.forces([body]):
                for k, (what, unit) in enumerate(FORCES):
                    name, is_pseudo = f"{body_name(self.model, body)} contact {what}", what == "torque"
                    added = [self.add(f"{name}, {_direction(move, axis, is_pseudo)}", unit) for axis in range(3)]
                    self.vectors.append((first + 3 * k, added[0], frame, is_pseudo))
                    found += added
        return found


def in_own_frames(model: mujoco.MjModel, body: Body, readings: Readings) -> Sensing:
    """Every part senses its joints with their signs, and its contact forces and the trunk in its own frame."""
    pose, layout = Pose(model, body.trunk), _Layout(model, readings)
    moves: list[NDArray[np.float64]] = [np.eye(3)]
    frame_of = []
    for limb in body.limbs:
        known = [f for f, move in enumerate(moves) if np.allclose(move, limb.relation.move)]
        if not known:
            moves.append(limb.relation.move)
        frame_of.append(known[0] if known else len(moves) - 1)
    own = []
    for limb, frame in zip(body.limbs, frame_of, strict=True):
        joints = layout.add_joints(limb.relation.joints, limb.relation.joint_signs)
        own.append((joints, layout.add_forces(limb.relation.bodies, frame, moves[frame])))
    any_mirrored = any(np.linalg.det(move) < 0.0 for move in moves)
    seen_mirrored = [
        _mirrored_joints(pose, layout, limb, joints) if any_mirrored else joints
        for limb, (joints, _) in zip(body.limbs, own, strict=True)
    ]
    views = np.full((len(moves), len(VIEW)), -1, np.int64)
    trunk_blocks = []
    for frame, move in enumerate(moves):
        first = len(layout.names)
        for k in _varying(model, body):
            what, unit, axis, is_pseudo = VIEW[k]
            views[frame, k] = layout.add(what if axis < 0 else f"{what}, {_direction(move, axis, is_pseudo)}", unit)
        core = [joint for joint in _joints_of_core(model, body) if joint not in body.root]
        layout.add_joints(core, [_sign_under(pose, move, joint) for joint in core])
        layout.add_forces(body.core, frame, move)
        trunk_blocks.append(tuple(range(first, len(layout.names))))
    parts = tuple(
        _part(limb, (*joints, *forces), joints, mirrored, trunk_blocks[frame])
        for limb, frame, (joints, forces), mirrored in zip(body.limbs, frame_of, own, seen_mirrored, strict=True)
    )
    trunk = Part("trunk", trunk_blocks[0], _actuators_of_core(model, body), (0.0, 0.0))
    frames = _frames(model, body, readings, layout, np.array(moves), views)
    return Sensing(tuple(layout.names), parts, trunk, frames)


def _frames(
    model: mujoco.MjModel,
    body: Body,
    readings: Readings,
    layout: _Layout,
    moves: NDArray[np.float64],
    views: NDArray[np.int64],
) -> Frames:
    signs = np.ones(model.nu)
    for limb in body.limbs:
        signs[list(limb.relation.actuators)] = limb.relation.actuator_signs
    scalars = np.array(layout.scalars, np.int64).reshape(-1, 3)
    vectors = np.array(layout.vectors, np.int64).reshape(-1, 4)
    return Frames(
        **(_free_trunk if len(body.root) == 1 else _planar_trunk)(model, body, readings),
        moves=moves,
        views=views,
        scalar_from=scalars[:, 0].copy(),
        scalar_to=scalars[:, 1].copy(),
        scalar_sign=scalars[:, 2].astype(np.float64),
        vector_from=vectors[:, 0].copy(),
        vector_to=vectors[:, 1].copy(),
        vector_frame=vectors[:, 2].copy(),
        vector_is_pseudo=vectors[:, 3].astype(np.bool_),
        action_signs=signs,
    )


def _free_trunk(model: mujoco.MjModel, body: Body, readings: Readings) -> dict[str, Any]:
    """Where the trunk's height, orientation and velocities are read."""
    (root,) = body.root
    height, speed = readings.position(int(model.jnt_qposadr[root]) + 2), int(model.jnt_dofadr[root])
    return {
        "height": height,
        "above": 0.0,
        "orientation": height + 1,
        "free": True,
        "hinge": np.zeros(3),
        "velocities": np.array([readings.velocity(speed + k) for k in range(3)], np.int64),
        "axes": np.eye(3),
        "spin": readings.velocity(speed + 3),
    }


def _planar_trunk(model: mujoco.MjModel, body: Body, readings: Readings) -> dict[str, Any]:
    """The same for a trunk on two slides and a hinge."""
    pose = Pose(model, body.trunk)
    *slides, hinge = body.root
    rising = [j for j in slides if abs(pose.axes[j][2]) > 0.5]
    address = int(model.jnt_qposadr[rising[0]]) if rising else -1
    return {
        "height": readings.position(address) if rising else -1,
        "above": float(pose.height - model.qpos0[address]) if rising else 0.0,
        "orientation": readings.position(int(model.jnt_qposadr[hinge])),
        "free": False,
        "hinge": pose.axes[hinge].copy(),
        "velocities": np.array([readings.velocity(int(model.jnt_dofadr[j])) for j in slides], np.int64),
        "axes": pose.axes[slides],
        "spin": readings.velocity(int(model.jnt_dofadr[hinge])),
    }


def _varying(model: mujoco.MjModel, body: Body) -> list[int]:
    """Numbers of a view that can vary: for a planar trunk, vectors in the plane and turns about its normal."""
    if len(body.root) == 1:
        return list(range(len(VIEW)))
    normal = np.abs(model.jnt_axis[body.root[-1]]) > 0.5  # the hinge's axis
    upright = not normal[2]
    return [
        *([0] if upright else []),
        *(1 + k for k in range(3) if upright and not normal[k]),
        *(4 + k for k in range(3) if not normal[k]),
        *(7 + k for k in range(3) if not normal[k]),
        *(10 + k for k in range(3) if normal[k]),
    ]


def _mirrored_joints(pose: Pose, layout: _Layout, limb: Limb, joints: list[int]) -> list[int]:
    """The entries that a mirrored part reads of this one's joints: for a limb on the middle plane, with other signs."""
    bodies = limb.relation.bodies
    image = relate(pose, "mirror", MIRROR, bodies, bodies)
    if image is None:
        return joints
    signs = [own * sign for own, sign in zip(limb.relation.joint_signs, image.joint_signs, strict=True)]
    if image.joints == limb.relation.joints and signs == list(limb.relation.joint_signs):
        return joints
    return layout.add_joints(image.joints, signs)


def _direction(move: NDArray[np.float64], axis: int, is_pseudo: bool) -> str:
    """Where an axis of a frame points, seen from the trunk; pseudovectors are reversed in a mirrored frame."""
    handedness = np.linalg.det(move) if is_pseudo else 1.0
    x, y, z = move[:, axis] * handedness
    turns_about = "about " if is_pseudo else ""
    if abs(z) > 0.5:
        return turns_about + ("up" if z > 0.0 else "down")
    degrees = round(math.degrees(math.atan2(y, x)))
    named = {0: "forward", 90: "left", -90: "right", 180: "backward", -180: "backward"}
    return turns_about + named.get(degrees, f"{abs(degrees)} degrees {'left' if degrees > 0 else 'right'}")


def _sign_under(pose: Pose, move: NDArray[np.float64], joint: int) -> int:
    """-1 if a move reverses the axis of a joint of the trunk, 1 if it keeps the axis or maps it to another one."""
    axis, kind = pose.axes[joint], int(pose.model.jnt_type[joint])
    handedness = np.linalg.det(move) if kind != int(mujoco.mjtJoint.mjJNT_SLIDE) else 1.0
    return -1 if float(move @ axis @ axis) * handedness < -0.999 else 1


def _entries_of_joint(model: mujoco.MjModel, readings: Readings, joint: int) -> tuple[list[int], list[int]]:
    """Indices of the readings of a joint's positions, where they are read, and of its velocities."""
    widths = {int(mujoco.mjtJoint.mjJNT_FREE): (7, 6), int(mujoco.mjtJoint.mjJNT_BALL): (4, 3)}
    positions, velocities = widths.get(int(model.jnt_type[joint]), (1, 1))
    first, speed = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
    read = [readings.position(first + k) for k in range(positions)]
    return [entry for entry in read if entry >= 0], [readings.velocity(speed + k) for k in range(velocities)]


def _joints_of_core(model: mujoco.MjModel, body: Body) -> list[int]:
    return [joint for joint in range(model.njnt) if model.jnt_bodyid[joint] in body.core]


def _actuators_of_core(model: mujoco.MjModel, body: Body) -> tuple[int, ...]:
    core = _joints_of_core(model, body)
    return tuple(a for a in range(model.nu) if model.actuator_trnid[a, 0] in core)


def _part(
    limb: Limb, sensors: Sequence[int], joints: Sequence[int], mirrored: Sequence[int], trunk: Sequence[int]
) -> Part:
    x, y, z = limb.position
    return Part(
        limb.name,
        tuple(sensors),
        limb.relation.actuators,
        (x, y),
        height=z,
        likeness=limb.likeness,
        is_mirrored=limb.relation.name == "mirror",
        joints=tuple(joints),
        mirrored_joints=tuple(mirrored),
        trunk=tuple(trunk),
    )
