"""Pictures of robots, from MuJoCo's renderer; the camera follows the trunk."""

from __future__ import annotations

import atexit
import copy

import mujoco
import numpy as np
from numpy.typing import NDArray

DISTANCE = 2.8
"""Distance of the camera, as a multiple of how far the body extends from its trunk."""
BODY, PLANAR = (115.0, -22.0), (90.0, -8.0)
"""Azimuth and elevation in degrees: from above and behind the right side, or straight at the plane; x points right."""


class RobotCamera:
    """Draws poses of a model.

    Args:
        model: the body and its surroundings.
        trunk: the body that the camera follows.
        width, height: pixels.
    """

    def __init__(self, model: mujoco.MjModel, trunk: int, width: int, height: int) -> None:
        model = copy.copy(model)  # the size of its off-screen pictures is part of a model
        model.vis.global_.offwidth, model.vis.global_.offheight = width, height
        self._model, self._data, self._trunk = model, mujoco.MjData(model), trunk
        mujoco.mj_forward(model, self._data)
        self._moving = model.geom_bodyid >= trunk
        away = np.linalg.norm(self._data.geom_xpos - self._data.xpos[trunk], axis=1) + model.geom_rbound
        self._height, self._reach = float(self._data.xpos[trunk, 2]), float(away[self._moving].max())
        is_free = bool((model.jnt_type == int(mujoco.mjtJoint.mjJNT_FREE)).any())
        self._camera = mujoco.MjvCamera()
        self._camera.distance = DISTANCE * self._reach
        self._camera.azimuth, self._camera.elevation = BODY if is_free else PLANAR
        self._renderer = mujoco.Renderer(model, height, width)
        atexit.register(self._renderer.close)  # OSMesa prints errors if it is closed after Python's own shutdown

    def draw(self, snapshot: NDArray[np.float64]) -> NDArray[np.uint8]:
        """(height, width, 3) the picture of a pose, (nq,)."""
        self._data.qpos[:] = snapshot
        mujoco.mj_forward(self._model, self._data)
        top = float((self._data.geom_xpos[:, 2] + self._model.geom_rbound)[self._moving].max())
        # The camera's height is fixed, so that hops are visible, unless the body would leave the picture.
        height = max(0.8 * self._height, top - self._reach)
        self._camera.lookat[:] = (*self._data.xpos[self._trunk, :2], height)
        self._renderer.update_scene(self._data, self._camera)
        return np.asarray(self._renderer.render())
