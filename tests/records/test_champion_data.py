"""A champion from a stranger: refused by field, or a brain that stays within its own memory."""

from __future__ import annotations

import copy
import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from exneat_cli.algorithms import Coevolution, EvolutionSettings, neat_config
from exneat_cli.brains.brain import Brain, activate, lay_out, memory_size
from exneat_cli.errors import ExneatError
from exneat_cli.records import Champion, read_champion, write_champion
from exneat_cli.tasks import AntTask
from exneat_cli.wiring import Geometry, Wiring, plan_wiring

Place = tuple[Any, ...]


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """A champion with links and a central module, as data."""
    task = AntTask()
    plan = plan_wiring(task, "exneat", Geometry("lr"), "full", Wiring(), hidden=2)
    configs = [neat_config(EvolutionSettings(), 4, shape) for shape in plan.subpopulation_shapes]
    seeds = np.random.SeedSequence(0).spawn(len(configs) + 1)
    team = Coevolution(configs, seeds[1:], seeds[0]).ask()[0]
    test = {"fitness_mean": 1.0, "fitness_std": 0.5, "episodes": 3}
    scores = {"training": {"fitness": 1.0}, "validation": {"fitness_mean": 1.0}, "test": test}
    variant, names = "exneat-lr-full", task.actuator_names
    champion = Champion(variant, {"name": "ant"}, names, True, plan, tuple(team.genomes), scores)
    path = tmp_path_factory.mktemp("sound") / "champion.json"
    write_champion(path, champion)
    assert read_champion(path).plan == plan
    content: dict[str, Any] = json.loads(path.read_text())
    return content


def places(content: Any, at: Place = ()) -> Iterator[Place]:
    """The way to every value; of long lists the first and the last entry."""
    if at:
        yield at
    if isinstance(content, dict):
        for key, value in content.items():
            yield from places(value, (*at, key))
    elif isinstance(content, list):
        for k in sorted({0, len(content) - 1} & set(range(len(content)))):
            yield from places(content[k], (*at, k))


def holder(content: Any, place: Place) -> Any:
    for key in place[:-1]:
        content = content[key]
    return content


def changed(content: dict[str, Any], place: Place, value: Any) -> dict[str, Any]:
    result = copy.deepcopy(content)
    holder(result, place)[place[-1]] = value
    return result


def read(folder: Path, content: object) -> Champion:
    path = folder / "champion.json"
    path.write_text(content if isinstance(content, str) else json.dumps(content))
    return read_champion(path)


def check_sizes(brain: Brain) -> None:
    """Every index that compiled code follows stays within the value vector."""
    nodes, edges = len(brain.node_slot), len(brain.edge_source)
    assert len(brain.edge_start) == nodes + 1
    assert brain.edge_start[0] == 0
    assert brain.edge_start[-1] == edges == len(brain.edge_weight)
    assert np.all(np.diff(brain.edge_start) >= 0)
    for slots in (brain.edge_source, brain.link_source, brain.output_slot):
        assert np.all((slots >= 0) & (slots < brain.size))
    for slots in (brain.node_slot, brain.link_slot):
        assert np.all((slots >= brain.observation_size) & (slots < brain.size - 1))
    assert np.all((brain.activation >= 0) & (brain.activation <= 3))


JSON = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-3, 130),
    st.sampled_from([-1, 2**31, 2**53, 2**63, -(2**63) - 1, 10**400]),
    st.floats(allow_nan=False, allow_infinity=False),
    st.sampled_from(["", "sensor", "output", "hidden", "tanh", "\x1b[31m", "\ud800", "x" * 300]),
    st.lists(st.integers(-2, 3), max_size=3),
    st.dictionaries(st.sampled_from(["name", "index", "\n"]), st.integers(-2, 3), max_size=2),
)


