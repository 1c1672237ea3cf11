"""Ant: a four-legged body with eight hinges that learns to walk along +x.

The body and its physics are those of Gymnasium's Ant-v5 (Schulman et al., "High-dimensional continuous
control using generalized advantage estimation", 2015; Farama Foundation, 2024): MuJoCo, one control step
of 0.05 s made of five RK4 steps of 0.01 s.

Observation (105 numbers; contact forces clipped to [-1, 1], the rest unbounded):

| index | meaning | unit |
|---|---|---|
| 0 | height of the trunk | m |
| 1-4 | orientation of the trunk, quaternion w x y z | - |
| 5-12 | joint angles: hip 1, ankle 1, hip 2, ... ankle 4 | rad |
| 13-15 | velocity of the trunk along x, y, z | m/s |
| 16-18 | angular velocity of the trunk about x, y, z | rad/s |
| 19-26 | joint velocities, in the order of the angles | rad/s |
| 27-32 | external contact torque (3) and force (3) on the trunk | N m, N |
| 33-104 | the same for the three bodies of leg 1, of leg 2, ... leg 4 | N m, N |

Action (8 numbers in [-1, 1], times 150 N m): hip 4, ankle 4, hip 1, ankle 1, hip 2, ankle 2, hip 3, ankle 3.

By position, x ahead and y to the left, leg 1 is front left, leg 2 back left, leg 3 back right and leg 4
front right, whatever the names of the model's bodies say.

Scoring: the fitness of an episode is its forward reward, the sum of dx / dt over the control steps, so 20
times the metres walked. The full reward adds 1 per healthy step and subtracts costs for effort and
contact forces.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace
from importlib import resources
from typing import ClassVar

import mujoco
import numpy as np
from numpy.typing import NDArray

from exneat_cli.errors import check_choice, check_real, check_whole
from exneat_cli.tasks.robots import dynamics
from exneat_cli.tasks.robots.parts import FORCES_PER_BODY, SKIPPED_POSITIONS, find_parts
from exneat_cli.tasks.task import Part, Simulation, Task

CONTROL_WEIGHTS = {"thesis": 0.01, "gymnasium": 0.5}
"""Weight of sum(action^2). The thesis' full reward is about 900 above its forward reward over 1000 steps,
which leaves room for 0.01 (Zhang, 2025, table 5.5); Gymnasium's default is 0.5."""
CONTACT_WEIGHT = 5e-4
"""Weight of sum(clipped contact force^2), the same in both presets."""
HEALTHY_REWARD = 1.0
HEALTHY_HEIGHTS = (0.2, 1.0)
"""Metres; outside of them an episode ends. Gymnasium's Ant-v5."""
FORCE_LIMIT = 1.0
"""Contact forces (N) and torques (N m) are clipped to this, for sensors and cost alike. Gymnasium's Ant-v5."""
SUBSTEPS = 5
"""Physics steps of 0.01 s per control step."""
TRUNK_BODY = 1
"""Body 0 is the world."""
RESET_SCALE = 0.1
"""Noise on the initial pose, the default of Gymnasium's Ant-v5."""
ORDER_BY_POSITION = ("front_left", "front_right", "back_left", "back_right")


