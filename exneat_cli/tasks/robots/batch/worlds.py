"""A batch of W worlds of one robot: reset, observe, sense, drive and step as kernels on arrays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, cast

import mujoco
import mujoco_warp
import numpy as np
import warp as wp
from numpy.typing import NDArray

from exneat_cli.errors import ConfigError
from exneat_cli.seeding import EpisodeSeeds, generator
from exneat_cli.tasks.robots.batch import judging, kernels, ordering
from exneat_cli.tasks.robots.dynamics import RobotWorld, rewind
from exneat_cli.tasks.task import Simulation

CONTACTS, ROWS = 32, 64
"""Room per world for contacts and for rows of constraints; both are doubled if it is exceeded."""
_LACKS_ROOM = sum(mujoco_warp.OverflowType[name] for name in ("NEFC", "NJMAX_NNZ", "BROADPHASE", "NARROWPHASE", "CCD"))
"""Bits of those of MuJoCo Warp's overflows that more room can avoid."""


class RobotWorlds:
    """W worlds of one robot on one device.

    Args:
        model: of the robot.
        simulation: a world of the same task on the CPU, which provides the rules and draws the starts.
        count: W.
        device: Warp's name of the device.
        room: factor of `CONTACTS` and `ROWS`.

    Attributes:
        begins: (W,) row of the starts to which a world is to be reset; -1 for none.
        status: (W,) status of each world, see `exneat_cli.tasks.task`; only running ones act.
        terms: (W, 4) reward terms of the last step.
        start_size: number of entries of a start.
        readings_size: number of readings.
        is_framed: whether brains sense something other than the readings.

    Raises:
        ConfigError: MuJoCo Warp cannot simulate the model.
    """

    model: Any
    data: Any

    def __init__(self, model: mujoco.MjModel, simulation: Simulation, count: int, device: str, room: int = 1) -> None:
        self.count, self._simulation, self._model = count, simulation, model
        self.start_size = model.nq + 2 * model.nv + 2
        world: RobotWorld = simulation.world
        self._world, self.is_framed = world, simulation.sense is not None
        self._needs_forces = bool(world.bodies.size) or world.contact_weight != 0.0
        with wp.ScopedDevice(device):
            self._open(model, count, room)
            self._describe(world)

    def _open(self, model: mujoco.MjModel, count: int, room: int) -> None:
        spatial = int(np.sum(model.wrap_type != mujoco.mjtWrap.mjWRAP_JOINT))
        if self._needs_forces and (model.neq or spatial):
            came = f"{model.neq} equality constraints, {spatial} points of spatial tendons"
            expected = "a model without any for executor=warp, which omits them from contact forces"
            raise ConfigError("task.model", expected, came)
        try:
            self.model = mujoco_warp.put_model(model)
            self.data = mujoco_warp.make_data(model, nworld=count, nconmax=CONTACTS * room, njmax=ROWS * room)
        except (NotImplementedError, ValueError) as error:
            raise ConfigError("task.model", "one that MuJoCo Warp can simulate", str(error)[:200]) from error
        self.model.opt.warn_overflow = 0
        self.model.ncam = self.model.nlight = 0  # nothing is rendered
        self._cone = int(model.opt.cone)
        listed, rows = CONTACTS * room, self.data.njmax
        self._contacts = wp.zeros(count, dtype=int)
        self._listed = wp.zeros((count, listed), dtype=int)
        self._order = wp.zeros((count, rows), dtype=int)
        self._moved = wp.zeros(count, dtype=int)
        # Rows of a sparse table have no fixed width, so they are not sorted.
        self._sorts_rows = not self.model.is_sparse
        self._numbers = wp.zeros((count, rows if self._sorts_rows else 0, self.data.efc.J.shape[2] + 9), dtype=float)
        self.model.callback.contactfilter = self._list_contacts
        self.model.callback.control = self._sort

    def _describe(self, world: RobotWorld) -> None:
        count, model, f = self.count, self._model, world.frames
        self.begins = wp.full(count, -1, dtype=int)
        self.status = wp.full(count, -1, dtype=int)
        self.terms = wp.zeros((count, 4), dtype=float)
        self.force = wp.zeros((count, model.nbody), dtype=wp.spatial_vector)
        self._place, self._mark = wp.zeros(count, dtype=float), wp.zeros(count, dtype=float)
        self._clock = wp.zeros((count, 2), dtype=int)
        self.readings_size = world.positions.size + world.velocities.size + 6 * world.bodies.size
        self._sensors = _filled(kernels.Sensors, world)
        self._view = _filled(
            kernels.View,
            f,
            free=int(f.free),
            hinge=wp.vec3(*f.hinge.tolist()),
            axes=wp.array(f.axes, dtype=wp.vec3),
            moves=wp.array(f.moves, dtype=wp.mat33),
        )
        self._frames = len(f.moves)
        self._joints = _uploaded(f.scalar_from), _uploaded(f.scalar_to), _uploaded(f.scalar_sign)
        signs = f.action_signs if self.is_framed else np.ones(model.nu)
        self._drive = _uploaded(signs), _uploaded(world.middle), _uploaded(world.span)
        self._rules = _filled(judging.Rules, world, total_mass=float(world.masses.sum()))

    def starts(self, episodes: Sequence[EpisodeSeeds]) -> NDArray[np.float32]:
        """(E, `start_size`) the starts of episodes, drawn as on the CPU."""
        return np.array([self._start(seeds) for seeds in episodes], np.float32).reshape(-1, self.start_size)

    def resting_start(self) -> NDArray[np.float32]:
        """(`start_size`,) the initial pose, undisturbed."""
        world = self._world
        world.start_qpos[:], world.start_qvel[:] = world.initial_qpos, 0.0
        rewind(world)
        return self._state()

    def _start(self, seeds: EpisodeSeeds) -> NDArray[np.float32]:
        self._simulation.reset(self._world, generator(seeds.world))
        return self._state()

    def _state(self) -> NDArray[np.float32]:
        world, owner = self._world, cast("tuple[mujoco.MjModel, mujoco.MjData]", self._simulation.owner)
        x = world.xpos[world.trunk, 0]
        place = x
        if world.along >= 0:
            place = world.qpos[world.along]
        elif world.masses.size:
            place = float(world.masses @ world.xipos[:, 0]) / float(world.masses.sum())
        return np.concatenate([world.qpos, world.qvel, owner[1].qacc_warmstart, [place, x]]).astype(np.float32)

    def reset(self, starts: wp.array) -> None:
        """Reset each world with `begins` >= 0 to that row of `starts`, (starts, `start_size`)."""
        data = self.data
        state = [data.qpos, data.qvel, data.qacc_warmstart, data.act, data.ctrl]
        own = [self.force, self._place, self._mark, self._clock]
        wp.launch(kernels.reset, dim=self.count, inputs=[self.begins, starts, *state, *own])

    def observe(self, readings: wp.array) -> None:
        """Write the noiseless readings, (W, at least observation size)."""
        values = [self._sensors, self.data.qpos, self.data.qvel, self.force, readings]
        wp.launch(kernels.observe, dim=(self.count, self.readings_size), inputs=values)

    def sense(self, readings: wp.array, sensed: wp.array) -> None:
        """Write the sensed values, (W, at least sensed size); if these are the readings, both are the same array."""
        if self.is_framed:
            joints = self._joints[0].shape[0]
            wp.launch(kernels.sense_joints, dim=(self.count, joints), inputs=[*self._joints, readings, sensed])
            wp.launch(kernels.sense_trunk, dim=(self.count, self._frames), inputs=[self._view, readings, sensed])

    def drive(self, action: wp.array) -> None:
        """Set the controls from actions, (W, A)."""
        wp.launch(kernels.drive, dim=self.count, inputs=[*self._drive, action, self.status, self.data.ctrl])

    def step(self) -> None:
        """Simulate one control step, and judge it."""
        data = self.data
        for _ in range(self._world.substeps):
            mujoco_warp.step(self.model, data)
        if self._needs_forces:
            self._add_contact_forces()
        state = [data.qpos, data.qvel, data.qacc, data.xpos, data.xipos, data.ctrl, self.force]
        own = [self._place, self._mark, self._clock, self.status, self.terms]
        wp.launch(judging.judge, dim=self.count, inputs=[self._rules, *state, *own])

    def _add_contact_forces(self) -> None:
        data, model = self.data, self.model
        contact = data.contact
        contacts = [contact.geom, contact.dim, contact.frame, contact.friction, contact.pos, contact.efc_address]
        values = [self._contacts, self._listed, *contacts, self._cone, data.efc.force]
        bodies = [model.geom_bodyid, model.body_rootid, data.subtree_com, self.force]
        wp.launch(ordering.add_contact_forces, dim=self.count, inputs=[*values, *bodies])

    def _list_contacts(self, model: Any, data: Any) -> None:
        contact = data.contact
        self._contacts.zero_()
        found = [data.nacon, contact.worldid, contact.geom, model.geom_type, data.geom_xmat, contact.frame]
        lists = [self._contacts, self._listed]
        wp.launch(ordering.list_contacts, dim=data.naconmax, inputs=[*found, *lists])

    def _sort(self, model: Any, data: Any) -> None:
        efc, contact = data.efc, data.contact
        ranks = [contact.geom, contact.geomcollisionid, self._contacts, self._listed]
        wp.launch(ordering.sort_contacts, dim=self.count, inputs=ranks)
        if not self._sorts_rows:
            return
        counts = [data.ne, data.nf, data.nl, data.nefc, efc.type, efc.id, self._contacts, self._listed]
        outcome = [contact.dim, self._cone, contact.efc_address, self._order, self._moved]
        wp.launch(ordering.order_rows, dim=self.count, inputs=[*counts, *outcome])
        columns = [efc.type, efc.id, efc.pos, efc.margin, efc.D, efc.vel, efc.aref, efc.frictionloss, efc.Jqvel]
        shape, which = self._order.shape, [self._moved, data.nefc, self._order]
        wp.launch(ordering.set_aside, dim=shape, inputs=[*which, efc.J, self._numbers, *columns])
        wp.launch(ordering.put_back, dim=shape, inputs=[*which, self._numbers, efc.J, *columns])

    def note_overflows(self, flag: wp.array) -> None:
        """Set `flag`, (1,), if any world has exceeded the room for contacts or rows since the worlds were opened."""
        wp.launch(kernels.note_overflows, dim=self.count, inputs=[_LACKS_ROOM, self.data.overflow, flag])


def _uploaded(values: NDArray[Any]) -> wp.array:
    kinds = {"i": np.int32, "f": np.float32, "b": np.int32}
    return wp.array(np.ascontiguousarray(values.astype(kinds[values.dtype.kind])))


def _filled(kind: Any, source: Any, **others: Any) -> Any:
    """A Warp struct with the fields of a named tuple, and others."""
    struct, values = kind(), source._asdict() | others
    for name in kind.vars:
        setattr(struct, name, _uploaded(values[name]) if isinstance(values[name], np.ndarray) else values[name])
    return struct
