"""Any MuJoCo body that learns to walk along +x: Gymnasium's by name, our hexapod, or a model file of your own.

What is sensed, entry by entry with its unit, what drives what, which parts are alike and which geometries follow from
that: ``exneat inspect task=robot task.model=...``. An action runs from -1 to 1 over each actuator's range.

Scoring: the fitness of an episode is its forward reward, the sum of dx / dt over the control steps. The full reward
adds the healthy reward and subtracts the costs of effort and contact.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import mujoco
import numpy as np
from numpy.typing import NDArray

from exneat_cli.errors import ConfigError, check_choice, check_flag, check_real, check_text, check_whole
from exneat_cli.tasks.robots import dynamics
from exneat_cli.tasks.robots.body import SYMMETRIES, Body, check_parts, take_apart
from exneat_cli.tasks.robots.models import NAMED, digest_of, files_of, load, rules_of
from exneat_cli.tasks.robots.readings import Readings, actuator_names, body_name, joint_name, read_off, with_unit
from exneat_cli.tasks.robots.sensing import Sensing, in_own_frames, in_the_world
from exneat_cli.tasks.task import Adapter, Camera, Part, Simulation, Task, setting

REWARDS = ("thesis", "gymnasium")
THESIS_CONTROL_WEIGHT = 0.01
"""Weight of sum(control^2) under ``reward=thesis``: its full reward is about 900 above its forward reward over 1000
steps, which leaves room for 0.01 (Zhang, 2025, table 5.5); Gymnasium's default for Ant is 0.5."""
FORCE_LIMIT = 1.0
"""Contact forces (N) and torques (N m) are clipped to this, as in Gymnasium's Ant-v5."""
LONGEST_PERIOD = 10.0
"""Seconds that a control step may last."""
HEALTHY_SHARES = (0.4, 2.0)
"""Of the trunk's initial height: the healthy range of a model without rules of its own."""


