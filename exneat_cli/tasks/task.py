"""The interface of every task."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any, ClassVar, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

RUNNING = 0
"""The episode goes on."""
ENDED = 1
"""The episode has ended normally: solved, fallen, stuck or out of time."""
FAILED = 2
"""The simulation became unstable or a value was not finite; the episode's rewards do not count."""


def setting(name: str, default: Any) -> Any:
    """A dataclass field for the setting `name`, where that name is taken: ``parts``, for example, is a property."""
    return field(default=default, metadata={"setting": name})


@dataclass(frozen=True)
class Part:
    """A part of the body with its own sensors and possibly actuators.

    Attributes:
        name: unique within the task, e.g. ``front_left``.
        sensors: entries of the sensed values that belong to this part.
        actuators: entries of the action that move this part.
        position: (x, y) of the part seen from the trunk, x ahead and y to the left, in the task's length unit.
        height: of the part above the trunk's origin, in the same unit.
        likeness: number of its class of parts that are built alike; -1 if parts were not compared.
        is_mirrored: whether it is a mirror image of the first part of its class.
        joints: those of its sensors that read the positions and velocities of its joints.
        mirrored_joints: the entries that mirrored parts read instead.
        trunk: entries of the trunk's values as seen from this part.
    """

    name: str
    sensors: tuple[int, ...]
    actuators: tuple[int, ...]
    position: tuple[float, float]
    height: float = 0.0
    likeness: int = -1
    is_mirrored: bool = False
    joints: tuple[int, ...] = ()
    mirrored_joints: tuple[int, ...] = ()
    trunk: tuple[int, ...] = ()


@dataclass(frozen=True)
class Simulation:
    """One world and the functions that run episodes in it; use it from one thread at a time.

    A step is: `observe`, sensor noise, `sense`, brain, `drive`, `step`. The functions are compiled ones that take
    `world` as a tuple of arrays, or plain Python ones.

    Attributes:
        world: the storage, first argument of all functions.
        reset: ``reset(world, rng)`` draws everything random in a new world from a NumPy Generator, and starts it.
        rewind: ``rewind(world)`` takes the same world back to its start.
        observe: ``observe(world, readings)`` writes the noiseless readings, (`Task.observation_size`,).
        step: ``step(world, action, terms)`` acts once, writes this step's reward terms and returns
            `RUNNING`, `ENDED` or `FAILED`.
        locate: ``locate(world, row)`` writes where the agent is, in the order of `Task.trace_columns`; None if it has
            no location.
        sense: ``sense(world, readings, sensed)`` turns noisy readings into sensed values, (`Task.sensed_size`,); None
            if they are the same.
        drive: ``drive(world, action)`` turns a brain's outputs into the action that `step` takes, in place; None if
            they are the same.
        compiled: whether the functions are compiled.
        owner: keeps memory alive that `world` only points to.
    """

    world: Any
    reset: Callable[..., Any]
    rewind: Callable[..., Any]
    observe: Callable[..., Any]
    step: Callable[..., Any]
    locate: Callable[..., Any] | None = None
    sense: Callable[..., Any] | None = None
    drive: Callable[..., Any] | None = None
    compiled: bool = True
    owner: object = None


class Adapter(NamedTuple):
    """The conversions between a simulator and a brain, as data, so that a champion can run elsewhere.

    Attributes:
        readings: names of the simulator's readings, with units.
        frames: `exneat_cli.tasks.robots.frames.Frames`, how readings become sensed values; None if they are the same.
        signs: (A,) factors of the brain's outputs, 1 or -1.
        middle, span: (A,) the controls are middle + span * action.
        bounded: whether the action is first clipped to [-1, 1].
    """

    readings: tuple[str, ...]
    frames: Any
    signs: NDArray[np.float64]
    middle: NDArray[np.float64]
    span: NDArray[np.float64]
    bounded: bool


class Camera(Protocol):
    """Draws snapshots of worlds; belongs to one process."""

    def draw(self, snapshot: Any) -> NDArray[np.uint8]:
        """(height, width, 3) the picture of a `HasPicture.snapshot`; one of another size is made to fit."""


