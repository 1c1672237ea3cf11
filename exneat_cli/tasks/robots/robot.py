"""Any MuJoCo body that learns to walk along +x: Gymnasium's by name, our hexapod, or a model file of your own.

``exneat inspect task=robot task.model=...`` shows all sensed values with their units, which part drives what, which
parts are alike, and the geometries that fit. An action from -1 to 1 covers each actuator's range.

Scoring: the fitness of an episode is its forward reward, the sum of dx / dt over the control steps. The full reward
adds the healthy reward and subtracts the costs of effort and contact.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from exneat_cli.errors import ConfigError, check_choice, check_flag, check_real, check_text, check_whole
from exneat_cli.tasks.robots import dynamics
from exneat_cli.tasks.robots.body import SYMMETRIES, check_parts
from exneat_cli.tasks.robots.models import NAMED, Rules, digest_of, files_of, load, rules_of
from exneat_cli.tasks.robots.opening import Anatomy, anatomy_of, control_range, open_world
from exneat_cli.tasks.robots.readings import actuator_names, body_name, joint_name, with_unit
from exneat_cli.tasks.task import Adapter, Camera, Part, Simulation, Task, setting

REWARDS = ("thesis", "gymnasium")
THESIS_CONTROL_WEIGHT = 0.01
"""Weight of sum(control^2) with ``reward=thesis``: the thesis' full reward exceeds its forward reward by about 900 over
1000 steps, which is consistent with 0.01 (Zhang, 2025, table 5.5); Gymnasium's default for Ant is 0.5."""
LONGEST_PERIOD = 10.0
"""Maximum duration of a control step (s)."""


