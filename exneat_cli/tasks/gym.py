"""Any Gymnasium environment with Box observations and Box or Discrete actions.

It runs in plain Python, which is slower than the compiled tasks. Observations and Box actions of any shape are
flattened in C order:

| action space | entries of our action | meaning |
|---|---|---|
| Box | one per number | -1 is the lowest and 1 the highest value; without bounds, -1 and 1 are the values themselves |
| Discrete | one per action | the largest wins, after U(0, 1e-3) is added to each so that ties break fairly |

Scoring: the fitness of an episode is its return, the sum of its rewards.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import gymnasium
import mujoco
import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from exneat_cli.errors import (
    ConfigError,
    ExneatError,
    check_choice,
    check_keys,
    check_real,
    check_section,
    check_text,
    check_whole,
)
from exneat_cli.tasks.environments import (
    PICTURES,
    EnvironmentCamera,
    Interface,
    Snapshot,
    in_words,
    interface_of,
    make,
    picture_of,
    simulated_by_mujoco,
)
from exneat_cli.tasks.task import ENDED, FAILED, RUNNING, Adapter, Camera, Part, Simulation, Task, setting

LARGEST = 2**25
"""Most readings, or entries of actions, in one episode (256 MiB), since noise is kept for a whole episode."""
_OURS = ("id", "max_episode_steps", "disable_env_checker")
_ABOUT_THE_ACTION = (ArithmeticError, AssertionError, ValueError, gymnasium.error.InvalidAction, mujoco.FatalError)
"""Errors that environments raise for an action that they cannot take, or for the state that it leads to."""


@dataclass(frozen=True)
class GymTask(Task):
    """An environment by its id.

    Attributes:
        name: always ``gym``.
        env_id: an id for `gymnasium.make`; ``module:Env-v0`` imports the module first.
        kwargs: arguments of the environment's constructor, plain data.
        max_steps: control steps after which an episode ends, None for the environment's own limit.
        failure_floor: fitness of a failed episode; it should be below any ordinary return.
        part_entries: ``{name: {"sensors": [...], "actuators": [...]}}``, the setting ``task.parts``: entries of the
            observation and of the action of each part, in the order of geometry vectors; None makes one part of
            everything.

    Raises:
        ConfigError: a value is out of range, or the environment does not exist, cannot be made or has unsupported
            spaces.
    """

    name: str = "gym"
    env_id: str = "CartPole-v1"
    kwargs: Mapping[str, Any] = field(default_factory=dict)
    max_steps: int | None = None
    failure_floor: float = -10000.0  # type: ignore[misc]
    part_entries: Mapping[str, Mapping[str, Sequence[int]]] | None = setting("parts", None)

    terms: ClassVar[tuple[str, ...]] = ("reward",)
    fitness_name: ClassVar[str] = "return"
    fitness_decimals: ClassVar[int] = 1

    def __post_init__(self) -> None:
        check_choice("task.name", self.name, ["gym"])
        check_text("task.env_id", self.env_id, "the id of a Gymnasium environment")
        object.__setattr__(self, "kwargs", _checked_kwargs(self.kwargs))
        check_real("task.failure_floor", self.failure_floor, -1e300)
        if self.max_steps is not None:
            check_whole("task.max_steps", self.max_steps, 1, 1_000_000)
        elif self._interface.max_steps is None:
            fix = f"{self.env_id} has no limit of its own"
            raise ConfigError("task.max_steps", "a whole number from 1 to 1000000", None, fix)
        largest = max(self.observation_size, len(self.actuator_names))
        check_whole("task.max_steps", self.longest_episode, 1, LARGEST // largest)
        if self.part_entries is not None:
            _check_parts(self.part_entries, self.observation_size, len(self.actuator_names))

    @property
    def parts(self) -> tuple[Part, ...]:
        """The parts in the setting, evenly spaced on a circle for lack of places; or one part of everything."""
        if self.part_entries is None:
            everything = tuple(range(self.observation_size)), tuple(range(len(self.actuator_names)))
            return (Part("body", *everything, position=(0.0, 0.0)),)
        angles = np.arange(len(self.part_entries)) * math.tau / len(self.part_entries)
        places = np.round([np.cos(angles), np.sin(angles)], 12).T.tolist()
        return tuple(
            Part(name, tuple(own["sensors"]), tuple(own["actuators"]), (x, y))
            for (name, own), (x, y) in zip(self.part_entries.items(), places, strict=True)
        )

    @property
    def observation_size(self) -> int:
        """Numbers in an observation."""
        return self._interface.observation_size

    @property
    def actuator_names(self) -> tuple[str, ...]:
        """``action_0``, ``action_1``, ...: one per number of a Box, or per discrete action."""
        return tuple(f"action_{k}" for k in range(self._interface.actions))

    @property
    def longest_episode(self) -> int:
        """`max_steps`, or the environment's own limit."""
        return self.max_steps or self._interface.max_steps or 1

    @property
    def tie_noise(self) -> float:  # type: ignore[override]
        """As in the grid worlds if actions are discrete, else 0."""
        return 1e-3 if self._interface.is_discrete else 0.0

    @property
    def action_bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """-1 and 1 for a Box; 0 and 1 for discrete actions, so that random values choose all of them equally often."""
        ones = np.ones(self._interface.actions)
        return (np.zeros_like(ones) if self._interface.is_discrete else -ones), ones

    @property
    def resting_action(self) -> NDArray[np.float64]:
        """The values nearest to 0 that a Box allows; the first discrete action, regardless of its meaning."""
        interface = self._interface
        if interface.is_discrete:
            return np.asarray(np.eye(interface.actions)[0])
        low, high = interface.low, interface.high
        span = np.where(high > low, high - low, 1.0)
        return np.asarray(2.0 * (np.clip(0.0, low, high) - low) / span - 1.0)

    def open(self, *, training: bool) -> Simulation:
        """Make the environment; `training` has no effect."""
        world = _World(make(self.env_id, self.kwargs, self.max_steps), self._interface, self.env_id)
        return Simulation(world, _reset, _rewind, _observe, _step, compiled=False)

    def adapter(self) -> Adapter:
        """Scales actions to the bounds of a Box; discrete actions are left unscaled."""
        interface, ones = self._interface, np.ones(self._interface.actions)
        if interface.is_discrete:
            return Adapter(self.sensor_names, None, ones, 0.0 * ones, ones, bounded=False)
        low, high = interface.low, interface.high
        return Adapter(self.sensor_names, None, ones, 0.5 * (low + high), 0.5 * (high - low), bounded=True)

    @property
    def step_seconds(self) -> float | None:
        """Duration of a control step (s), from the environment's ``render_fps`` with one frame per step."""
        fps = self._interface.render_fps
        return 1.0 / fps if fps else None

    @property
    def drawn_by_mujoco(self) -> bool:  # type: ignore[override]
        """Whether MuJoCo simulates the environment."""
        return self._interface.is_mujoco

    def drawable(self) -> GymTask:
        """The same environment, made so that it returns pictures.

        Raises:
            ExneatError: it cannot return any.
        """
        if PICTURES not in (modes := self._interface.render_modes):
            came = f"expected an environment with the render mode {PICTURES}, got {', '.join(modes) or 'none'}"
            raise ExneatError(f"task.env_id={self.env_id}: {came}; it cannot be filmed")
        return replace(self, kwargs={**self.kwargs, "render_mode": PICTURES})

    def snapshot(self, world: _World) -> Snapshot:
        """The picture that the environment draws."""
        return picture_of(world.env, self.env_id)

    def camera(self, width: int, height: int) -> Camera:
        """Draws pictures in the environment's own size; `width` and `height` have no effect."""
        return EnvironmentCamera()

    @property
    def _interface(self) -> Interface:
        return interface_of(self.env_id, json.dumps(self.kwargs))


