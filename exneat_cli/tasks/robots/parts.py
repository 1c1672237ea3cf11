"""Which entries of a MuJoCo model's state and controls belong to which part of the body.

Works on any model whose trunk hangs on a free joint and whose parts are the trunk's child bodies, with
observations laid out as Gymnasium's Ant lays them out: joint positions without the trunk's x and y,
joint velocities, then six external contact forces for every body but the world.
"""

from __future__ import annotations

import mujoco
import numpy as np

from exneat_cli.tasks.task import Part

SKIPPED_POSITIONS = 2
"""The trunk's x and y are left out of the observation, so that walking looks the same everywhere."""
FORCES_PER_BODY = 6
"""Entries of MuJoCo's `cfrc_ext` per body: three torques (N m), three forces (N)."""


def find_parts(model: mujoco.MjModel) -> tuple[Part, list[Part]]:
    """The trunk, and the parts in the order of the model's bodies, each with the name of its first body.

    A part stands where its first joint does in the model's initial pose, seen from the trunk, in metres.
    """
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    trunk = int(model.jnt_bodyid[np.flatnonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_FREE)[0]])
    parts, bodies_of_parts = [], set()
    for root in range(model.nbody):
        if root == trunk or model.body_parentid[root] != trunk:
            continue
        bodies = _subtree(model, root)
        bodies_of_parts |= set(bodies)
        first_joint = np.flatnonzero(np.isin(model.jnt_bodyid, bodies))[0]
        x, y, _ = data.xanchor[first_joint] - data.xpos[trunk]
        parts.append(_part(model, bodies, (float(x), float(y))))
    # Whatever hangs on no part is the trunk's; body 0 is the world.
    return _part(model, [body for body in range(1, model.nbody) if body not in bodies_of_parts], (0.0, 0.0)), parts


def _part(model: mujoco.MjModel, bodies: list[int], position: tuple[float, float]) -> Part:
    return Part(model.body(bodies[0]).name, _sensors(model, bodies), _actuators(model, bodies), position)


def _subtree(model: mujoco.MjModel, root: int) -> list[int]:
    # A model numbers children after their parents.
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
        # A free joint has 7 positions (x, y, z and a quaternion) and 6 velocities, a hinge or slide one of each.
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
