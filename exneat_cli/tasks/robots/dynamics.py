"""The compiled episode of a robot: reset, rewind, observe, sense, drive, step and locate on MuJoCo's own memory.

It uses index lists and sizes from the model, and follows Gymnasium's v5 environments (Farama Foundation, 2024)
operation by operation, so that results agree to the last bits.
"""

from __future__ import annotations

import functools
from pathlib import Path
from typing import Any, NamedTuple

import llvmlite.binding
import mujoco
import numpy as np
from numba import types
from numpy.random import Generator
from numpy.typing import NDArray

from exneat_cli.compiling import compiled
from exneat_cli.errors import ExneatError
from exneat_cli.tasks.robots.frames import Frames, sense_in_frames
from exneat_cli.tasks.task import ENDED, FAILED, RUNNING

_SYMBOLS = ("mj_step", "mj_forward", "mj_resetData", "mj_rnePostConstraint")
_LIBRARY_PATTERNS = ("libmujoco.so*", "libmujoco*.dylib", "mujoco.dll")

# MuJoCo's C functions; each takes the addresses of an mjModel and an mjData. `types.ExternalFunction` holds the
# symbol's name instead of an address, so that code that calls it can be cached between processes.
_functions: list[Any] = [types.ExternalFunction(name, types.void(types.int64, types.int64)) for name in _SYMBOLS]
mj_step, mj_forward, mj_resetData, mj_rnePostConstraint = _functions

STEPS, STUCK_STEPS, WARNINGS = range(3)
"""Entries of `RobotWorld.clock`: steps done, steps without progress, MuJoCo's warnings at the reset."""


class RobotWorld(NamedTuple):
    """MuJoCo's memory as NumPy views, and the rules of an episode."""

    model: int  #: address of the C structure `mjModel`
    data: int  #: address of `mjData`, of which the next seven are views
    qpos: NDArray[np.float64]  #: (nq,), m, rad and quaternions
    qvel: NDArray[np.float64]  #: (nv,), m/s and rad/s
    ctrl: NDArray[np.float64]  #: (nu,)
    xpos: NDArray[np.float64]  #: (nbody, 3), m
    xipos: NDArray[np.float64]  #: (nbody, 3), m, centres of mass
    cfrc_ext: NDArray[np.float64]  #: (nbody, 6), N m and N
    warnings: NDArray[np.int32]  #: counters
    initial_qpos: NDArray[np.float64]  #: the pose that a reset disturbs
    start_qpos: NDArray[np.float64]  #: the pose after the reset
    start_qvel: NDArray[np.float64]
    positions: NDArray[np.int64]  #: entries of `qpos` that are observed
    velocities: NDArray[np.int64]  #: entries of `qvel`
    bodies: NDArray[np.int64]  #: bodies whose contact forces are observed
    frames: Frames  #: how readings become the values that parts sense
    trunk: int  #: body whose position counts
    masses: NDArray[np.float64]  #: (nbody,) if the speed of the centre of mass counts; (0,) if the trunk's does
    along: int  #: entry of `qpos` whose speed counts; -1 if the trunk's does
    middle: NDArray[np.float64]  #: (nu,) control of an action of 0
    span: NDArray[np.float64]  #: (nu,) added by an action of 1
    substeps: int  #: physics steps per control step
    control_period: float  #: seconds per control step
    reset_scale: float  #: half-width of the uniform noise on positions (rad, m)
    normal: bool  #: whether noise on velocities is normal with this sd, not uniform
    height: int  #: entry of `qpos` that is the trunk's height; -1: every height is healthy
    above: float  #: m to add to it
    lowest: float  #: healthy height of the trunk in m
    highest: float
    pitch: int  #: entry of `qpos` that must stay between -steepest and steepest (rad); -1: none
    steepest: float
    largest: float  #: healthy size of all velocities, and of all positions from the third on
    force_limit: float  #: contact forces are clipped to [-force_limit, force_limit]
    forward_weight: float  #: weights of the reward terms
    healthy_reward: float
    control_weight: float
    contact_weight: float
    cost_limit: float  #: contact forces are clipped to this in the contact cost
    largest_contact_cost: float
    max_steps: int  #: control steps after which an episode ends
    progress: float  #: m that must be gained within `patience` steps, or the episode ends
    patience: int  #: steps; 0: never
    clock: NDArray[np.int64]  #: (3,), see `STEPS`, `STUCK_STEPS` and `WARNINGS`
    mark: NDArray[np.float64]  #: (1,), x in m from which progress is measured


