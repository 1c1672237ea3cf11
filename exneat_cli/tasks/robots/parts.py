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
    # The first body of each body's part. Children come after their parents; what hangs on no part is the trunk's.
    owner = np.full(model.nbody, trunk)
    for body in range(1, model.nbody):
        parent = model.body_parentid[body]
        owner[body] = body if parent == trunk else owner[parent]
    # Where each entry of the observation and of the action belongs.
    widths = np.array([7, 4, 1, 1])[model.jnt_type]  # positions of a free, ball, slide and hinge joint
    positions = np.repeat(model.jnt_bodyid, widths)[SKIPPED_POSITIONS:]
    forces = np.repeat(np.arange(1, model.nbody), FORCES_PER_BODY)  # body 0 is the world
    sensors = owner[np.concatenate([positions, model.dof_bodyid, forces])]
    actuators = owner[model.jnt_bodyid[model.actuator_trnid[:, 0]]]

    def part(root: int, position: tuple[float, float]) -> Part:
        own_sensors, own_actuators = (tuple(np.flatnonzero(owners == root).tolist()) for owners in (sensors, actuators))
        return Part(model.body(root).name, own_sensors, own_actuators, position)

    parts = []
    for root in np.unique(owner[owner != trunk]).tolist():
        first_joint = np.flatnonzero(owner[model.jnt_bodyid] == root)[0]
        x, y, _ = data.xanchor[first_joint] - data.xpos[trunk]
        parts.append(part(root, (float(x), float(y))))
    return part(trunk, (0.0, 0.0)), parts
