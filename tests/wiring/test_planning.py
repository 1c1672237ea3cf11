"""Geometries, and plans: widths, links and what is refused."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from exneat_cli.algorithms import ALGORITHMS, EvolutionSettings
from exneat_cli.errors import ConfigError
from exneat_cli.tasks import AntTask, Part, Task
from exneat_cli.wiring import Geometry, Pin, Plan, Wiring, peers_of, plan_body, plan_modules

AROUND = ["front_left", "back_left", "back_right", "front_right"]


def ant_plan(
    geometry: str = "all", linkage: str = "none", *, central: bool | None = None, width: int = 2, hidden: int = 4
) -> Plan:
    return plan_modules(AntTask(), Geometry(geometry), linkage, Wiring(central, width), hidden=hidden)


def test_neat_is_one_module_that_senses_and_drives_everything() -> None:
    plan = plan_body(AntTask(), hidden=6)
    assert plan.subpopulation_shapes == ((105, 6, 8),)
    (body,) = plan.modules
    assert body.sensors == tuple(range(105))
    assert body.drives == tuple(range(8))


def test_sizes_are_those_of_the_design() -> None:
    assert ant_plan().subpopulation_shapes == ((22, 4, 2),) * 4 + ((25, 4, 8),)
    assert ant_plan(linkage="hidden").subpopulation_shapes[0] == (34, 4, 2)
    assert ant_plan(linkage="output").subpopulation_shapes[0] == (28, 4, 2)
    assert ant_plan(linkage="feedback").subpopulation_shapes[0] == (30, 4, 2)
    assert ant_plan(linkage="full").subpopulation_shapes[0] == (48, 4, 2)
    assert ant_plan(width=5).subpopulation_shapes == ((22, 4, 5),) * 4 + ((37, 4, 8),)
    assert ant_plan("single", central=False).subpopulation_shapes == ((22, 4, 2),)


def test_every_actuator_is_driven_once_with_and_without_a_central_module() -> None:
    assert ant_plan().modules[-1].drives == tuple(range(8))
    assert sorted(a for module in ant_plan(central=False).modules for a in module.drives) == list(range(8))


def test_peers_come_counter_clockwise_from_the_own_leg() -> None:
    legs = AntTask().parts
    for own, leg in enumerate(legs):
        start = AROUND.index(leg.name)
        assert [legs[peer].name for peer in peers_of(legs, own)] == (AROUND * 2)[start + 1 : start + 4]


def test_links_of_a_shared_genome_mean_the_same_at_every_leg_and_are_delayed() -> None:
    *legs, central = ant_plan("single", "full").modules
    patterns = set()
    for leg, part in zip(legs, AntTask().parts, strict=True):
        start = AROUND.index(leg.name)
        links = [pin for pin in leg.pins if not pin.is_sensor]
        feedback = [pin.index for pin in links if pin.module == len(legs)]
        assert tuple(feedback[:2]) == part.actuators
        assert AntTask().actuator_names[feedback[0]].startswith("hip")
        turns = [
            (pin.index, (AROUND.index(legs[pin.module].name) - start) % 4) for pin in links if pin.module < len(legs)
        ]
        patterns.add(tuple(turns))
        assert all(pin.delayed for pin in links)
    assert len(patterns) == 1
    assert not any(pin.delayed for pin in central.pins)


@pytest.mark.parametrize("pin", [Pin(105), Pin(-1), Pin(6, 0), Pin(12, 4), Pin(0, 9)])
def test_a_plan_that_reads_what_does_not_exist_is_refused(pin: Pin) -> None:
    plan = ant_plan(linkage="full")
    plan.check()
    first, *others = plan.modules
    with pytest.raises(ValueError, match="front_left has a pin that reads what does not exist"):
        replace(plan, modules=(replace(first, pins=(*first.pins, pin)), *others)).check()


def test_a_plan_that_drives_what_does_not_exist_is_refused() -> None:
    (body,) = plan_body(AntTask(), hidden=6).modules
    with pytest.raises(ValueError, match="body drives an actuator that does not exist"):
        Plan((replace(body, drives=(0, 8)),), 105, 8).check()
    with pytest.raises(ValueError, match="more actuators than it has outputs"):
        Plan((replace(body, outputs=3),), 105, 8).check()
    with pytest.raises(ValueError, match="without gaps"):
        Plan((replace(body, subpopulation=1),), 105, 8).check()


@pytest.mark.parametrize("algorithm", ["neat", "random"])
@pytest.mark.parametrize(
    ("geometry", "linkage", "wiring", "key"),
    [
        ("all", "none", Wiring(), "geometry"),
        ("single", "hidden", Wiring(), "linkage"),
        ("single", "none", Wiring(central=True), "wiring.central"),
        ("single", "none", Wiring(output_width=4), "wiring.output_width"),
    ],
)
def test_algorithms_without_modules_refuse_what_is_about_modules(
    algorithm: str, geometry: str, linkage: str, wiring: Wiring, key: str
) -> None:
    with pytest.raises(ConfigError, match=f"{key}: .*\n.*algorithm={algorithm}"):
        ALGORITHMS[algorithm](algorithm).plan(AntTask(), Geometry(geometry), linkage, wiring, EvolutionSettings())


def planned(task: Task, geometry: str = "single", central: bool | None = None) -> Plan:
    return plan_modules(task, Geometry(geometry), "none", Wiring(central), hidden=4)


def test_sharers_of_different_widths_are_refused() -> None:
    class Lopsided(AntTask):
        @property
        def parts(self):  # type: ignore[no-untyped-def]
            one, *others = super().parts
            return (replace(one, sensors=one.sensors[:-1]), *others)

    with pytest.raises(ConfigError, match="modules of equal size"):
        planned(Lopsided())
    assert planned(Lopsided(), "all")


def test_a_central_module_is_refused_where_there_is_no_trunk() -> None:
    class Trunkless(AntTask):
        trunk = None  # type: ignore[assignment]

    with pytest.raises(ConfigError, match="no trunk"):
        planned(Trunkless(), central=True)
    assert "central" not in [module.name for module in planned(Trunkless()).modules]


def test_a_plan_is_made_of_what_brains_sense_not_of_what_sensors_read() -> None:
    class InAnotherFrame(AntTask):
        sensed_size = 200  # type: ignore[assignment]

    assert planned(InAnotherFrame()).observation_size == 200
    assert plan_body(InAnotherFrame(), hidden=0).subpopulation_shapes == ((200, 0, 8),)


def parts(count: int) -> tuple[Part, ...]:
    return tuple(Part(f"s{k}", (k,), (k,), (float(k), 0.0)) for k in range(count))


@pytest.mark.parametrize(
    ("name", "vector"),
    [
        ("single", (0, 0, 0, 0)),
        ("fb", (0, 0, 1, 1)),
        ("lr", (0, 1, 0, 1)),
        ("cross", (0, 1, 1, 0)),
        ("all", (0, 1, 2, 3)),
    ],
)
def test_named_geometries_on_ant_are_those_of_the_design(name: str, vector: tuple[int, ...]) -> None:
    assert Geometry(name).subpopulations(AntTask().parts) == vector
    assert Geometry(name).subpopulations(AntTask(part_order="model").parts) == vector


def test_by_position_fb_pairs_front_legs_and_by_model_order_left_legs() -> None:
    def first_pair(order: str) -> set[str]:
        legs = AntTask(part_order=order).parts
        vector = Geometry("fb").subpopulations(legs)
        return {leg.name for leg, entry in zip(legs, vector, strict=True) if entry == 0}

    assert first_pair("position") == {"front_left", "front_right"}
    assert first_pair("model") == {"front_left", "back_left"}


@given(st.lists(st.integers(0, 5), min_size=1, max_size=10))
def test_custom_vectors_are_renumbered_by_first_appearance_or_refused_for_gaps(vector: list[int]) -> None:
    if set(vector) != set(range(max(vector) + 1)):
        with pytest.raises(ConfigError, match="without gaps"):
            Geometry("custom", tuple(vector))
        return
    numbered = Geometry("custom", tuple(vector)).subpopulations(parts(len(vector)))
    assert [vector.index(entry) for entry in vector] == [numbered.index(entry) for entry in numbered]
    assert list(dict.fromkeys(numbered)) == list(range(len(set(vector))))


@given(st.integers(1, 12))
def test_single_and_all_fit_any_number_of_parts(count: int) -> None:
    assert set(Geometry("single").subpopulations(parts(count))) == {0}
    assert Geometry("all").subpopulations(parts(count)) == tuple(range(count))


@pytest.mark.parametrize("name", ["fb", "lr", "cross"])
def test_leg_geometries_are_refused_without_legs(name: str) -> None:
    with pytest.raises(ConfigError, match=f"geometry: expected parts that all stand .* for {name}, got"):
        Geometry(name).subpopulations(parts(4))


@pytest.mark.parametrize(
    ("name", "vector"),
    [
        ("custom", None),
        ("custom", ()),
        ("custom", (0, -1)),
        ("custom", (0, 1.0)),
        ("custom", (0, True)),
        ("all", (0, 1)),
    ],
)
def test_missing_or_superfluous_vectors_are_refused(name: str, vector: tuple[int, ...] | None) -> None:
    with pytest.raises(ConfigError, match=r"geometry\.vector"):
        Geometry(name, vector)


def test_a_vector_of_the_wrong_length_is_refused_with_the_names_of_the_parts() -> None:
    with pytest.raises(ConfigError, match="4 entries, one for each of front_left"):
        Geometry("custom", (0, 1)).subpopulations(AntTask().parts)