@dataclass(frozen=True)
class AntTask(Task):
    """Parameters of Ant.

    Attributes:
        name: always ``ant``.
        part_order: ``position`` orders the legs front left, front right, back left, back right;
            ``model`` takes the model file's order, front left, back left, back right, front right.
        reward: weights of the full reward, ``thesis`` or ``gymnasium``.
        max_steps: control steps (0.05 s each) after which an episode ends.
        progress: metres along x that count as progress, in training only.
        patience: steps without progress, at most 1000000, that end a training episode; 0 never ends one.

    Raises:
        ConfigError: a value is out of range.
    """

    name: str = "ant"
    part_order: str = "position"
    reward: str = "thesis"
    max_steps: int = 1000
    progress: float = 0.01
    patience: int = 100

    terms: ClassVar[tuple[str, ...]] = ("forward_reward", "healthy_reward", "control_cost", "contact_cost")
    fitness_name: ClassVar[str] = "forward reward"
    fitness_decimals: ClassVar[int] = 1
    failure_floor: ClassVar[float] = -100.0
    trace_columns: ClassVar[tuple[str, ...]] = ("x", "y", "z")
    """Position of the trunk in metres."""

    def __post_init__(self) -> None:
        check_choice("task.name", self.name, ["ant"])
        check_choice("task.part_order", self.part_order, ["position", "model"])
        check_choice("task.reward", self.reward, list(CONTROL_WEIGHTS))
        check_whole("task.max_steps", self.max_steps, 1, 1_000_000)
        check_real("task.progress", self.progress, 0.0)
        check_whole("task.patience", self.patience, 0, 1_000_000)

    @property
    def parts(self) -> tuple[Part, ...]:
        """The four legs; each senses 22 numbers and moves a hip and an ankle."""
        _, legs = _trunk_and_legs()
        if self.part_order == "position":
            return tuple(sorted(legs, key=lambda leg: ORDER_BY_POSITION.index(leg.name)))
        return tuple(legs)

    @property
    def trunk(self) -> Part:  # type: ignore[override]
        """The trunk's 17 sensors; it has no actuators of its own."""
        return _trunk_and_legs()[0]

    @property
    def observation_size(self) -> int:
        """105."""
        model = _model()
        return int(model.nq - SKIPPED_POSITIONS + model.nv + FORCES_PER_BODY * (model.nbody - 1))

    @property
    def actuator_names(self) -> tuple[str, ...]:
        """The eight hinges by name, in the order of the action."""
        model = _model()
        return tuple(model.joint(joint).name for joint in model.actuator_trnid[:, 0])

    @property
    def longest_episode(self) -> int:
        """`max_steps`."""
        return self.max_steps

    @property
    def action_bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Lowest and highest control of each actuator, -1 and 1."""
        low, high = _model().actuator_ctrlrange.T
        return low.copy(), high.copy()

    def fitness_of(self, totals: NDArray[np.float64]) -> NDArray[np.float64]:
        """Forward reward of an episode, in m/s summed over control steps."""
        return np.asarray(totals[..., 0])

    def full_reward_of(self, totals: NDArray[np.float64]) -> NDArray[np.float64]:
        """Forward and healthy reward less the costs of effort and contact."""
        return np.asarray(np.sum(totals, axis=-1))

    def open(self, *, training: bool) -> Simulation:
        """Open a new world with Gymnasium's default noise on the initial pose."""
        return self.open_disturbed(training=training, reset_scale=RESET_SCALE)

    def open_disturbed(self, *, training: bool, reset_scale: float) -> Simulation:
        """Open a new world with noise of this size on the initial pose; only in training does patience end episodes."""
        dynamics.load_library()
        model = _model()
        data = mujoco.MjData(model)
        world = dynamics.AntWorld(
            model=model._address,
            data=data._address,
            qpos=data.qpos,
            qvel=data.qvel,
            ctrl=data.ctrl,
            xpos=data.xpos,
            cfrc_ext=data.cfrc_ext,
            warnings=data.warning.number,
            initial_qpos=data.qpos.copy(),
            start_qpos=data.qpos.copy(),
            start_qvel=data.qvel.copy(),
            trunk=TRUNK_BODY,
            substeps=SUBSTEPS,
            control_period=float(model.opt.timestep) * SUBSTEPS,
            reset_scale=float(reset_scale),
            lowest=HEALTHY_HEIGHTS[0],
            highest=HEALTHY_HEIGHTS[1],
            force_limit=FORCE_LIMIT,
            healthy_reward=HEALTHY_REWARD,
            control_weight=CONTROL_WEIGHTS[self.reward],
            contact_weight=CONTACT_WEIGHT,
            max_steps=self.max_steps,
            progress=float(self.progress),
            patience=self.patience if training else 0,
            clock=np.zeros(3, dtype=np.int64),
            mark=np.zeros(1),
        )
        functions = (dynamics.reset, dynamics.rewind, dynamics.observe, dynamics.step, dynamics.locate)
        return Simulation(world, *functions, owner=(model, data))


@functools.cache
def _model() -> mujoco.MjModel:
    asset = resources.files("gymnasium") / "envs" / "mujoco" / "assets" / "ant.xml"
    return mujoco.MjModel.from_xml_string(asset.read_text(encoding="utf-8"))


@functools.cache
def _trunk_and_legs() -> tuple[Part, list[Part]]:
    """The legs by the names of where they stand, which are not those of the model's bodies."""
    trunk, legs = find_parts(_model())
    return replace(trunk, name="trunk"), [replace(leg, name=_quadrant(*leg.position)) for leg in legs]


def _quadrant(x: float, y: float) -> str:
    return f"{'front' if x > 0 else 'back'}_{'left' if y > 0 else 'right'}"
