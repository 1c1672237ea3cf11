"""A champion from a stranger: refused by field, or a brain that stays within its own memory."""

from __future__ import annotations

import copy
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from exneat_cli.algorithms import Candidate, Team
from exneat_cli.brains import Brains
from exneat_cli.brains.brain import activate, lay_out, memory_size
from exneat_cli.errors import ExneatError
from exneat_cli.records import Score, write_json
from exneat_cli.records.champion import Champion, Genome, Scores, read_champion, write_hall_of_fame
from exneat_cli.runs import RunSettings
from exneat_cli.runs.training import Training
from exneat_cli.tasks import AntTask
from exneat_cli.wiring import Geometry

Place = tuple[Any, ...]


def score_of(mean: float) -> Score:
    """A score of two validation episodes."""
    return Score(2, mean, 0.0, mean, 0.0, 0, (mean, mean))


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """A champion with links and a central module, as data."""
    run = RunSettings(task=AntTask(), geometry=Geometry("lr"), linkage="full", population=4)
    team = Training.start(run).search.ask()[0][0]
    champion = Champion(
        variant=run.variant,
        task={"name": "ant"},
        sensors=run.task.sensor_names,
        actuators=run.task.actuator_names,
        feed_forward=True,
        scores=Scores(test=Score(3, 1.0, 0.5, 2.0, 0.5, 0, (0.5, 1.0, 1.5))),
        plan=run.plan,
        genomes=tuple(map(Genome.of, team.genomes)),
    )
    path = tmp_path_factory.mktemp("sound") / "champion.json"
    write_json(path, champion)
    assert read_champion(path) == champion
    for genome, written in zip(champion.genomes, team.genomes, strict=True):
        back = Genome(genome.id, genome.nodes[::-1], genome.connections[::-1]).in_arrays()
        assert np.array_equal(back.nodes, written.nodes)
        assert np.array_equal(back.connections, written.connections)
    return json.loads(path.read_text())  # type: ignore[no-any-return]


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


def read(folder: Path, content: object) -> Champion:
    path = folder / "champion.json"
    path.write_text(json.dumps(content))
    return read_champion(path)


def check_sizes(brain: Brains) -> None:
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
    st.sampled_from(["", "sensor", "tanh", "\x1b[31m", "\ud800", "x" * 300]),
    st.lists(st.integers(-2, 3), max_size=3),
    st.fixed_dictionaries({}, optional={key: st.integers(-2, 3) for key in ("name", "index", "\n")}),
)


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_whatever_is_changed_in_a_champion_it_is_refused_or_stays_within_its_memory(
    data: st.DataObject, sound: dict[str, Any], tmp_path: Path
) -> None:
    content = copy.deepcopy(sound)
    for _ in range(data.draw(st.integers(1, 2))):
        ways = st.sampled_from(list(places(content)))
        place = data.draw(ways)
        kind = data.draw(st.sampled_from(["delete", "replace", "copy", "nudge"]))
        inside = holder(content, place)
        if kind == "delete":
            del inside[place[-1]]
        elif kind == "copy":
            other = data.draw(ways)
            inside[place[-1]] = copy.deepcopy(holder(content, other)[other[-1]])
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
    memory, action = np.zeros(memory_size(lay_out([brain]))), np.zeros(brain.output_slot.shape[1])
    activate(lay_out([brain]), 0, memory, action)
    assert action.shape == (champion.plan.action_size,)


DAMAGES: list[tuple[Place, Any, str]] = [
    (("wurst",), 1, "unknown field wurst"),
    (("plan", "modules", 0, "pins", 0, "wurst"), 1, r"plan\.modules\[0\]\.pins\[0\]\.wurst: unknown key"),
    (("format",), True, "expected format 3, got True"),
    (("feed_forward",), 1, "feed_forward: expected true or false, got 1"),
    (("variant",), "\x1b[31mred", r"variant: expected text .*, got '\\x1b\[31mred'"),
    (("plan", "observation_size"), 10**12, "plan.observation_size: expected a whole number from 1 to"),
    (("plan", "action_size"), 9, "plan.action_size: expected a whole number from 8 to 8"),
    (("plan", "modules"), [], "number of modules: expected a whole number from 1"),
    (("plan", "modules", 0, "name"), "a\nb", r"plan\.modules\[0\]\.name: expected text"),
    (("plan", "modules", 0, "outputs"), 10**12, r"plan\.modules\[0\]\.outputs: expected"),
    (("plan", "modules", 0, "pins", -1, "module"), -2, r"pins\[\d+\]\.module: expected"),
    (("genomes",), [], "genomes: expected 3 of them"),
    (("genomes", 0, "nodes", 0, "id"), 10**30, r"genomes\[0\]\.nodes\[0\]\.id: expected"),
    (("genomes", 0, "nodes", 0, "id"), 1, "expected nodes with different ids"),
    (("genomes", 0, "nodes", 0, "activation"), "swish", r"activation: expected .*\(tanh\|.*, got 'swish'"),
    (("genomes", 0, "connections", 0, "from"), -999, "from at most"),
    (("genomes", 0, "connections", 0, "weight"), True, r"connections\[0\]\.weight: expected a number, got True"),
]


@pytest.mark.parametrize(
    ("place", "value", "named"), DAMAGES, ids=[f"{place[-3:]}={value!r}"[:50] for place, value, _ in DAMAGES]
)
def test_a_field_that_makes_no_sense_is_named(
    place: Place, value: Any, named: str, sound: dict[str, Any], tmp_path: Path
) -> None:
    content = copy.deepcopy(sound)
    holder(content, place)[place[-1]] = value
    with pytest.raises(ExneatError, match=rf"champion\.json: .*{named}"):
        read(tmp_path, content)
    del holder(content, place)[place[-1]]
    if isinstance(place[-1], str) and place[-1] not in ("wurst", "format", "module", "index"):
        with pytest.raises(ExneatError, match=rf"champion\.json: .*missing required field {place[-1]}"):
            read(tmp_path, content)


def test_a_feed_forward_champion_that_feeds_itself_is_refused(sound: dict[str, Any], tmp_path: Path) -> None:
    content = copy.deepcopy(sound)
    loop = {**content["genomes"][0]["connections"][0], "from": 0, "to": 0, "enabled": False}
    content["genomes"][0]["connections"].append(loop)
    with pytest.raises(ExneatError, match="feeds itself"):
        read(tmp_path, content)
    assert not read(tmp_path, {**content, "feed_forward": False}).feed_forward
    content["genomes"][0]["connections"].append(loop)
    with pytest.raises(ExneatError, match="at most one connection"):
        read(tmp_path, {**content, "feed_forward": False})


def test_the_hall_of_fame_is_one_team_a_line_the_best_on_validation_first(
    sound: dict[str, Any], tmp_path: Path
) -> None:
    genomes = tuple(genome.in_arrays() for genome in read(tmp_path, sound).genomes)
    entries = [Candidate(Team(genomes, ()), fitness, generation) for generation, fitness in enumerate([5.0, 6.0])]
    write_hall_of_fame(tmp_path / "hall_of_fame.jsonl", entries, [score_of(3.0), score_of(4.0)])
    lines = [json.loads(line) for line in (tmp_path / "hall_of_fame.jsonl").read_text().splitlines()]
    assert [(line["rank"], line["generation"], line["validation_fitness"]) for line in lines] == [(1, 2, 4), (2, 1, 3)]
    assert all(line["genomes"] == sound["genomes"] for line in lines)
