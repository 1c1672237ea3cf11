"""Check that a task keeps its contract, in its description and in its worlds, before anything runs.

Compiled code does not check bounds, so a wrong size would go unnoticed or crash the process.
"""

from __future__ import annotations

import contextlib
import dataclasses
import json
import math
import re
import sys
import time
import traceback
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exneat_cli.errors import ConfigError, ExneatError, check_flag, check_real, check_text, check_whole
from exneat_cli.interruption import uninterrupted
from exneat_cli.tasks.capabilities import HasFullReward, HasInitialPose
from exneat_cli.tasks.task import ENDED, FAILED, RUNNING, Part, Simulation, Task

TRIAL_SECONDS = 2.0
"""A trial episode is abandoned after this time (s), since a simulator's episode can take minutes."""
GUARD = 64
"""Number of guard entries behind each array, which nothing may write to."""
RESET_SCALE = 0.1
"""Noise on the initial pose, the default of runs."""
LONGEST_NAME = 200
"""Maximum length of the name of a sensor, an actuator, a part or a reward term."""
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,99}")
_tried: set[tuple[type[Task], str]] = set()


def is_ours(task: Task) -> bool:
    """Whether a task is one of exneat's own, whose contract is checked by the test suite."""
    return type(task).__module__.partition(".")[0] == __name__.partition(".")[0]


def check_description(task: Task) -> None:
    """Refuse invalid names, sizes and indices, without opening a world.

    Raises:
        ConfigError: one of them is invalid; the key is ``<class>.<member>``.
    """
    kind = type(task).__name__
    with _explained(kind, "a task whose members can be read"):
        if not isinstance(task.name, str) or not _NAME.fullmatch(task.name):
            raise ConfigError(f"{kind}.name", "one word of letters, digits, '.', '_' and '-'", task.name)
        _check_plain(task)
        for member in ("terms", "actuator_names", "trace_columns"):
            _check_names(f"{kind}.{member}", getattr(task, member), least=member != "trace_columns")
        for member in ("observation_size", "sensed_size", "longest_episode"):
            check_whole(f"{kind}.{member}", getattr(task, member), 1, 100_000_000)
        if not _are_names(task.sensor_names) or len(task.sensor_names) != task.sensed_size:
            expected = f"a tuple of texts, one for each of {task.sensed_size} entries that are sensed"
            raise ConfigError(f"{kind}.sensor_names", expected, task.sensor_names)
        _check_parts(task)
        _check_numbers(task)


def _check_plain(task: Task) -> None:
    """Refuse parameters that config.yaml cannot hold."""
    for field in dataclasses.fields(task):  # type: ignore[arg-type]
        value = getattr(task, field.name)
        try:
            json.dumps(value, allow_nan=False)
        except (TypeError, ValueError):
            expected = "a finite number, text, true, false, null, or lists and sections of these"
            raise ConfigError(f"task.{field.name}", expected, value) from None


def _are_names(names: Any) -> bool:
    texts = isinstance(names, tuple) and all(isinstance(name, str) for name in names)
    return texts and all(name.isprintable() and 0 < len(name) <= LONGEST_NAME for name in names)


def _check_names(key: str, names: Any, *, least: int) -> None:
    if not _are_names(names) or len(set(names)) < len(names) or len(names) < least:
        raise ConfigError(key, f"a tuple of {'at least one text' if least else 'texts'}, all different", names)


def _check_parts(task: Task) -> None:
    kind, parts, trunk = type(task).__name__, task.parts, task.trunk
    if not isinstance(parts, tuple) or not parts or not all(isinstance(part, Part) for part in parts):
        raise ConfigError(f"{kind}.parts", "a tuple of at least one exneat_cli.tasks.Part", parts)
    if trunk is not None and not isinstance(trunk, Part):
        raise ConfigError(f"{kind}.trunk", "an exneat_cli.tasks.Part, or None", trunk)
    driven: set[int] = set()
    for key, part in [*((f"{kind}.parts[{k}]", part) for k, part in enumerate(parts)), (f"{kind}.trunk", trunk)]:
        if part is None:
            continue
        sensors = _indices(f"{key}.sensors", part.sensors, task.sensed_size, "what brains sense")
        actuators = _indices(f"{key}.actuators", part.actuators, len(task.actuator_names), "the action")
        if not sensors:
            raise ConfigError(f"{key}.sensors", "at least one index", part.sensors)
        if driven & set(actuators):
            raise ConfigError(f"{key}.actuators", "actuators that no other part drives", part.actuators)
        if trunk is None and not actuators:
            fix = "without a trunk there is no central module that could drive something for it"
            raise ConfigError(f"{key}.actuators", "at least one index", part.actuators, fix)
        driven |= set(actuators)
        _check_position(f"{key}.position", part.position)
    _check_names(f"{kind}.parts: names", tuple(part.name for part in parts), least=1)