@dataclass(frozen=True)
class RobotTask(Task):
    """Parameters of a robot.

    Attributes:
        name: always ``robot``.
        model: path of an MJCF file, or a name in `models.NAMED`.
        part_order: ``position`` orders the parts from front to back, left before right; ``model`` as the model does.
        frame: ``world``: every part senses readings as they are; ``part``: each one in its own frame.
        symmetry: ``turn`` or ``mirror``, what relates alike parts; None follows from the geometry.
        contact_forces: whether contact forces are sensed.
        part_bodies: names of each part's bodies, by the part's name; None finds the parts.
        control_period: seconds per control step, at most 10, None for the model's own.
        reward: weights of the full reward, ``gymnasium`` or ``thesis`` (with less cost of effort).
        max_steps: control steps after which an episode ends.
        progress: metres along x that count as progress, in training only.
        patience: steps without progress, at most 1000000, that end a training episode; 0 never ends one.

    Raises:
        ConfigError: a value is out of range, or the model cannot be used.
    """

    name: str = "robot"
    model: str = "hexapod"
    part_order: str = "position"
    frame: str = "part"
    symmetry: str | None = None
    contact_forces: bool = False
    part_bodies: Mapping[str, Sequence[str]] | None = setting("parts", None)
    control_period: float | None = None
    reward: str = "gymnasium"
    max_steps: int = 1000
    progress: float = 0.01
    patience: int = 100

    terms: ClassVar[tuple[str, ...]] = ("forward_reward", "healthy_reward", "control_cost", "contact_cost")
    fitness_name: ClassVar[str] = "forward reward"
    fitness_decimals: ClassVar[int] = 1
    failure_floor: ClassVar[float] = -100.0
    trace_columns: ClassVar[tuple[str, ...]] = ("x", "y", "z")
    """Position of the trunk in metres."""
    drawn_by_mujoco: ClassVar[bool] = True

    def __post_init__(self) -> None:
        check_choice("task.part_order", self.part_order, ["position", "model"])
        check_choice("task.frame", self.frame, ["world", "part"])
        if self.symmetry is not None:
            check_choice("task.symmetry", self.symmetry, list(SYMMETRIES))
        check_flag("task.contact_forces", self.contact_forces)
        check_text("task.model", self.model, "an MJCF file, or the name of a model")
        check_parts(self.part_bodies)
        if self.control_period is not None:
            check_real("task.control_period", self.control_period, 0.0, LONGEST_PERIOD)
        check_choice("task.reward", self.reward, list(REWARDS))
        check_whole("task.max_steps", self.max_steps, 1, 1_000_000)
        check_real("task.progress", self.progress, 0.0)
        check_whole("task.patience", self.patience, 0, 1_000_000)
        _ = self.parts, self._substeps

    @property
    def parts(self) -> tuple[Part, ...]:
        """The limbs, each with its sensors and actuators."""
        return self._anatomy[2].parts

    @property
    def trunk(self) -> Part:  # type: ignore[override]
        """The trunk's sensors, and the actuators of its own joints."""
        return self._anatomy[2].trunk

    @property
    def whole(self) -> tuple[int, ...]:
        """Entries that a single network senses: of all parts and of the trunk, each once."""
        if self.frame == "world":
            return super().whole
        own = {entry for part in (*self.parts, self.trunk) for entry in part.sensors}
        return tuple(sorted(own))

    @property
    def sensor_names(self) -> tuple[str, ...]:
        """Name and unit of what is sensed, entry by entry, e.g. ``hip_1 position (rad)``."""
        return self._anatomy[2].names

    def remarks_on(self, part: Part) -> dict[str, str]:
        """Its bodies, which part it is alike, and its joints with the signs that it senses them with."""
        model, (body, _, _) = load(self.model), self._anatomy
        if part == self.trunk:
            return {"bodies": ", ".join(body_name(model, each) for each in body.core)}
        limb = body.limbs[self.parts.index(part)]
        first = next(each for each in body.limbs if each.likeness == limb.likeness)
        relation = limb.relation
        signed = zip(relation.joints, relation.joint_signs, strict=True)
        like = "" if limb is first else f": a {relation.name} of {first.name}"
        return {
            "bodies": ", ".join(body_name(model, each) for each in relation.bodies),
            "class": f"{limb.likeness}{like}",
            "joints": ", ".join(f"{'+-'[sign < 0]}{joint_name(model, joint)}" for joint, sign in signed),
        }

    @property
    def observation_size(self) -> int:
        """Number of readings."""
        return len(self._anatomy[1].names)

    @property
    def sensed_size(self) -> int:
        """Number of entries that parts sense."""
        return len(self._anatomy[2].names)

    @property
    def actuator_names(self) -> tuple[str, ...]:
        """The joints that are driven, in the order of the action, with what an action of 1 gives them."""
        return actuator_names(load(self.model))

    @property
    def longest_episode(self) -> int:
        """`max_steps`."""
        return self.max_steps

    def usual_reset_scale(self) -> float:
        """Noise on the initial pose as the model's rules have it."""
        return rules_of(self.model).reset_scale

    def identity(self) -> dict[str, Any]:
        """The parameters, with the model by its content."""
        return {**super().identity(), "model": digest_of(self.model)}

    def files(self) -> dict[str, bytes]:
        """The model's files, unless it has a name."""
        return {} if self.model in NAMED else files_of(self.model)

    @classmethod
    def found_in(cls, section: Mapping[str, Any], directory: Path) -> dict[str, Any]:
        """Parameters as a run recorded them, with the model that it keeps in `directory`."""
        kept = sorted(directory.rglob(Path(str(section.get("model"))).name)) if directory.is_dir() else []
        return {**section, "model": str(kept[0])} if kept else dict(section)

    def shared_by(self, subpopulations: Sequence[int]) -> RobotTask:
        """With `symmetry` decided: turns if some sharers are alike by nothing else, else mirrorings."""
        body = self._anatomy[0]
        if self.frame == "world" or self.symmetry is not None or not body.symmetries:
            return self
        classes = set(zip(subpopulations, [limb.likeness for limb in body.limbs], strict=True))
        turns = "turn" in body.symmetries and len(classes) > len(set(subpopulations))
        return replace(self, symmetry="turn" if turns or "mirror" not in body.symmetries else "mirror")

    def fitness_of(self, totals: NDArray[np.float64]) -> NDArray[np.float64]:
        """Forward reward of an episode, in m/s summed over control steps."""
        return np.asarray(totals[..., 0])

    def full_reward_of(self, totals: NDArray[np.float64]) -> NDArray[np.float64]:
        """Forward and healthy reward less the costs of effort and contact."""
        return np.asarray(np.sum(totals, axis=-1))

    def metres_of(self, fitness: float) -> float:
        """Distance along x that an episode with this forward reward led (m)."""
        return fitness / rules_of(self.model).forward_weight * self.seconds_of(1)

    def seconds_of(self, steps: float) -> float:
        """What so many control steps take (s)."""
        return steps * float(load(self.model).opt.timestep) * self._substeps

    @property
    def step_seconds(self) -> float:
        """The model's time step times its substeps (s)."""
        return self.seconds_of(1)

    def open(self, *, training: bool) -> Simulation:
        """Open a new world with the model's own noise on the initial pose."""
        return self.open_disturbed(training=training, reset_scale=self.usual_reset_scale())

    def open_disturbed(self, *, training: bool, reset_scale: float) -> Simulation:
        """Open a new world with noise of this size on the initial pose; training ends once there is no progress."""
        dynamics.load_library()
        model, data = load(self.model), mujoco.MjData(load(self.model))
        world = dynamics.RobotWorld(
            model=model._address,
            data=data._address,
            qpos=data.qpos,
            qvel=data.qvel,
            ctrl=data.ctrl,
            xpos=data.xpos,
            xipos=data.xipos,
            cfrc_ext=data.cfrc_ext,
            warnings=data.warning.number,
            initial_qpos=data.qpos.copy(),
            start_qpos=data.qpos.copy(),
            start_qvel=data.qvel.copy(),
            clock=np.zeros(3, dtype=np.int64),
            mark=np.zeros(1),
            max_steps=self.max_steps,
            progress=float(self.progress),
            patience=self.patience if training else 0,
            reset_scale=float(reset_scale),
            force_limit=FORCE_LIMIT,
            **self._sensors_and_actuators(model),
            **self._scoring(model),
        )
        functions = (dynamics.reset, dynamics.rewind, dynamics.observe, dynamics.step, dynamics.locate)
        sense, drive = (dynamics.sense, dynamics.drive) if self.frame == "part" else (None, None)
        return Simulation(world, *functions, sense=sense, drive=drive, owner=(model, data))

    def snapshot(self, world: dynamics.RobotWorld) -> NDArray[np.float64]:
        """(nq,) the pose."""
        return world.qpos.copy()

    def camera(self, width: int, height: int) -> Camera:
        """MuJoCo's renderer, which needs EGL, OSMesa or a screen."""
        from exneat_cli.tasks.robots.picture import RobotCamera

        return RobotCamera(load(self.model), self._anatomy[0].trunk, width, height)

    def adapter(self) -> Adapter:
        """Parts' own frames, and the range of the controls."""
        own = self._sensors_and_actuators(load(self.model))
        frames = own["frames"] if self.frame == "part" else None
        signs = np.ones(len(self.actuator_names)) if frames is None else frames.action_signs
        _, readings, _ = self._anatomy
        names = tuple(map(with_unit, readings.names, readings.units))
        return Adapter(names, frames, signs, own["middle"], own["span"], bounded=False)

    def open_batch(self, count: int, device: str, *, training: bool, reset_scale: float | None, room: int) -> Any:
        """Open `count` worlds on a device, with `room` times the usual room for contacts.

        Raises:
            ConfigError: MuJoCo Warp cannot simulate the model.
        """
        from exneat_cli.tasks.robots.batch.worlds import RobotWorlds

        scale = self.usual_reset_scale() if reset_scale is None else reset_scale
        simulation = self.open_disturbed(training=training, reset_scale=scale)
        return RobotWorlds(load(self.model), simulation, count, device, room)

    def _sensors_and_actuators(self, model: mujoco.MjModel) -> dict[str, Any]:
        low, high = np.where(model.actuator_ctrllimited[:, None], model.actuator_ctrlrange, (-1.0, 1.0)).T
        _, readings, sensing = self._anatomy
        return {
            "positions": readings.positions,
            "velocities": readings.velocities,
            "bodies": readings.bodies,
            "frames": sensing.frames,
            "middle": 0.5 * (low + high),
            "span": 0.5 * (high - low),
        }

    def _scoring(self, model: mujoco.MjModel) -> dict[str, Any]:
        rules, (body, readings, sensing) = rules_of(self.model), self._anatomy
        frames = sensing.frames
        slide = int(model.jnt_qposadr[body.root[0]])
        height = int(readings.positions[frames.height]) if frames.height >= 0 else -1
        initial = float(model.qpos0[height]) + frames.above
        lowest, highest = rules.heights or (HEALTHY_SHARES[0] * initial, HEALTHY_SHARES[1] * initial)
        pitched = not frames.free and rules.steepest < np.inf
        return {
            "trunk": body.trunk,
            "masses": model.body_mass.copy() if rules.speed == "mass" else np.zeros(0),
            "along": slide if rules.speed == "slide" else -1,
            "substeps": self._substeps,
            "control_period": float(model.opt.timestep) * self._substeps,
            "normal": rules.normal,
            "height": height,
            "above": frames.above,
            "lowest": lowest,
            "highest": highest,
            "pitch": int(readings.positions[frames.orientation]) if pitched else -1,
            "steepest": rules.steepest,
            "largest": rules.largest,
            "forward_weight": rules.forward_weight,
            "healthy_reward": rules.healthy_reward,
            "control_weight": THESIS_CONTROL_WEIGHT if self.reward == "thesis" else rules.control_weight,
            "contact_weight": rules.contact_weight,
            "cost_limit": rules.cost_limit,
            "largest_contact_cost": rules.largest_contact_cost,
        }

    @property
    def _substeps(self) -> int:
        period = rules_of(self.model).control_period if self.control_period is None else self.control_period
        timestep = float(load(self.model).opt.timestep)
        substeps = max(1, round(period / timestep))
        if abs(substeps * timestep - period) > 1e-9:
            expected = f"a multiple of the model's time step of {timestep:g} s"
            raise ConfigError("task.control_period", expected, period, f"the nearest is {substeps * timestep:g}")
        return substeps

    @property
    def _anatomy(self) -> tuple[Body, Readings, Sensing]:
        named = tuple((name, tuple(bodies)) for name, bodies in (self.part_bodies or {}).items())
        by_place = rules_of(self.model).named_by_place
        return _anatomy(
            load(self.model), by_place, self.part_order, self.symmetry, named, self.frame, self.contact_forces
        )


@functools.lru_cache(maxsize=64)
def _anatomy(
    model: mujoco.MjModel,
    by_place: bool,
    order: str,
    symmetry: str | None,
    named: tuple[tuple[str, tuple[str, ...]], ...],
    frame: str,
    contact_forces: bool,
) -> tuple[Body, Readings, Sensing]:
    body = take_apart(model, order=order, symmetry=symmetry, parts=dict(named), by_place=by_place)
    readings = read_off(model, body, contact_forces=contact_forces)
    return body, readings, (in_the_world if frame == "world" else in_own_frames)(model, body, readings)