@functools.cache
def load_library() -> None:
    """Let compiled code call MuJoCo: load the library that its Python bindings use into LLVM as well.

    Raises:
        ExneatError: the library is not in the directory of the Python bindings, cannot be loaded or lacks a function.
    """
    directory = Path(mujoco.__file__).parent
    libraries = [path for pattern in _LIBRARY_PATTERNS for path in sorted(directory.glob(pattern))]
    fix = "install MuJoCo from its wheel, which holds its library: pip install --force-reinstall mujoco"
    if not libraries:
        raise ExneatError(f"MuJoCo: expected its library in {directory}, got none\n  {fix}")
    try:
        llvmlite.binding.load_library_permanently(str(libraries[0]))
    except RuntimeError as error:
        raise ExneatError(f"MuJoCo: {libraries[0].name} could not be loaded: {error}\n  {fix}") from error
    # Compiled code that calls a missing function would crash the process.
    missing = [name for name in _SYMBOLS if not llvmlite.binding.address_of_symbol(name)]
    if missing:
        raise ExneatError(f"MuJoCo: {libraries[0].name} has no {', '.join(missing)}\n  {fix}")
    # Otherwise MuJoCo would write MUJOCO_LOG.TXT into the working directory; its warning counters are not affected.
    mujoco.set_mju_user_warning(lambda message: None)


@compiled
def reset(world: RobotWorld, rng: Generator) -> None:
    """Put the body near its initial pose, as Gymnasium does with the same generator."""
    # Noise on all positions, then on all velocities.
    for i in range(world.qpos.size):
        world.start_qpos[i] = world.initial_qpos[i] + rng.uniform(-world.reset_scale, world.reset_scale)
    for i in range(world.qvel.size):
        if world.normal:
            world.start_qvel[i] = world.reset_scale * rng.standard_normal()
        else:
            world.start_qvel[i] = rng.uniform(-world.reset_scale, world.reset_scale)
    rewind(world)


@compiled
def rewind(world: RobotWorld) -> None:
    """Put the body back to where the last reset put it."""
    # Clears everything that the last episode left in MuJoCo's memory.
    mj_resetData(world.model, world.data)
    world.clock[STEPS] = 0
    world.clock[STUCK_STEPS] = 0
    world.clock[WARNINGS] = np.sum(world.warnings)
    # Slice assignments would take seconds to compile; so loops are written out, here and below.
    for i in range(world.qpos.size):
        world.qpos[i] = world.start_qpos[i]
    for i in range(world.qvel.size):
        world.qvel[i] = world.start_qvel[i]
    # No step is taken, so the first contact forces are 0, as in Gymnasium.
    mj_forward(world.model, world.data)
    world.mark[0] = world.xpos[world.trunk, 0]


@compiled
def observe(world: RobotWorld, observation: NDArray[np.float64]) -> None:
    """Write positions (except the place on the ground), velocities, and clipped contact forces."""
    k = 0
    for i in world.positions:
        observation[k] = world.qpos[i]
        k += 1
    for i in world.velocities:
        observation[k] = world.qvel[i]
        k += 1
    for body in world.bodies:
        for i in range(world.cfrc_ext.shape[1]):
            observation[k] = min(max(world.cfrc_ext[body, i], -world.force_limit), world.force_limit)
            k += 1


@compiled
def sense(world: RobotWorld, readings: NDArray[np.float64], sensed: NDArray[np.float64]) -> None:
    """Write the values that the parts sense in their own frames."""
    sense_in_frames(world.frames, readings, sensed)


