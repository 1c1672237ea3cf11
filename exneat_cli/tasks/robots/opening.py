"""A robot's anatomy, and the opening of its worlds for compiled code."""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from exneat_cli.tasks.robots.body import Body, take_apart
from exneat_cli.tasks.robots.dynamics import RobotWorld
from exneat_cli.tasks.robots.models import Rules
from exneat_cli.tasks.robots.readings import Readings, read_off
from exneat_cli.tasks.robots.sensing import Sensing, in_own_frames, in_the_world

FORCE_LIMIT = 1.0
"""Contact forces (N) and torques (N m) are clipped to this, as in Gymnasium's Ant-v5."""
HEALTHY_SHARES = (0.4, 2.0)
"""Healthy range of a model without rules of its own, as multiples of the trunk's initial height."""


class Anatomy(NamedTuple):
    """A robot's body, what its sensors read, and what each part senses of it."""

    body: Body
    readings: Readings
    sensing: Sensing


@functools.lru_cache(maxsize=64)
def anatomy_of(
    model: mujoco.MjModel,
    by_place: bool,
    order: str,
    symmetry: str | None,
    named: tuple[tuple[str, tuple[str, ...]], ...],
    frame: str,
    contact_forces: bool,
) -> Anatomy:
    """The anatomy of a model with these parameters of a `RobotTask`; see `take_apart` for `by_place` and errors."""
    body = take_apart(model, order=order, symmetry=symmetry, parts=dict(named), by_place=by_place)
    readings = read_off(model, body, contact_forces=contact_forces)
    return Anatomy(body, readings, (in_the_world if frame == "world" else in_own_frames)(model, body, readings))


def control_range(model: mujoco.MjModel) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(nu,) the controls for an action of 0, and (nu,) what an action of 1 adds."""
    low, high = np.where(model.actuator_ctrllimited[:, None], model.actuator_ctrlrange, (-1.0, 1.0)).T
    return 0.5 * (low + high), 0.5 * (high - low)


def open_world(
    model: mujoco.MjModel, anatomy: Anatomy, rules: Rules, *, substeps: int, **settings: Any
) -> tuple[RobotWorld, mujoco.MjData]:
    """Open a world, and the MuJoCo data that it points into; `settings` are the fields that the task determines."""
    data, (body, readings, sensing) = mujoco.MjData(model), anatomy
    frames = sensing.frames
    middle, span = control_range(model)
    height = int(readings.positions[frames.height]) if frames.height >= 0 else -1
    initial = float(model.qpos0[height]) + frames.above
    lowest, highest = rules.heights or (HEALTHY_SHARES[0] * initial, HEALTHY_SHARES[1] * initial)
    pitched = not frames.free and rules.steepest < np.inf
    costs = ("forward_weight", "healthy_reward", "control_weight", "contact_weight", "cost_limit")
    return RobotWorld(
        model=model._address,
        data=data._address,
        **{name: getattr(data, name) for name in ("qpos", "qvel", "ctrl", "xpos", "xipos", "cfrc_ext")},
        warnings=data.warning.number,
        initial_qpos=data.qpos.copy(),
        start_qpos=data.qpos.copy(),
        start_qvel=data.qvel.copy(),
        clock=np.zeros(3, dtype=np.int64),
        mark=np.zeros(1),
        positions=readings.positions,
        velocities=readings.velocities,
        bodies=readings.bodies,
        frames=frames,
        middle=middle,
        span=span,
        force_limit=FORCE_LIMIT,
        trunk=body.trunk,
        masses=model.body_mass.copy() if rules.speed == "mass" else np.zeros(0),
        along=int(model.jnt_qposadr[body.root[0]]) if rules.speed == "slide" else -1,
        substeps=substeps,
        control_period=float(model.opt.timestep) * substeps,
        height=height,
        above=frames.above,
        lowest=lowest,
        highest=highest,
        pitch=int(readings.positions[frames.orientation]) if pitched else -1,
        **{name: getattr(rules, name) for name in (*costs, "largest_contact_cost", "normal", "steepest", "largest")},
        **settings,
    ), data