class Task(ABC):
    """A task's parameters, as a frozen dataclass with range checks, and the properties that follow from them."""

    terms: ClassVar[tuple[str, ...]]
    """Names of the reward terms that `Simulation.step` writes."""
    fitness_name: ClassVar[str] = "fitness"
    """Name of the fitness in sentences and on axes."""
    fitness_decimals: ClassVar[int] = 3
    """Number of meaningful decimal places."""
    failure_floor: ClassVar[float] = 0.0
    """Fitness of a failed episode."""
    observation_limits: ClassVar[tuple[float, float]] = (-np.inf, np.inf)
    """Limits to which noisy readings are clipped."""
    tie_noise: ClassVar[float] = 0.0
    """U(0, tie_noise) is added to each entry of the action, to break ties where the largest one wins."""
    recurrent: ClassVar[bool] = False
    """Whether networks are recurrent by default."""
    trace_columns: ClassVar[tuple[str, ...]] = ()
    """Names of the values that `Simulation.locate` writes."""
    trunk: ClassVar[Part | None] = None
    """Everything that belongs to no part, for a central module."""
    drawn_by_mujoco: ClassVar[bool] = False
    """Whether pictures need MuJoCo's renderer, and therefore EGL, OSMesa or a screen."""

    name: str
    """The task's name in `conf/task` and in run directories."""

    @property
    @abstractmethod
    def parts(self) -> tuple[Part, ...]:
        """The parts of the body, in the order that a geometry vector indexes."""

    @property
    @abstractmethod
    def observation_size(self) -> int:
        """Number of sensor readings."""

    @property
    @abstractmethod
    def actuator_names(self) -> tuple[str, ...]:
        """One name per entry of the action, with the unit of what it does if it has one, e.g. ``hip_1 (N m)``."""

    @property
    @abstractmethod
    def longest_episode(self) -> int:
        """Maximum number of control steps per episode."""

    @abstractmethod
    def open(self, *, training: bool) -> Simulation:
        """Open a new world; `training` switches on features of training, such as early stopping."""

    @property
    def sensed_size(self) -> int:
        """Number of values that brains sense: that of the readings, unless the simulation has a `sense` function."""
        return self.observation_size

    def identity(self) -> dict[str, Any]:
        """The parameters by which two tasks are the same, as plain data for a run's hash."""
        plain = self.to_plain()  # the order of parts matters, since geometry vectors follow it
        return {key: list(value.items()) if isinstance(value, dict) else value for key, value in plain.items()}

    def files(self) -> dict[str, bytes]:
        """Contents of the task's own files, which a run stores, by relative path."""
        return {}

    @classmethod
    def found_in(cls, section: Mapping[str, Any], directory: Path) -> dict[str, Any]:
        """Parameters as recorded by a run, which stores the task's `files` in `directory`."""
        return dict(section)

    def shared_by(self, subpopulations: Sequence[int]) -> Task:
        """The task once the subpopulation of each part's module is known, (parts,)."""
        return self

    @property
    def sensor_names(self) -> tuple[str, ...]:
        """Names of the sensed values, with their units, if any."""
        return tuple(f"sensor {entry}" for entry in range(self.sensed_size))

    def remarks_on(self, part: Part) -> dict[str, str]:
        """Further remarks on a part, by keyword."""
        return {}

    @property
    def whole(self) -> tuple[int, ...]:
        """Entries of the sensed values for a single network that senses everything, without duplicates."""
        return tuple(range(self.sensed_size))

    @property
    def action_bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Lowest and highest sensible action, one entry per actuator."""
        ones = np.ones(len(self.actuator_names))
        return -ones, ones

    @property
    def resting_action(self) -> NDArray[np.float64]:
        """The action that does nothing, (actuators,)."""
        return np.zeros(len(self.actuator_names))

    def to_plain(self) -> dict[str, Any]:
        """The parameters as plain data, by the names of their settings; see `setting`."""
        values = asdict(self)  # type: ignore[call-overload]
        return {each.metadata.get("setting", each.name): values[each.name] for each in fields(self)}  # type: ignore[arg-type]

    @property
    def step_seconds(self) -> float | None:
        """Duration of a control step (s); None if steps have no duration."""
        return None

    def drawable(self) -> Task:
        """The task in a form whose worlds can be drawn, see `HasPicture`; by default the task itself.

        Raises:
            ExneatError: its worlds cannot be drawn.
        """
        return self

    def fitness_of(self, totals: NDArray[np.float64]) -> NDArray[np.float64]:
        """(...) fitness of episodes whose terms add up to `totals`, (..., terms)."""
        return np.asarray(np.sum(totals, axis=-1))