@compiled
def drive(world: RobotWorld, action: NDArray[np.float64]) -> None:
    """Convert an action from the parts' signs to the joints', in place."""
    for i in range(action.size):
        action[i] *= world.frames.action_signs[i]


@compiled
def step(world: RobotWorld, action: NDArray[np.float64], terms: NDArray[np.float64]) -> int:
    """Do one control step; write its forward, healthy, control and contact rewards to `terms`, (4,)."""
    for i in range(action.size):
        if not np.isfinite(action[i]):
            return FAILED
        world.ctrl[i] = world.middle[i] + world.span[i] * action[i]
    before = _place(world)
    for _ in range(world.substeps):
        mj_step(world.model, world.data)
    # mj_step leaves the contact forces of bodies uncomputed.
    mj_rnePostConstraint(world.model, world.data)
    # An unstable simulation makes MuJoCo warn and reset itself, and would go on earning the healthy reward.
    if np.sum(world.warnings) != world.clock[WARNINGS]:
        return FAILED
    if not (np.isfinite(world.qpos).all() and np.isfinite(world.qvel).all()):
        return FAILED
    # The episode ends with a fall or a jump, when time is up, or when there is no progress in training.
    healthy = _healthy(world)
    _reward(world, before, healthy, terms)
    world.clock[STEPS] += 1
    if not healthy or world.clock[STEPS] >= world.max_steps or _stuck(world):
        return ENDED
    return RUNNING


@compiled
def _place(world):  # type: ignore[no-untyped-def]
    """X in m of the slide, the centre of mass or the trunk, whichever counts."""
    if world.along >= 0:
        return world.qpos[world.along]
    if world.masses.size == 0:
        return world.xpos[world.trunk, 0]  # lags behind qpos after RK4 steps, but is what Gymnasium uses
    moment, mass = 0.0, 0.0
    for body in range(world.masses.size):
        moment += world.masses[body] * world.xipos[body, 0]
        mass += world.masses[body]
    return moment / mass


@compiled
def _healthy(world):  # type: ignore[no-untyped-def]
    if world.height >= 0:
        height = world.qpos[world.height] + world.above
        if not (world.lowest <= height and height <= world.highest):
            return False
    if world.pitch >= 0 and abs(world.qpos[world.pitch]) >= world.steepest:
        return False
    if world.largest < np.inf:
        for i in range(2, world.qpos.size):
            if abs(world.qpos[i]) >= world.largest:
                return False
        for i in range(world.qvel.size):
            if abs(world.qvel[i]) >= world.largest:
                return False
    return True


@compiled
def _reward(world, before, healthy, terms):  # type: ignore[no-untyped-def]
    # Forward velocity along x in m/s.
    terms[0] = world.forward_weight * ((_place(world) - before) / world.control_period)
    terms[1] = world.healthy_reward if healthy else 0.0
    effort = 0.0
    for i in range(world.ctrl.size):
        effort += world.ctrl[i] * world.ctrl[i]
    terms[2] = -world.control_weight * effort
    # The world's own entries are part of the sum, as in Gymnasium.
    squared = 0.0
    for body in range(world.cfrc_ext.shape[0]):
        for i in range(world.cfrc_ext.shape[1]):
            force = min(max(world.cfrc_ext[body, i], -world.cost_limit), world.cost_limit)
            squared += force * force
    terms[3] = -min(world.contact_weight * squared, world.largest_contact_cost)


@compiled
def _stuck(world):  # type: ignore[no-untyped-def]
    # With sufficient progress the mark moves along and the count starts again.
    x = world.xpos[world.trunk, 0]
    if x >= world.mark[0] + world.progress:
        world.mark[0] = x
        world.clock[STUCK_STEPS] = 0
    else:
        world.clock[STUCK_STEPS] += 1
    return world.patience > 0 and world.clock[STUCK_STEPS] >= world.patience


@compiled
def locate(world: RobotWorld, row: NDArray[np.float64]) -> None:
    """Write x, y and z of the trunk in metres."""
    for i in range(3):
        row[i] = world.xpos[world.trunk, i]