def _indices(key: str, came: Any, size: int, of: str) -> tuple[int, ...]:
    whole = isinstance(came, tuple) and all(type(index) is int and 0 <= index < size for index in came)
    if not whole or len(set(came)) < len(came):
        raise ConfigError(key, f"a tuple of different whole numbers (int) from 0 to {size - 1}, entries of {of}", came)
    return tuple(came)


def _check_position(key: str, came: Any) -> None:
    numbers = isinstance(came, tuple) and all(type(number) in (int, float) and math.isfinite(number) for number in came)
    if not numbers or len(came) != 2:
        raise ConfigError(key, "a tuple of two finite numbers, (x, y)", came)


def _check_numbers(task: Task) -> None:
    kind, actions = type(task).__name__, len(task.actuator_names)
    low, high = task.action_bounds
    for member, values in (("action_bounds", low), ("action_bounds", high), ("resting_action", task.resting_action)):
        _check_array(f"{kind}.{member}", values, (actions,))
    if not (low < high).all():
        raise ConfigError(f"{kind}.action_bounds", "lowest actions below the highest ones", (low, high))
    check_real(f"{kind}.failure_floor", task.failure_floor, -sys.float_info.max)
    check_real(f"{kind}.tie_noise", task.tie_noise, 0.0)
    check_flag(f"{kind}.recurrent", task.recurrent)
    check_text(f"{kind}.fitness_name", task.fitness_name)
    check_whole(f"{kind}.fitness_decimals", task.fitness_decimals, 0, 17)
    lowest, highest = task.observation_limits
    if not lowest < highest:
        raise ConfigError(f"{kind}.observation_limits", "a lower and a higher number", task.observation_limits)
    totals = np.zeros((2, 3, len(task.terms)))
    _check_array(f"{kind}.fitness_of", task.fitness_of(totals), (2, 3))
    if isinstance(task, HasFullReward):
        _check_array(f"{kind}.full_reward_of", task.full_reward_of(totals), (2, 3))


def _check_array(key: str, came: Any, shape: tuple[int, ...]) -> None:
    floats = isinstance(came, np.ndarray) and came.dtype == np.float64
    if not floats or came.shape != shape or not np.isfinite(came).all():
        raise ConfigError(key, f"finite numbers in an array of float64 of shape {shape}", came)


def check_worlds(task: Task) -> None:
    """Open the worlds of a user's task and run an episode in each, once per process; our own tasks are not tried.

    Raises:
        ConfigError: a function cannot be called as `Simulation` says, does not write what it should, writes beyond its
            array, or draws random numbers from elsewhere than its generator.
    """
    key = type(task), json.dumps(dataclasses.asdict(task), sort_keys=True)  # type: ignore[call-overload]
    if is_ours(task) or key in _tried:
        return
    for training in (True, False):
        with _explained(f"{type(task).__name__}.open", "a new exneat_cli.tasks.Simulation"):
            if isinstance(task, HasInitialPose):
                simulation = task.open_disturbed(training=training, reset_scale=RESET_SCALE)
            else:
                simulation = task.open(training=training)
        _Trial(task, simulation).run()
    _tried.add(key)


