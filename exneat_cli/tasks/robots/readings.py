"""What a robot's sensors read, entry by entry: positions, velocities and contact forces, with names and units."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from exneat_cli.tasks.robots.body import Body, printable, subtree

FORCES = (("torque", "N m"), ("force", "N"))
"""Vectors of MuJoCo's `cfrc_ext` for each body, three entries each, in the world's axes."""
_FREE, _SLIDE = int(mujoco.mjtJoint.mjJNT_FREE), int(mujoco.mjtJoint.mjJNT_SLIDE)


class Readings(NamedTuple):
    """The entries of an observation: positions first, then velocities, then contact forces.

    Attributes:
        names: of all entries, without units.
        units: of all entries; empty for those without one.
        positions: entries of `qpos` that are read, in order: all except the root's place on the ground.
        velocities: entries of `qvel` that are read.
        bodies: those whose contact forces are read, six each; empty if none are sensed.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    positions: NDArray[np.int64]
    velocities: NDArray[np.int64]
    bodies: NDArray[np.int64]

    def position(self, address: int) -> int:
        """Index of the reading of an entry of `qpos`; -1 if it is not read."""
        found = np.flatnonzero(self.positions == address)
        return int(found[0]) if found.size else -1

    def velocity(self, address: int) -> int:
        """Index of the reading of an entry of `qvel`."""
        return len(self.positions) + int(np.flatnonzero(self.velocities == address)[0])

    def forces(self, bodies: Iterable[int]) -> list[int]:
        """Index of the first of the six contact forces of each body whose contact forces are sensed."""
        first = len(self.positions) + len(self.velocities)
        sensed = self.bodies.tolist()
        return [first + 3 * len(FORCES) * sensed.index(body) for body in bodies if body in sensed]


def with_unit(name: str, unit: str) -> str:
    """A name with its unit in brackets, if it has one."""
    return f"{name} ({unit})" if unit else name


def body_name(model: mujoco.MjModel, body: int) -> str:
    """A body's name in the names of sensors."""
    return printable(model.body(body).name) or f"body {body}"


def joint_name(model: mujoco.MjModel, joint: int) -> str:
    """A joint's name in the names of sensors and actuators."""
    return printable(model.joint(joint).name) or f"joint {joint}"


def actuator_names(model: mujoco.MjModel) -> tuple[str, ...]:
    """The joint that each actuator drives, and the torque or force of a motor at an action of 1."""
    named = []
    for actuator, joint in enumerate(model.actuator_trnid[:, 0].tolist()):
        name, unit = joint_name(model, joint), "N" if model.jnt_type[joint] == _SLIDE else "N m"
        rules = (model.actuator_gaintype, model.actuator_biastype, model.actuator_dyntype)
        if not any(int(rule[actuator]) for rule in rules):  # all fixed or none: a motor
            highest = float(model.actuator_ctrlrange[actuator, 1]) if model.actuator_ctrllimited[actuator] else 1.0
            gear = float(model.actuator_gear[actuator, 0])
            name += f" ({highest * gear * float(model.actuator_gainprm[actuator, 0]):g} {unit})"
        named.append(name)
    return tuple(named)


def read_off(model: mujoco.MjModel, body: Body, *, contact_forces: bool) -> Readings:
    """The readings of a robot: all joints of its bodies, except the place on the ground, x and y."""
    bodies = subtree(model, body.trunk)
    positions: list[tuple[int, str, str]] = []
    velocities: list[tuple[int, str, str]] = []
    for joint in (j for j in range(model.njnt) if model.jnt_bodyid[j] in bodies):
        first, speed, kind = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint]), int(model.jnt_type[joint])
        name, length = joint_name(model, joint), "m" if kind == _SLIDE else "rad"
        if kind == _FREE:
            turned = [(first + 3 + k, f"trunk orientation {axis}", "") for k, axis in enumerate("wxyz")]
            positions += [(first + 2, "trunk height", "m"), *turned]
            velocities += [(speed + k, f"trunk velocity {axis}", "m/s") for k, axis in enumerate("xyz")]
            velocities += [(speed + 3 + k, f"trunk angular velocity {axis}", "rad/s") for k, axis in enumerate("xyz")]
        elif kind == int(mujoco.mjtJoint.mjJNT_BALL):
            positions += [(first + k, f"{name} orientation {axis}", "") for k, axis in enumerate("wxyz")]
            velocities += [(speed + k, f"{name} angular velocity {axis}", "rad/s") for k, axis in enumerate("xyz")]
        else:
            if joint not in body.root or kind != _SLIDE or abs(model.jnt_axis[joint][2]) > 0.5:
                positions.append((first, f"{name} position", length))
            velocities.append((speed, f"{name} velocity", f"{length}/s"))
    forced = bodies if contact_forces else []
    forces = [
        (0, f"{body_name(model, b)} contact {what} {axis}", unit)
        for b in forced
        for what, unit in FORCES
        for axis in "xyz"
    ]
    _, names, units = zip(*positions, *velocities, *forces, strict=True)
    indices = [np.array(each, np.int64) for each in ([p[0] for p in positions], [v[0] for v in velocities], forced)]
    return Readings(names, units, *indices)