def _checked_kwargs(kwargs: object) -> dict[str, Any]:
    """The arguments in alphabetical order, so that their order does not change a run's hash."""
    section = check_section("task.kwargs", kwargs)
    try:
        json.dumps(section, allow_nan=False)
    except (TypeError, ValueError, RecursionError) as error:
        fix = "texts, finite numbers, true, false, null, lists and sections"
        raise ConfigError("task.kwargs", "plain data", kwargs, fix) from error
    for key in section:
        if not isinstance(key, str) or not key.isidentifier() or key in _OURS:
            fix = "task.max_steps limits episodes" if key in _OURS else ""
            raise ConfigError("task.kwargs", "names of the environment's own arguments", key, fix)
    return dict(sorted(section.items()))


def _check_parts(parts: object, sensors: int, actuators: int) -> None:
    """Refuse parts that lack sensors or actuators, overlap, or name entries that do not exist."""
    taken: dict[tuple[str, int], str] = {}
    if not check_section("task.parts", parts):
        raise ConfigError("task.parts", "at least one part, or null", parts)
    for name, own in check_section("task.parts", parts).items():
        check_text("task.parts", name, "names of parts")
        key = f"task.parts.{name}"
        check_keys(f"{key}.", check_section(key, own), ("sensors", "actuators"))
        for kind, count in (("sensors", sensors), ("actuators", actuators)):
            entries = own.get(kind)
            if not isinstance(entries, list | tuple) or not entries:
                raise ConfigError(f"{key}.{kind}", "a list of whole numbers, at least one", entries)
            for entry in entries:
                check_whole(f"{key}.{kind}", entry, 0, count - 1)
                if (kind, entry) in taken:
                    fix = f"task.parts.{taken[kind, entry]}.{kind} has {entry} already"
                    raise ConfigError(f"{key}.{kind}", "entries that occur only once in all parts", list(entries), fix)
                taken[kind, entry] = name