class _Trial:
    """One world of a task, whose functions are called with guarded arrays."""

    def __init__(self, task: Task, simulation: Any) -> None:
        self.task, self.simulation, self.kind = task, simulation, type(task).__name__
        if not isinstance(simulation, Simulation):
            raise ConfigError(f"{self.kind}.open", "an exneat_cli.tasks.Simulation", simulation)
        for name in ("reset", "rewind", "observe", "step", "locate", "sense", "drive"):
            self._check_function(name, getattr(simulation, name))
        for name, needed in (("sense", task.sensed_size != task.observation_size), ("locate", task.trace_columns)):
            if needed and getattr(simulation, name) is None:
                why = "sensed_size is not observation_size" if name == "sense" else "the task has trace_columns"
                raise ConfigError(f"{self.kind}.open: {name}", "a function", None, f"needed, since {why}")

    def _check_function(self, name: str, function: Any) -> None:
        if function is None and name in ("locate", "sense", "drive"):
            return
        if not callable(function) or (self.simulation.compiled and not hasattr(function, "py_func")):
            fix = "compile it with exneat_cli.compiling, or use Simulation(..., compiled=False)"
            raise ConfigError(f"{self.kind}.open: {name}", "a compiled function", function, fix)

    def run(self) -> None:
        """Run an episode of random actions, and check that `rewind` and `reset` restart the same world."""
        task, rng = self.task, np.random.default_rng(0)
        first = self._started("reset", np.random.default_rng(1))
        self._episode(rng)
        for start, arguments in (("rewind", ()), ("reset", (np.random.default_rng(1),))):
            again = self._started(start, *arguments)
            if again.tolist() != first.tolist():
                fix = "rewind takes a world back to its start; reset draws all chance from its generator"
                came = f"{first.tolist()} at first, {again.tolist()} after {start}"
                raise ConfigError(f"{self.kind}: {start}", "the same first readings", came, fix)
            self._call("step", task.resting_action, np.zeros(len(task.terms)))

    def _started(self, start: str, *arguments: Any) -> NDArray[np.float64]:
        self._call(start, *arguments)
        return self._written("observe", self.task.observation_size)

    def _episode(self, rng: np.random.Generator) -> None:
        """Act at random until the episode ends, within `longest_episode` steps, or `TRIAL_SECONDS` are over."""
        task, status, steps, began = self.task, RUNNING, 0, time.monotonic()
        low, high = task.action_bounds
        while status == RUNNING and time.monotonic() - began < TRIAL_SECONDS:
            if steps == task.longest_episode:
                expected = f"the end of an episode after at most {steps} steps, see longest_episode"
                raise ConfigError(f"{self.kind}: step", expected, "RUNNING")
            self._look()
            action = rng.uniform(low, high)
            if self.simulation.drive is not None:
                self._call("drive", action)
                _check_array(f"{self.kind}: drive", action, low.shape)
            status = self._step(action)
            steps += 1
        self._look()

    def _look(self) -> None:
        """Observe, sense and locate."""
        readings = self._written("observe", self.task.observation_size)
        if self.simulation.sense is not None:
            self._written("sense", self.task.sensed_size, readings)
        if self.simulation.locate is not None:
            self._written("locate", len(self.task.trace_columns))

    def _step(self, action: NDArray[np.float64]) -> int:
        size = len(self.task.terms)
        terms = np.full(size + GUARD, np.nan)
        status = self._call("step", action, terms[:size])
        if isinstance(status, bool | np.bool_) or status not in (RUNNING, ENDED, FAILED):
            raise ConfigError(f"{self.kind}: step", "RUNNING, ENDED or FAILED of exneat_cli.tasks", status)
        if status != FAILED:
            self._check_written("step", terms, size)
        return int(status)

    def _written(self, name: str, size: int, *arguments: Any) -> NDArray[np.float64]:
        values = np.full(size + GUARD, np.nan)
        self._call(name, *arguments, values[:size])
        self._check_written(name, values, size)
        return values[:size]

    def _check_written(self, name: str, values: NDArray[np.float64], size: int) -> None:
        """Refuse entries that are unwritten or not finite, and writes behind the array's end."""
        wrong = np.flatnonzero(~np.isfinite(values[:size]))
        if wrong.size:
            came = f"{values[wrong[0]]} in entry {wrong[0]}"
            raise ConfigError(f"{self.kind}: {name}", f"a finite number written to each of {size} entries", came)
        if not np.isnan(values[size:]).all():
            raise ConfigError(f"{self.kind}: {name}", f"nothing written beyond {size} entries", values.tolist())

    def _call(self, name: str, *arguments: Any) -> Any:
        signature = {"reset": "world, rng", "rewind": "world", "drive": "world, action", "locate": "world, row"}
        signature |= {"observe": "world, readings", "sense": "world, readings, sensed", "step": "world, action, terms"}
        function: Callable[..., Any] = getattr(self.simulation, name)
        # Compiled code that reads a generator must not be interrupted; any other function must be, since it may hang.
        guarded = uninterrupted() if name == "reset" else contextlib.nullcontext()
        with _explained(f"{self.kind}: {name}", f"a function that runs as {name}({signature[name]})"), guarded:
            return function(self.simulation.world, *arguments)


@contextlib.contextmanager
def _explained(key: str, expected: str) -> Iterator[None]:
    """Turn any exception of a user's code, except our own errors, into a `ConfigError`."""
    try:
        yield
    except ExneatError:
        raise
    except Exception as error:
        frames = [frame for frame in traceback.extract_tb(error.__traceback__) if "/numba/" not in frame.filename]
        place = "" if frames[-1].filename == __file__ else f"{frames[-1].filename}:{frames[-1].lineno}: "
        raise ConfigError(key, expected, type(error).__name__, place + " ".join(str(error).split())[:300]) from error
