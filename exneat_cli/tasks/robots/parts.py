"""Which entries of a MuJoCo model's state and controls belong to which limb.

Works on any model whose trunk hangs on a free joint and whose limbs are the trunk's child bodies, with
observations laid out as Gymnasium's Ant lays them out: joint positions without the trunk's x and y,
joint velocities, then six external contact forces for every body but the world.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

SKIPPED_POSITIONS = 2
"""The trunk's x and y are left out of the observation, so that walking looks the same everywhere."""
FORCES_PER_BODY = 6
"""Entries of MuJoCo's `cfrc_ext` per body: three torques (N m), three forces (N)."""


@dataclass(frozen=True)
class Limb:
    """One limb, or the trunk: see `exneat_cli.tasks.task.Part` for the fields."""

    sensors: tuple[int, ...]
    actuators: tuple[int, ...]
    position: tuple[float, float]


def find_limbs(model: mujoco.MjModel) -> tuple[Limb, list[Limb]]:
    """The trunk, and the limbs in the order of the model's bodies.

    A limb stands where its first joint does in the model's initial pose, seen from the trunk, in metres.
    """
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    trunk = int(model.jnt_bodyid[np.flatnonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_FREE)[0]])
    roots = [body for body in range(model.nbody) if body != trunk and model.body_parentid[body] == trunk]
    limb_bodies = [_subtree(model, root) for root in roots]
    in_limbs = {body for bodies in limb_bodies for body in bodies}
    trunk_bodies = [body for body in range(1, model.nbody) if body not in in_limbs]
    limbs = []
    for bodies in limb_bodies:
        first_joint = np.flatnonzero(np.isin(model.jnt_bodyid, bodies))[0]
        x, y, _ = data.xanchor[first_joint] - data.xpos[trunk]
        limbs.append(Limb(_sensors(model, bodies), _actuators(model, bodies), (float(x), float(y))))
    return Limb(_sensors(model, trunk_bodies), _actuators(model, trunk_bodies), (0.0, 0.0)), limbs


def _subtree(model: mujoco.MjModel, root: int) -> list[int]:
    bodies = [root]
    for body in range(root + 1, model.nbody):
        if model.body_parentid[body] in bodies:
            bodies.append(body)
    return bodies


def _sensors(model: mujoco.MjModel, bodies: list[int]) -> tuple[int, ...]:
    first_velocity = model.nq - SKIPPED_POSITIONS
    first_force = first_velocity + model.nv
    sensors = []
    for joint in np.flatnonzero(np.isin(model.jnt_bodyid, bodies)):
        free = model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE
        positions = range(SKIPPED_POSITIONS, 7) if free else range(1)
        velocities = range(6) if free else range(1)
        sensors += [int(model.jnt_qposadr[joint]) + k - SKIPPED_POSITIONS for k in positions]
        sensors += [first_velocity + int(model.jnt_dofadr[joint]) + k for k in velocities]
    for body in bodies:
        sensors += [first_force + FORCES_PER_BODY * (body - 1) + k for k in range(FORCES_PER_BODY)]
    return tuple(sorted(sensors))


def _actuators(model: mujoco.MjModel, bodies: list[int]) -> tuple[int, ...]:
    joints = model.actuator_trnid[:, 0]
    return tuple(int(a) for a in range(model.nu) if model.jnt_bodyid[joints[a]] in bodies)
