"""What every linkage promises to the plan."""

from __future__ import annotations

import math

import pytest

from exneat_cli.errors import ConfigError
from exneat_cli.tasks import TASKS, Part, Task
from exneat_cli.wiring import LINKAGES, Geometry, Pin, Wiring, plan_modules


@pytest.fixture(params=sorted(LINKAGES))
def linkage(request: pytest.FixtureRequest) -> str:
    name: str = request.param
    return name


def reads(linkage: str, body: Task, *, hidden: int) -> tuple[bool, bool]:
    """Whether it reads a central module, and hidden nodes of part modules."""
    parts, outputs = body.parts, 2
    links = [LINKAGES[linkage](parts, own, (outputs,) * len(parts), hidden) for own in range(len(parts))]
    pins = [pin for own in links for pin in own if not pin.is_sensor]
    of_parts = [pin for pin in pins if pin.module < len(parts)]
    return len(of_parts) < len(pins), any(pin.index >= outputs for pin in of_parts)


@pytest.mark.parametrize("geometry", ["single", "all"])
@pytest.mark.parametrize(("hidden", "central"), [(0, True), (3, True), (3, False)])
@pytest.mark.parametrize("task", sorted(TASKS))
def test_pins_exist_and_sharers_have_equal_widths_unless_a_linkage_reads_what_is_not_there(
    linkage: str, task: str, hidden: int, central: bool, geometry: str
) -> None:
    body = TASKS[task]()
    wiring = Wiring(central=central and body.trunk is not None)
    reads_central, reads_hidden = reads(linkage, body, hidden=3)
    if linkage == "joints" and len(body.parts) > 1 and not any(part.joints for part in body.parts):
        with pytest.raises(ConfigError, match=r"(?s)^linkage: expected none .*nothing that such links could read"):
            plan_modules(body, Geometry(geometry), linkage, wiring, hidden=hidden)
        return
    if (reads_central and not wiring.central) or (reads_hidden and hidden == 0):
        with pytest.raises(ConfigError, match=r"(?s)^linkage: expected none .*such links read"):
            plan_modules(body, Geometry(geometry), linkage, wiring, hidden=hidden)
        return
    plan = plan_modules(body, Geometry(geometry), linkage, wiring, hidden=hidden)
    plan.check()
    assert len({module.shape for module in plan.modules[: len(body.parts)]}) == 1


def polygon(parts: int, actuators: int) -> list[Part]:
    """Parts evenly around the trunk, the second before the first, each with actuators of its own."""
    order = [1, 0, *range(2, parts)]
    turns = [2 * math.pi * k / parts + 0.1 for k in order]
    return [
        Part(f"part_{k}", (k,), tuple(range(k * actuators, (k + 1) * actuators)), (math.cos(turn), math.sin(turn)))
        for k, turn in enumerate(turns)
    ]


def seen_from(parts: list[Part], own: int, pin: Pin) -> tuple[int, int, int]:
    """What a link reads, as seen from the part that reads: kind of module, how many parts on, which of its nodes."""

    def turns_to(part: Part) -> int:
        angles = [math.atan2(p.position[1], p.position[0]) for p in (part, parts[own])]
        return round((angles[0] - angles[1]) / (2 * math.pi) * len(parts)) % len(parts)

    if pin.module < len(parts):
        return 0, turns_to(parts[pin.module]), pin.index
    moved = next(part for part in parts if pin.index in part.actuators)
    return 1, turns_to(moved), moved.actuators.index(pin.index)


@pytest.mark.parametrize("count", [2, 3, 4, 6])
def test_links_are_distinct_and_come_in_the_same_relative_order_at_each_part(linkage: str, count: int) -> None:
    parts = polygon(count, actuators=2)
    links = [LINKAGES[linkage](parts, own, (2,) * count, 3) for own in range(count)]
    seen = [[seen_from(parts, own, pin) for pin in links[own]] for own in range(count)]
    assert all(view == seen[0] for view in seen)
    assert len(set(seen[0])) == len(seen[0])
