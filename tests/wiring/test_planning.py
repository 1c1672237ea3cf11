"""Plans: widths, links and what is refused."""

from __future__ import annotations

import itertools
from dataclasses import replace

import pytest

from exneat_cli.errors import ConfigError
from exneat_cli.tasks import AntTask
from exneat_cli.wiring import LINKAGES, Geometry, Pin, Plan, Wiring, counter_clockwise, plan_wiring

NAMED = ("single", "fb", "lr", "cross", "all")


def ant_plan(geometry: str = "all", linkage: str = "none", *, central: bool | None = None, width: int = 2) -> Plan:
    return plan_wiring(AntTask(), "exneat", Geometry(geometry), linkage, Wiring(central, width), hidden=4)


def test_neat_is_one_module_that_senses_and_drives_everything() -> None:
    plan = plan_wiring(AntTask(), "neat", Geometry(), "none", Wiring(), hidden=6)
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


@pytest.mark.parametrize("geometry", NAMED)
def test_a_central_module_adds_one_subpopulation(geometry: str) -> None:
    without = ant_plan(geometry, central=False)
    assert len(ant_plan(geometry).subpopulation_shapes) == len(without.subpopulation_shapes) + 1
    assert ant_plan(geometry).modules[-1].drives == tuple(range(8))
    assert sorted(a for module in without.modules for a in module.drives) == list(range(8))


def test_peers_come_counter_clockwise_from_the_own_leg() -> None:
    legs = AntTask().parts
    around = ["front_left", "back_left", "back_right", "front_right"]
    for own, leg in enumerate(legs):
        start = around.index(leg.name)
        assert [legs[peer].name for peer in counter_clockwise(legs, own)] == (around * 2)[start + 1 : start + 4]


def test_links_of_a_shared_genome_mean_the_same_at_every_leg() -> None:
    plan = ant_plan("single", "full")
    around = ["front_left", "back_left", "back_right", "front_right"]
    names = [module.name for module in plan.modules]
    patterns = set()
    for module in plan.modules[:-1]:
        start = around.index(module.name)
        peers = [
            (pin.kind, pin.index, (around.index(names[pin.module]) - start) % 4)
            for pin in module.pins
            if pin.kind != "sensor" and names[pin.module] != "central"
        ]
        joints = [AntTask().actuator_names[p.index] for p in module.pins if p.kind == "output" and p.module == 4]
        assert joints[0].startswith("hip")
        own = AntTask().parts[names.index(module.name)].actuators
        assert tuple(p.index for p in module.pins if p.kind == "output" and p.module == 4)[:2] == own
        patterns.add(tuple(peers))
    assert len(patterns) == 1


def test_only_the_central_modules_view_of_its_encoders_is_undelayed() -> None:
    for module in ant_plan(linkage="full").modules:
        for pin in module.pins:
            if pin.kind != "sensor":
                assert pin.delayed == (module.name != "central")


@pytest.mark.parametrize(("linkage", "central"), list(itertools.product(LINKAGES, [True, False])))
def test_links_that_read_a_central_module_need_one(linkage: str, central: bool) -> None:
    if linkage in ("feedback", "full") and not central:
        with pytest.raises(ConfigError, match=r"linkage: .*\n.*wiring\.central=true"):
            ant_plan(linkage=linkage, central=central)
    else:
        assert ant_plan(linkage=linkage, central=central).modules


def test_hidden_links_need_hidden_nodes() -> None:
    with pytest.raises(ConfigError, match=r"evolution\.module_hidden"):
        plan_wiring(AntTask(), "exneat", Geometry(), "hidden", Wiring(), hidden=0)


def test_an_output_width_without_a_central_module_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"wiring\.output_width"):
        ant_plan(central=False, width=3)


@pytest.mark.parametrize(
    "pin", [Pin("sensor", 105), Pin("sensor", -1), Pin("output", 2, 0), Pin("hidden", 4, 0), Pin("output", 0, 9)]
)
def test_a_plan_that_reads_what_does_not_exist_is_refused(pin: Pin) -> None:
    plan = ant_plan(linkage="full")
    plan.check()
    first, *others = plan.modules
    with pytest.raises(ValueError, match="front_left has a pin that reads what does not exist"):
        replace(plan, modules=(replace(first, pins=(*first.pins, pin)), *others)).check()


def test_a_plan_that_drives_what_does_not_exist_is_refused() -> None:
    (body,) = plan_wiring(AntTask(), "neat", Geometry(), "none", Wiring(), hidden=6).modules
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
        plan_wiring(AntTask(), algorithm, Geometry(geometry), linkage, wiring, hidden=4)


def test_sharers_of_different_widths_are_refused() -> None:
    class Lopsided(AntTask):
        @property
        def parts(self):  # type: ignore[no-untyped-def]
            one, *others = super().parts
            return (type(one)(one.name, one.sensors[:-1], one.actuators, one.position), *others)

    with pytest.raises(ConfigError, match="sharers of equal widths"):
        plan_wiring(Lopsided(), "exneat", Geometry("single"), "none", Wiring(), hidden=4)
    assert plan_wiring(Lopsided(), "exneat", Geometry("all"), "none", Wiring(), hidden=4)


def test_a_central_module_is_refused_where_there_is_no_trunk() -> None:
    class Trunkless(AntTask):
        trunk = None  # type: ignore[assignment]

    with pytest.raises(ConfigError, match="no trunk"):
        plan_wiring(Trunkless(), "exneat", Geometry(), "none", Wiring(central=True), hidden=4)
    plan = plan_wiring(Trunkless(), "exneat", Geometry(), "none", Wiring(), hidden=4)
    assert "central" not in [module.name for module in plan.modules]