@dataclass(frozen=True)
class RobotTask(Task):
    """Parameters of a robot.

    Attributes:
        name: always ``robot``.
        model: path of an MJCF file, or a name in `models.NAMED`.
        part_order: ``position``: from front to back, left before right; ``model``: in the model's order.
        frame: ``world``: every part senses unchanged readings; ``part``: each one senses in its own frame.
        symmetry: ``turn`` or ``mirror``, the relation between alike parts; None derives it from the geometry.
        contact_forces: whether contact forces are sensed.
        part_bodies: names of each part's bodies, by the part's name; None finds the parts.
        control_period: seconds per control step, at most 10; None for the model's own.
        reward: weights of the full reward, ``gymnasium`` or ``thesis`` (with a lower cost of effort).
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
        return self._anatomy.sensing.parts

    @property
    def trunk(self) -> Part:  # type: ignore[override]
        """The trunk's sensors, and the actuators of its own joints."""
        return self._anatomy.sensing.trunk

    @property
    def whole(self) -> tuple[int, ...]:
        """Entries that a single network senses: those of all parts and of the trunk, without duplicates."""
        if self.frame == "world":
            return super().whole
        own = {entry for part in (*self.parts, self.trunk) for entry in part.sensors}
        return tuple(sorted(own))

    @property
    def sensor_names(self) -> tuple[str, ...]:
        """Names of the sensed values, with units, e.g. ``hip_1 position (rad)``."""
        return self._anatomy.sensing.names

    def remarks_on(self, part: Part) -> dict[str, str]:
        """The part's bodies, the part that it resembles, and its joints with the signs with which it senses them."""
        model, body = load(self.model), self._anatomy.body
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
        return len(self._anatomy.readings.names)

    @property
    def sensed_size(self) -> int:
        """Number of sensed values."""
        return len(self._anatomy.sensing.names)

    @property
    def actuator_names(self) -> tuple[str, ...]:
        """The driven joints, in the order of the action, with the torque or force of an action of 1."""
        return actuator_names(load(self.model))

    @property
    def longest_episode(self) -> int:
        """`max_steps`."""
        return self.max_steps

    def usual_reset_scale(self) -> float:
        """Noise on the initial pose according to the model's rules."""
        return self._rules.reset_scale

    def identity(self) -> dict[str, Any]:
        """The parameters, with a digest of the model's files in place of its name."""
        return {**super().identity(), "model": digest_of(self.model)}

    def files(self) -> dict[str, bytes]:
        """The model's files, unless it has a name."""
        return {} if self.model in NAMED else files_of(self.model)

    @classmethod
    def found_in(cls, section: Mapping[str, Any], directory: Path) -> dict[str, Any]:
        """Parameters as recorded by a run, with the model that it stores in `directory`."""
        kept = sorted(directory.rglob(Path(str(section.get("model"))).name)) if directory.is_dir() else []
        return {**section, "model": str(kept[0])} if kept else dict(section)

    def shared_by(self, subpopulations: Sequence[int]) -> RobotTask:
        """The task with its symmetry: turns if only these relate some parts that share a genome, else mirroring."""
        body = self._anatomy.body
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
        """Distance along x in an episode with this forward reward (m)."""
        return fitness / self._rules.forward_weight * self.step_seconds

    @property
    def step_seconds(self) -> float:
        """The model's time step times its substeps (s)."""
        return float(load(self.model).opt.timestep) * self._substeps

    def open(self, *, training: bool) -> Simulation:
        """Open a new world with the model's own noise on the initial pose."""
        return self.open_disturbed(training=training, reset_scale=self.usual_reset_scale())

    def open_disturbed(self, *, training: bool, reset_scale: float) -> Simulation:
        """Open a new world with noise of this size on the initial pose; training episodes end without progress."""
        dynamics.load_library()
        model = load(self.model)
        world, data = open_world(
            model,
            self._anatomy,
            self._rules,
            substeps=self._substeps,
            reset_scale=float(reset_scale),
            max_steps=self.max_steps,
            progress=float(self.progress),
            patience=self.patience if training else 0,
        )
        functions = (dynamics.reset, dynamics.rewind, dynamics.observe, dynamics.step, dynamics.locate)
        sense, drive = (dynamics.sense, dynamics.drive) if self.frame == "part" else (None, None)
        return Simulation(world, *functions, sense=sense, drive=drive, owner=(model, data))

    def snapshot(self, world: dynamics.RobotWorld) -> NDArray[np.float64]:
        """(nq,) the current pose."""
        return world.qpos.copy()

    def camera(self, width: int, height: int) -> Camera:
        """MuJoCo's renderer, which needs EGL, OSMesa or a screen."""
        from exneat_cli.tasks.robots.picture import RobotCamera

        return RobotCamera(load(self.model), self._anatomy.body.trunk, width, height)

    def adapter(self) -> Adapter:
        """The parts' own frames, and the range of the controls."""
        model, readings = load(self.model), self._anatomy.readings
        frames = self._anatomy.sensing.frames if self.frame == "part" else None
        signs = np.ones(len(self.actuator_names)) if frames is None else frames.action_signs
        names = tuple(map(with_unit, readings.names, readings.units))
        return Adapter(names, frames, signs, *control_range(model), bounded=False)

    def open_batch(self, count: int, device: str, *, training: bool, reset_scale: float | None, room: int) -> Any:
        """Open `count` worlds on a device, with `room` times the usual room for contacts and constraints.

        Raises:
            ConfigError: MuJoCo Warp cannot simulate the model.
        """
        from exneat_cli.tasks.robots.batch.worlds import RobotWorlds

        scale = self.usual_reset_scale() if reset_scale is None else reset_scale
        simulation = self.open_disturbed(training=training, reset_scale=scale)
        return RobotWorlds(load(self.model), simulation, count, device, room)

    @property
    def _substeps(self) -> int:
        period = self._rules.control_period if self.control_period is None else self.control_period
        timestep = float(load(self.model).opt.timestep)
        substeps = max(1, round(period / timestep))
        if abs(substeps * timestep - period) > 1e-9:
            expected = f"a multiple of the model's time step of {timestep:g} s"
            raise ConfigError("task.control_period", expected, period, f"the nearest is {substeps * timestep:g}")
        return substeps

    @property
    def _rules(self) -> Rules:
        rules = rules_of(self.model)
        return replace(rules, control_weight=THESIS_CONTROL_WEIGHT) if self.reward == "thesis" else rules

    @property
    def _anatomy(self) -> Anatomy:
        named = tuple((name, tuple(bodies)) for name, bodies in (self.part_bodies or {}).items())
        by_place = self._rules.named_by_place
        return anatomy_of(
            load(self.model), by_place, self.part_order, self.symmetry, named, self.frame, self.contact_forces
        )
