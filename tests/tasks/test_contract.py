"""What is tried of a user's task before anything runs."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from exneat_cli.compiling import compiled_lean
from exneat_cli.errors import ConfigError
from exneat_cli.tasks import ENDED, FAILED, RUNNING, Part, Simulation, Task
from exneat_cli.tasks.contract import check_description, check_worlds


def reset(world: Any, rng: Any) -> None:
    world[0] = world[1] = rng.random()
    world[2] = 0.0


def rewind(world: Any) -> None:
    world[0], world[2] = world[1], 0.0


def observe(world: Any, readings: Any) -> None:
    readings[0], readings[1] = world[0], world[2]


def step(world: Any, action: Any, terms: Any) -> int:
    terms[0] = world[0]
    world[0] += 0.1 * action[0]
    world[2] += 1.0
    return ENDED if world[2] == 5.0 else RUNNING


def sense(world: Any, readings: Any, sensed: Any) -> None:
    sensed[0], sensed[1], sensed[2] = readings[0], readings[1], 1.0


def drive(world: Any, action: Any) -> None:
    action[0] *= -1.0


def locate(world: Any, row: Any) -> None:
    row[0] = world[0]


SOUND = {function.__name__: function for function in (reset, rewind, observe, step, sense, drive, locate)}


@dataclass(frozen=True)
class Drift(Task):
    """Sound unless a test changes it: functions by `put`, members in a subclass."""

    name: str = "drift"
    width: Any = 1.0
    put: ClassVar[dict[str, Any]] = {}
    is_compiled: ClassVar[bool] = False
    terms: ClassVar[Any] = ("way",)
    trace_columns: ClassVar[Any] = ("x",)
    parts: ClassVar[Any] = (Part("a", (0, 1), (0,), (0.0, 1.0)), Part("b", (1, 2), (1,), (0.0, -1.0)))
    trunk: ClassVar[Any] = None
    observation_size: ClassVar[Any] = 2
    sensed_size: ClassVar[Any] = 3
    actuator_names: ClassVar[Any] = ("push", "rest")
    longest_episode: ClassVar[Any] = 5

    def open(self, *, training: bool) -> Simulation:
        functions = {**SOUND, **self.put}
        if self.is_compiled:
            functions = {name: function and compiled_lean(function) for name, function in functions.items()}
        return Simulation(np.zeros(3), **functions, compiled=self.is_compiled)


def changed(**members: Any) -> Task:
    """`Drift` with other members; functions among them replace its own."""
    own = {name: members.pop(name) for name in list(members) if name in SOUND}
    values = {name: members.pop(name) for name in ("name", "width") if name in members}
    return type("Drift", (Drift,), {"put": own, **members})(**values)  # type: ignore[no-any-return]


def part(**changes: Any) -> dict[str, Any]:
    first, second = Drift.parts
    return {"parts": (dataclasses.replace(first, **changes), second)}


def test_a_sound_task_passes_compiled_or_not() -> None:
    for compiled in (False, True):
        check_description(changed(is_compiled=compiled))
        check_worlds(changed(is_compiled=compiled))


@pytest.mark.parametrize(
    ("members", "named"),
    [
        ({"name": "../x"}, "Drift.name: expected one word of letters"),
        ({"width": np.ones(2)}, "task.width: expected a finite number, text"),
        ({"width": float("nan")}, "task.width: expected a finite number"),
        ({"terms": ()}, "Drift.terms: expected a tuple of at least one text"),
        ({"terms": ["way"]}, "Drift.terms"),
        ({"actuator_names": ("push", "push")}, "Drift.actuator_names: expected a tuple of at least one text, all diff"),
        ({"observation_size": 2.0}, "Drift.observation_size: expected a whole number"),
        ({"observation_size": np.int64(2)}, "Drift.observation_size: expected a whole number"),
        ({"longest_episode": 0}, "Drift.longest_episode: expected a whole number"),
        ({"parts": [*Drift.parts]}, "Drift.parts: expected a tuple"),
        ({"parts": ("left", "right")}, "Drift.parts: expected a tuple of at least one exneat_cli.tasks.Part"),
        ({"parts": Drift.parts[:1] * 2}, "Drift.parts[1].actuators: expected actuators that no other part drives"),
        (part(name="b"), "Drift.parts: names: expected a tuple of at least one text, all different"),
        (part(sensors=(0, 3)), "Drift.parts[0].sensors: expected a tuple of different whole numbers (int) from 0 to 2"),
        (part(sensors=()), "Drift.parts[0].sensors: expected at least one index"),
        (part(sensors=tuple(np.arange(2))), "Drift.parts[0].sensors: expected a tuple of different whole numbers"),
        (part(actuators=(2,)), "Drift.parts[0].actuators"),
        (part(actuators=()), "without a trunk there is no central module"),
        (part(position=(0.0, np.inf)), "Drift.parts[0].position: expected a tuple of two finite numbers"),
        ({"trunk": "body"}, "Drift.trunk: expected an exneat_cli.tasks.Part, or None"),
        ({"trunk": Part("t", (5,), (), (0.0, 0.0))}, "Drift.trunk.sensors"),
        ({"action_bounds": (np.ones(2), np.ones(2))}, "Drift.action_bounds: expected lowest actions below"),
        ({"action_bounds": (np.zeros(2, int), np.ones(2))}, "Drift.action_bounds: expected finite numbers in an array"),
        ({"resting_action": np.zeros(3)}, "Drift.resting_action: expected finite numbers in an array of float64 of"),
        ({"fitness_of": lambda self, totals: totals.sum()}, "Drift.fitness_of: expected finite numbers in an array"),
        ({"fitness_of": lambda self, totals: totals[..., 4]}, "Drift: expected a task whose members can be read"),
        ({"failure_floor": None}, "Drift.failure_floor"),
        ({"tie_noise": -1.0}, "Drift.tie_noise"),
        ({"observation_limits": (1.0, -1.0)}, "Drift.observation_limits: expected a lower and a higher number"),
        ({"recurrent": "yes"}, "Drift.recurrent"),
        ({"parts": property(lambda self: 1 / 0)}, "ZeroDivisionError"),
    ],
)
def test_what_a_task_says_of_itself_makes_sense(members: dict[str, Any], named: str) -> None:
    with pytest.raises(ConfigError) as caught:
        check_description(changed(**members))
    check_lines(caught.value, named)


def check_lines(error: ConfigError, named: str) -> None:
    assert named in str(error)
    assert len(str(error).splitlines()) <= 3


indices = st.lists(st.integers(-1, 4), max_size=4).map(tuple)


@given(sensors=st.tuples(indices, indices), actuators=st.tuples(indices, indices))
def test_indices_pass_exactly_if_they_exist_and_nothing_is_driven_twice(sensors: Any, actuators: Any) -> None:
    parts = tuple(Part(f"p{k}", sensors[k], actuators[k], (0.0, 0.0)) for k in range(2))
    both = actuators[0] + actuators[1]
    sound = all(0 < len(set(own)) == len(own) and set(own) <= {0, 1, 2} for own in sensors)
    sound &= sorted(both) == [0, 1] and all(actuators)
    try:
        check_description(changed(parts=parts))
    except ConfigError:
        assert not sound
    else:
        assert sound


def with_wrong_end(world: Any, action: Any, terms: Any) -> int:
    terms[0] = 0.0
    return RUNNING


def with_wrong_status(world: Any, action: Any, terms: Any) -> int:
    terms[0] = 0.0
    return 7


def that_leaves_terms(world: Any, action: Any, terms: Any) -> int:
    return ENDED


def that_fails(world: Any, action: Any, terms: Any) -> int:
    return FAILED


def that_writes_one(world: Any, readings: Any) -> None:
    readings[0] = world[0]


def that_turns_nan(world: Any, readings: Any) -> None:
    readings[0], readings[1] = world[0], np.nan if world[2] == 3.0 else 0.0


def that_forgets(world: Any) -> None:
    world[2] = 0.0


def that_keeps_something(world: Any, rng: Any) -> None:
    world[0] = world[1] = world[0] + rng.random()
    world[2] = 0.0


def that_drives_nan(world: Any, action: Any) -> None:
    action[0] = np.nan


def that_takes_less(world: Any) -> None:
    world[0] = 0.0


WORLDS = {
    "no end": ({"step": with_wrong_end}, "Drift: step: expected the end of an episode after at most 5 steps"),
    "late end": ({"longest_episode": 4}, "Drift: step: expected the end of an episode after at most 4 steps"),
    "status": (
        {"step": with_wrong_status},
        "Drift: step: expected RUNNING, ENDED or FAILED of exneat_cli.tasks, got 7",
    ),
    "terms": ({"step": that_leaves_terms}, "Drift: step: expected a finite number written to each of 1 entries"),
    "half": ({"observe": that_writes_one}, "written to each of 2 entries, got 'nan in entry 1'"),
    "nan": ({"observe": that_turns_nan}, "written to each of 2 entries, got 'nan in entry 1'"),
    "rewind": ({"rewind": that_forgets}, "Drift: rewind: expected the same first readings"),
    "reset": ({"reset": that_keeps_something}, "Drift: reset: expected the same first readings"),
    "drive": ({"drive": that_drives_nan}, "Drift: drive: expected finite numbers"),
    "signature": ({"observe": that_takes_less}, "Drift: observe: expected a function that runs as observe(world, read"),
    "no sense": ({"sense": None}, "Drift.open: sense: expected a function, got None\n  needed, since sensed_size"),
    "no locate": ({"locate": None}, "Drift.open: locate: expected a function, got None\n  needed, since the task has"),
}
"""What is wrong with a world, compiled or not, and what is said."""


@pytest.mark.parametrize(
    ("name", "is_compiled"), [*((name, False) for name in WORLDS), ("status", True), ("signature", True)]
)
def test_a_world_does_what_its_task_says(name: str, is_compiled: bool) -> None:
    members, named = WORLDS[name]
    task = changed(**members, is_compiled=is_compiled)
    check_description(task)
    with pytest.raises(ConfigError) as caught:
        check_worlds(task)
    check_lines(caught.value, named)


@pytest.mark.parametrize("is_compiled", [False, True])
def test_writing_beyond_an_array_is_noticed(is_compiled: bool) -> None:
    def observe(world: Any, readings: Any) -> None:
        for k in range(3):
            readings[k] = world[0]

    task = changed(observe=observe, is_compiled=is_compiled)
    with pytest.raises(ConfigError, match="nothing written beyond 2 entries" if is_compiled else "IndexError"):
        check_worlds(task)


def test_plain_functions_are_not_taken_for_compiled_ones() -> None:
    class Plain(Drift):
        def open(self, *, training: bool) -> Simulation:
            return Simulation(np.zeros(3), **SOUND)

    with pytest.raises(ConfigError, match=r"reset: expected a compiled function, .*\n  compile it .* compiled=False"):
        check_worlds(Plain())


def test_a_task_that_always_fails_passes_and_one_that_opens_nothing_is_refused() -> None:
    check_worlds(changed(step=that_fails))
    with pytest.raises(ConfigError, match=r"Drift.open: expected an exneat_cli.tasks.Simulation, got None"):
        check_worlds(changed(open=lambda self, training: None))