class _World:
    """An environment, the seed of its episode, its last observation, (S,), and how many warnings MuJoCo has given."""

    def __init__(self, env: gymnasium.Env[Any, Any], interface: Interface, env_id: str) -> None:
        self.env, self.interface, self.env_id = env, interface, env_id
        self.seed, self.observation = 0, np.zeros(interface.observation_size)
        self.data = simulated_by_mujoco(env)
        self.warnings = 0

    def see(self, observation: Any) -> None:
        """Store an observation of the environment."""
        seen = np.asarray(observation, dtype=np.float64).ravel()
        if seen.shape != self.observation.shape:
            sizes = f"expected observations of {self.observation.size} numbers, got {seen.size}"
            raise ExneatError(f"task.env_id={self.env_id}: {sizes}")
        self.observation = seen

    def new_warnings(self) -> bool:
        """Whether MuJoCo has warned since the last call: it resets an unstable simulation, and rewards would go on."""
        if self.data is None:
            return False
        before, self.warnings = self.warnings, int(self.data.warning.number.sum())
        return self.warnings != before

    def fault(self, function: str, error: Exception) -> ExneatError:
        """The error for an exception in the environment's own code."""
        return ExneatError(f"task.env_id={self.env_id}: its {function}() raised {in_words(error)}")


def _reset(world: _World, rng: Generator) -> None:
    world.seed = int(rng.integers(2**31))
    _rewind(world)


def _rewind(world: _World) -> None:
    try:
        observation, _ = world.env.reset(seed=world.seed)
    except Exception as error:  # of any code
        raise world.fault("reset", error) from error
    world.see(observation)
    world.new_warnings()


def _observe(world: _World, readings: NDArray[np.float64]) -> None:
    readings[:] = world.observation


def _step(world: _World, action: NDArray[np.float64], terms: NDArray[np.float64]) -> int:
    terms[0] = 0.0
    if not np.isfinite(action).all() or not np.isfinite(world.observation).all():
        return FAILED
    try:
        observation, reward, terminated, truncated, _ = world.env.step(world.interface.taken(action))
    except _ABOUT_THE_ACTION:
        return FAILED
    except Exception as error:  # of any code
        raise world.fault("step", error) from error
    world.see(observation)
    terms[0] = reward
    if world.new_warnings() or not np.isfinite(terms[0]) or not np.isfinite(world.observation).all():
        return FAILED
    return ENDED if terminated or truncated else RUNNING
