"""What every task offers to the other rooms."""

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
"""The episode is over in an ordinary way: solved, fallen, stuck or out of time."""
FAILED = 2
"""The simulation exploded or a value was not finite; nothing that it gave counts."""


def setting(name: str, default: Any) -> Any:
    """A dataclass field whose setting is called `name`, where the field itself cannot be: ``parts`` is a property."""
    return field(default=default, metadata={"setting": name})


@dataclass(frozen=True)
class Part:
    """A part of the body with its own sensors, and maybe its own actuators.

    Attributes:
        name: unique within the task, e.g. ``front_left``.
        sensors: entries of what brains sense that this part senses.
        actuators: entries of the action that move this part.
        position: (x, y) of the part seen from the trunk, x ahead and y to the left, in the task's length unit.
        height: of the part above the trunk's origin, in the same unit.
        likeness: number of the class of parts that are built alike; -1 where nobody compared them.
        is_mirrored: whether it is a mirrored one of the first part of its class.
        joints: those of its sensors that are positions and velocities of its joints.
        mirrored_joints: the entries that mirrored parts read instead.
        trunk: entries of the trunk as seen from this part.
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
        reset: ``reset(world, rng)`` draws all the chance of a new world from a NumPy Generator, and starts it.
        rewind: ``rewind(world)`` takes the same world back to its start.
        observe: ``observe(world, readings)`` writes the noiseless readings, (`Task.observation_size`,).
        step: ``step(world, action, terms)`` acts once, writes this step's reward terms and returns
            `RUNNING`, `ENDED` or `FAILED`.
        locate: ``locate(world, row)`` writes where the agent is, in the order of `Task.trace_columns`; None where it
            has no place.
        sense: ``sense(world, readings, sensed)`` turns noisy readings into what brains sense,
            (`Task.sensed_size`,); None where that is the same.
        drive: ``drive(world, action)`` turns what brains put out into what `step` takes, in place; None where
            that is the same.
        compiled: whether the functions are compiled.
        owner: keeps alive what `world` only points to.
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
    """What stands between a simulator and a brain, as data, so that a champion can run elsewhere.

    Attributes:
        readings: names of the simulator's readings, with units.
        frames: `exneat_cli.tasks.robots.frames.Frames`, how readings become what is sensed; None where they are that.
        signs: (A,) of the brain's outputs.
        middle, span: (A,) the controls are middle + span * action.
        bounded: whether the action is cut to [-1, 1] before.
    """

    readings: tuple[str, ...]
    frames: Any
    signs: NDArray[np.float64]
    middle: NDArray[np.float64]
    span: NDArray[np.float64]
    bounded: bool


class Camera(Protocol):
    """Draws what a world was; belongs to one process."""

    def draw(self, snapshot: Any) -> NDArray[np.uint8]:
        """(height, width, 3) the picture of a `HasPicture.snapshot`; one of another size is made to fit."""


class Task(ABC):
    """A task's parameters, a frozen dataclass with range checks, and what follows from them."""

    terms: ClassVar[tuple[str, ...]]
    """Names of the reward terms that `Simulation.step` writes."""
    fitness_name: ClassVar[str] = "fitness"
    """What the fitness is, in words, for sentences and axes."""
    fitness_decimals: ClassVar[int] = 3
    """Digits after the point that mean something to a reader."""
    failure_floor: ClassVar[float] = 0.0
    """Fitness of an episode that failed."""
    observation_limits: ClassVar[tuple[float, float]] = (-np.inf, np.inf)
    """What noisy readings are clipped to."""
    tie_noise: ClassVar[float] = 0.0
    """U(0, tie_noise) is added to each entry of the action, where the largest one wins."""
    recurrent: ClassVar[bool] = False
    """Whether networks are recurrent unless told otherwise."""
    trace_columns: ClassVar[tuple[str, ...]] = ()
    """Names of what `Simulation.locate` writes."""
    trunk: ClassVar[Part | None] = None
    """What belongs to no part, for a central module."""
    drawn_by_mujoco: ClassVar[bool] = False
    """Whether pictures need MuJoCo's renderer, and so EGL, OSMesa or a screen."""

    name: str
    """The task's name in `conf/task` and in run directories."""

    @property
    @abstractmethod
    def parts(self) -> tuple[Part, ...]:
        """The parts of the body, in the order that a geometry vector indexes."""

    @property
    @abstractmethod
    def observation_size(self) -> int:
        """Length of what the sensors read."""

    @property
    @abstractmethod
    def actuator_names(self) -> tuple[str, ...]:
        """One name per entry of the action, with the unit of what it does if it has one, e.g. ``hip_1 (N m)``."""

    @property
    @abstractmethod
    def longest_episode(self) -> int:
        """Control steps that no episode exceeds."""

    @abstractmethod
    def open(self, *, training: bool) -> Simulation:
        """Open a new world; `training` switches on what belongs to training only, such as early stopping."""

    @property
    def sensed_size(self) -> int:
        """Length of what brains sense: the readings, unless the world has a `sense` of its own."""
        return self.observation_size

    def identity(self) -> dict[str, Any]:
        """The parameters that make two tasks the same, as plain data for a run's hash."""
        plain = self.to_plain()  # the order of parts counts, since geometry vectors go by it
        return {key: list(value.items()) if isinstance(value, dict) else value for key, value in plain.items()}

    def files(self) -> dict[str, bytes]:
        """Contents of the files that the task is made of, which a run keeps, by their relative paths."""
        return {}

    @classmethod
    def found_in(cls, section: Mapping[str, Any], directory: Path) -> dict[str, Any]:
        """Parameters as a run recorded them, reading `files` where it keeps them."""
        return dict(section)

    def shared_by(self, subpopulations: Sequence[int]) -> Task:
        """The task once it is known which subpopulation each part belongs to, (parts,)."""
        return self

    @property
    def sensor_names(self) -> tuple[str, ...]:
        """What is sensed, entry by entry, with its unit if it has one."""
        return tuple(f"sensor {entry}" for entry in range(self.sensed_size))

    def remarks_on(self, part: Part) -> dict[str, str]:
        """What else there is to say of a part, by a word."""
        return {}

    @property
    def whole(self) -> tuple[int, ...]:
        """Entries of what is sensed for a single network that senses everything, each thing once."""
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
        """The parameters as plain data, by the names of their settings, see `setting`."""
        values = asdict(self)  # type: ignore[call-overload]
        return {each.metadata.get("setting", each.name): values[each.name] for each in fields(self)}  # type: ignore[arg-type]

    @property
    def step_seconds(self) -> float | None:
        """What a control step takes (s); None where steps have no duration."""
        return None

    def drawable(self) -> Task:
        """The task in the form whose worlds can be drawn, see `HasPicture`; itself unless that is another one.

        Raises:
            ExneatError: they cannot.
        """
        return self

    def fitness_of(self, totals: NDArray[np.float64]) -> NDArray[np.float64]:
        """(...) fitness of episodes whose terms add up to `totals`, (..., terms)."""
        return np.asarray(np.sum(totals, axis=-1))