@settings(max_examples=120, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_whatever_is_changed_in_a_champion_it_is_refused_or_stays_within_its_memory(
    data: st.DataObject, sound: dict[str, Any], tmp_path: Path
) -> None:
    content = copy.deepcopy(sound)
    for _ in range(data.draw(st.integers(1, 2))):
        ways = list(places(content))
        place = data.draw(st.sampled_from(ways))
        kind = data.draw(st.sampled_from(["delete", "replace", "swap", "nudge"]))
        inside = holder(content, place)
        if kind == "delete":
            del inside[place[-1]]
        elif kind == "swap":
            other = data.draw(st.sampled_from(ways))
            if other[: len(place)] == place or place[: len(other)] == other:
                continue
            there = holder(content, other)
            inside[place[-1]], there[other[-1]] = there[other[-1]], inside[place[-1]]
        elif kind == "nudge" and type(inside[place[-1]]) is int:
            inside[place[-1]] += data.draw(st.sampled_from([-2, -1, 1, 2, 100]))
        else:
            inside[place[-1]] = data.draw(JSON)
    champion, refusal = None, ""
    try:
        champion = read(tmp_path, content)
    except ExneatError as error:
        refusal = str(error)
    if champion is None:
        assert "champion.json: " in refusal
        assert len(refusal.splitlines()) <= 2
        assert refusal.replace("\n", "").isprintable()
        return
    brain = champion.brain()
    check_sizes(brain)
    brains = lay_out([brain])
    memory, action = np.zeros(memory_size(brains)), np.zeros(len(brain.output_slot))
    activate(brains, 0, memory, action)
    assert action.shape == (champion.plan.action_size,)


DAMAGES: list[tuple[Place, Any, str]] = [
    (("wurst",), 1, "wurst: unknown field"),
    (("plan", "wurst"), 1, "plan.wurst: unknown field"),
    (("genomes", 0, "nodes", 0, "wurst"), 1, r"genomes\[0\]\.nodes\[0\]\.wurst: unknown field"),
    (("format",), 2, "format 1, got 2"),
    (("format",), True, "format 1, got True"),
    (("feed_forward",), 1, "feed_forward: expected true or false, got 1"),
    (("variant",), "\x1b[31mred", "variant: expected a word"),
    (("actuators", 0), "a\nb", r"actuators\[0\]: expected a word"),
    (("actuators",), "abcdefgh", "actuators: expected a list"),
    (("task",), [], "task: expected the task's parameters"),
    (("task", "size"), 10**400, "task.size: expected a number"),
    (("scores", "test", "fitness_mean"), None, "scores.test.fitness_mean: expected a number"),
    (("scores", "test"), {}, "scores.test: expected figures"),
    (("plan", "observation_size"), 10**12, "plan.observation_size: expected a whole number from 1 to"),
    (("plan", "observation_size"), 3, "reads what does not exist"),
    (("plan", "action_size"), -1, "plan.action_size: expected"),
    (("plan", "modules"), [], "plan.modules: expected a list of 1"),
    (("plan", "modules", 0, "hidden"), 10**9, r"plan\.modules\[0\]\.hidden: expected"),
    (("plan", "modules", 0, "outputs"), 3, "share genomes"),
    (("plan", "modules", 0, "pins"), [], "share genomes|reads what"),
    (("plan", "modules", 0, "subpopulation"), 9, "without gaps"),
    (("plan", "modules", 0, "position"), [0], "position: expected two numbers"),
    (("plan", "modules", 4, "drives"), [0, 0, 1, 2, 3, 4, 5, 6], "drive the same actuator"),
    (("plan", "modules", 4, "drives", 0), 8, r"drives\[0\]: expected a whole number from 0 to 7"),
    (("plan", "modules", 0, "pins", 0, "index"), -1, r"pins\[0\]\.index: expected"),
    (("plan", "modules", 0, "pins", 0, "kind"), "magic", r"pins\[0\]\.kind: expected one of sensor"),
    (("plan", "modules", 0, "pins", 0, "module"), 2, r"pins\[0\]\.module: expected"),
    (("plan", "modules", 0, "pins", -1, "module"), 99, "reads what does not exist"),
    (("genomes",), [], "genomes: expected 3 of them"),
    (("genomes", 0, "id"), -1, r"genomes\[0\]\.id: expected"),
    (("genomes", 0, "nodes", 0, "id"), 10**30, r"nodes\[0\]\.id: expected"),
    (("genomes", 0, "nodes", 0, "id"), 1, "expected different ids"),
    (("genomes", 0, "nodes", 0, "bias"), "0", r"nodes\[0\]\.bias: expected a number"),
    (("genomes", 0, "nodes", 0, "activation"), "swish", r"activation: expected one of tanh"),
    (("genomes", 0, "connections", 0, "from"), -999, r"connections\[0\]\.from: expected"),
    (("genomes", 0, "connections", 0, "from"), 999, "does not exist"),
    (("genomes", 0, "connections", 0, "enabled"), 1, "enabled: expected true or false"),
    (("genomes", 0, "connections", 0, "weight"), True, "weight: expected a number"),
]


@pytest.mark.parametrize(
    ("place", "value", "named"), DAMAGES, ids=[f"{place[-3:]}={value!r}"[:50] for place, value, _ in DAMAGES]
)
def test_a_field_that_makes_no_sense_is_named(
    place: Place, value: Any, named: str, sound: dict[str, Any], tmp_path: Path
) -> None:
    with pytest.raises(ExneatError, match=rf"champion\.json: .*({named})"):
        read(tmp_path, changed(sound, place, value))


@pytest.mark.parametrize("field", ["variant", "task", "actuators", "feed_forward", "scores", "plan", "genomes"])
def test_a_field_that_is_missing_is_named(field: str, sound: dict[str, Any], tmp_path: Path) -> None:
    with pytest.raises(ExneatError, match=f"damaged: {field} is missing"):
        read(tmp_path, {key: value for key, value in sound.items() if key != field})


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("", "expected JSON"),
        ("[" * 100_000, "nested too deeply"),
        ('{"format": 1, "format": 1}', "the key 'format' comes twice"),
        ('{"format": NaN}', "NaN is no number"),
        ('{"format": -Infinity}', "-Infinity is no number"),
        ('{"format": 1e999}', "the number 1e999 is too large"),
        ('{"format": ' + "9" * 5000 + "}", "expected JSON"),
        ("[1]", "expected a JSON object"),
    ],
    ids=lambda text: text[:20],
)
def test_json_that_says_something_else_to_every_reader_is_refused(text: str, named: str, tmp_path: Path) -> None:
    with pytest.raises(ExneatError, match=rf"champion\.json: .*{named}"):
        read(tmp_path, text)


def test_bytes_that_are_no_text_and_things_that_are_no_file_are_refused(tmp_path: Path) -> None:
    latin, pipe = tmp_path / "latin.json", tmp_path / "pipe.json"
    latin.write_bytes(b'{\n"a": "\xff"}')
    os.mkfifo(pipe)
    for path, named in ((latin, "latin.json:2: expected UTF-8"), (pipe, "a pipe"), (tmp_path, "a directory")):
        with pytest.raises(ExneatError, match=named):
            read_champion(path)
