"""What every task offers to the other rooms."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

RUNNING = 0
"""The episode goes on."""
ENDED = 1
"""The episode is over in an ordinary way: solved, fallen, stuck or out of time."""
FAILED = 2
"""The simulation exploded or a value was not finite; nothing that it gave counts."""


FUNCTIONS = ("reset", "rewind", "observe", "step", "locate")
"""What a module that simulates a task must define; see `Simulation`."""


@dataclass(frozen=True)
class Part:
    """A place of the body with its own sensors, and maybe its own actuators.

    Attributes:
        name: unique within the task, e.g. ``front_left``; named geometries go by it.
        sensors: entries of the observation that this place senses.
        actuators: entries of the action that move this place.
        position: (x, y) of the place seen from the trunk, x ahead and y to the left, in the task's
            length unit.
    """

    name: str
    sensors: tuple[int, ...]
    actuators: tuple[int, ...]
    position: tuple[float, float]


@dataclass(frozen=True)
class Simulation:
    """One world and the five functions that run episodes in it; use it from one thread at a time.

    The functions are compiled ones that take `world` as a tuple of arrays, or plain Python ones.

    Attributes:
        world: the storage, first argument of all five.
        reset: ``reset(world, rng)`` draws all the chance of a new world from a NumPy Generator, and starts it.
        rewind: ``rewind(world)`` takes the same world back to its start.
        observe: ``observe(world, observation)`` writes the noiseless observation.
        step: ``step(world, action, terms)`` acts once, writes this step's reward terms and returns
            `RUNNING`, `ENDED` or `FAILED`.
        locate: ``locate(world, row)`` writes where the agent is, in the order of `Task.trace_columns`.
        compiled: whether the functions are compiled.
        owner: keeps alive what `world` only points to.
    """

    world: Any
    reset: Callable[..., Any]
    rewind: Callable[..., Any]
    observe: Callable[..., Any]
    step: Callable[..., Any]
    locate: Callable[..., Any]
    compiled: bool
    owner: object = None

    @classmethod
    def of(cls, functions: Any, world: object, *, compiled: bool = True, **others: Any) -> Simulation:
        """A simulation whose functions are those of a module or namespace, unless `others` names one.

        Args:
            functions: has `reset`, `rewind`, `observe`, `step` and `locate`.
            world: the storage they work on.
            compiled: whether they are compiled.
            others: replace single fields, e.g. `reset` or `owner`.
        """
        named = {name: getattr(functions, name, None) for name in FUNCTIONS}
        return cls(world=world, compiled=compiled, **{**named, **others})


class Task(Protocol):
    """A task's parameters, and what follows from them."""

    terms: ClassVar[tuple[str, ...]]
    """Names of the reward terms that `Simulation.step` writes."""
    fitness_name: ClassVar[str]
    """What the fitness is, in words, for sentences and axes."""
    fitness_decimals: ClassVar[int]
    """Digits after the point that mean something to a reader."""
    failure_floor: ClassVar[float]
    """Fitness of an episode that failed."""
    observation_limits: ClassVar[tuple[float, float]]
    """What noisy inputs are clipped to."""
    tie_noise: ClassVar[float]
    """U(0, tie_noise) is added to each entry of the action, where the largest one wins."""
    needs_memory: ClassVar[bool]
    """Whether networks are recurrent by default."""
    has_full_reward: ClassVar[bool]
    """Whether there is a second figure besides the fitness."""
    has_initial_pose: ClassVar[bool]
    """Whether `noise.reset_scale` means anything."""

    @property
    def name(self) -> str:
        """The task's name in `conf/task` and in run directories."""

    @property
    def trace_columns(self) -> tuple[str, ...]:
        """Names of what `Simulation.locate` writes."""

    @property
    def resting_action(self) -> NDArray[np.float64]:
        """The action that does nothing, (actuators,)."""

    @property
    def parts(self) -> tuple[Part, ...]:
        """The places of the body, in the order that a geometry vector indexes."""

    @property
    def trunk(self) -> Part | None:
        """What belongs to no part, for a central module; None if there is no such thing."""

    @property
    def observation_size(self) -> int:
        """Length of the observation."""

    @property
    def actuator_names(self) -> tuple[str, ...]:
        """One name per entry of the action."""

    @property
    def longest_episode(self) -> int:
        """Control steps that no episode exceeds."""

    @property
    def action_bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Lowest and highest sensible action, one entry per actuator."""

    def open(self, *, training: bool, reset_scale: float) -> Simulation:
        """A new world; `training` switches on what belongs to training only, such as early stopping."""

    def tiles(self, world: Any) -> NDArray[np.float64] | None:
        """(N, N, 3) path (1 or 0) and both channels of every tile of a grid world; None elsewhere."""

    def fitness_of(self, totals: NDArray[np.float64]) -> NDArray[np.float64]:
        """(...) fitness of episodes whose terms add up to `totals`, (..., terms)."""

    def full_reward_of(self, totals: NDArray[np.float64]) -> NDArray[np.float64]:
        """(...) the second figure that tests report; equals the fitness where a task has only one."""
