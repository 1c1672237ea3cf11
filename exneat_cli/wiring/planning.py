"""Makes a plan from a task and the settings of its modules, and refuses combinations that make no sense.

Source: Zhang (2025), section 3.1; the geometry `cross` is the one described there (the two diagonals), not the one
printed.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass

from exneat_cli.errors import ConfigError, check_choice, check_flag, check_whole
from exneat_cli.tasks import Part, Task
from exneat_cli.wiring.linkage import LINKAGES
from exneat_cli.wiring.plan import CENTRAL, Module, Pin, Plan

PRINTED_VECTORS = {"fb": (0, 0, 1, 1), "lr": (0, 1, 0, 1), "cross": (0, 1, 1, 0)}
"""Geometries that follow from the parts' positions: front and back, left and right, opposite each other. For Ant's
legs, in any order, they are these vectors, as in the thesis."""
_ANTS_LEGS = {"front_left", "front_right", "back_left", "back_right"}
GEOMETRIES = ("single", *PRINTED_VECTORS, "auto", "all", "custom")
TRUNK_MODES = ("none", "shared", "module")
_ON_THE_LINE = 1e-6
"""Distance below which a part counts as neither in front nor behind, neither left nor right."""


@dataclass(frozen=True)
class Geometry:
    """Which modules share genomes, by name or, for `custom`, by vector.

    Attributes:
        name: one of `GEOMETRIES`.
        vector: only for `custom`, the subpopulation of each part's module, e.g. ``(0, 0, 1, 0)``.

    Raises:
        ConfigError: the name is unknown, or the vector is missing, superfluous or has gaps.
    """

    name: str = "single"
    vector: tuple[int, ...] | None = None

    def __post_init__(self) -> None:
        check_choice("geometry", self.name, GEOMETRIES)
        if self.name != "custom":
            if self.vector is not None:
                fix = f"leave geometry.vector out, or use geometry=custom instead of geometry={self.name}"
                raise ConfigError("geometry.vector", "nothing (null)", self.vector, fix)
            return
        expected = "a list of whole numbers without gaps, e.g. [0,0,1,1]"
        if not isinstance(self.vector, list | tuple) or not self.vector:
            raise ConfigError("geometry.vector", expected, self.vector)
        whole = all(isinstance(entry, int) and not isinstance(entry, bool) and entry >= 0 for entry in self.vector)
        if not whole or len(set(self.vector)) <= max(self.vector):
            raise ConfigError("geometry.vector", expected, list(self.vector))
        object.__setattr__(self, "vector", tuple(self.vector))

    def subpopulations(self, parts: Sequence[Part]) -> tuple[int, ...]:
        """Subpopulation of each part's module, numbered by first appearance.

        Raises:
            ConfigError: the geometry does not fit these parts.
        """
        names = ", ".join(part.name for part in parts)
        if self.name == "single":
            return (0,) * len(parts)
        if self.name == "all":
            return tuple(range(len(parts)))
        if self.name in PRINTED_VECTORS:
            ants = {part.name for part in parts} == _ANTS_LEGS
            return PRINTED_VECTORS[self.name] if ants else _by_position(self.name, parts)
        if self.name == "auto":
            if any(part.likeness < 0 for part in parts):
                raise ConfigError("geometry", "single, all or custom", "auto", f"parts were not compared: {names}")
            return _numbered([part.likeness for part in parts])
        assert self.vector is not None
        if len(self.vector) != len(parts):
            raise ConfigError("geometry.vector", f"{len(parts)} entries, one for each of {names}", list(self.vector))
        return _numbered(self.vector)


def _numbered(groups: Sequence[Hashable]) -> tuple[int, ...]:
    """Numbers of the groups, in the order of their first appearance."""
    first_seen = list(dict.fromkeys(groups))
    return tuple(first_seen.index(group) for group in groups)


def _by_position(name: str, parts: Sequence[Part]) -> tuple[int, ...]:
    """The vector of a geometry in `PRINTED_VECTORS`, for parts whose positions fit it."""
    if name == "cross":
        across = [[p for p, other in enumerate(parts) if _are_opposite(part, other)] for part in parts]
        if all(len(others) == 1 for others in across):
            return _numbered([min(own, *others) for own, others in enumerate(across)])
        place = "in pairs opposite each other"
    else:
        axis = 0 if name == "fb" else 1
        if all(abs(part.position[axis]) > _ON_THE_LINE for part in parts):
            return _numbered([part.position[axis] > 0.0 for part in parts])
        place = "in front or behind" if name == "fb" else "on the left or on the right"
    places = ", ".join(f"{part.name} at ({part.position[0]:.3g}, {part.position[1]:.3g})" for part in parts)
    auto = ", auto" * all(part.likeness >= 0 for part in parts)
    raise ConfigError(
        "geometry", f"parts that all stand {place} for {name}", places, f"use single{auto}, all or custom"
    )


def _are_opposite(one: Part, other: Part) -> bool:
    (x, y), (u, v) = one.position, other.position
    return math.hypot(x, y) > _ON_THE_LINE and math.hypot(x + u, y + v) <= _ON_THE_LINE


@dataclass(frozen=True)
class Wiring:
    """The central module, and how the trunk is sensed without one.

    Attributes:
        central: whether there is a central module; None means yes if the task has a trunk and `trunk` is ``none``.
        output_width: outputs of each part module if a central module reads them.
        trunk: without a central module, ``shared`` lets every part module also sense the trunk, and ``module`` adds a
            module that senses the trunk and drives the trunk's own joints.

    Raises:
        ConfigError: a value is out of range.
    """

    central: bool | None = None
    output_width: int = 2
    trunk: str = "none"

    def __post_init__(self) -> None:
        check_choice("wiring.trunk", self.trunk, TRUNK_MODES)
        if self.central is not None:
            check_flag("wiring.central", self.central)
        check_whole("wiring.output_width", self.output_width, 1, 100)


def plan_body(task: Task, *, hidden: int) -> Plan:
    """The plan of one module that senses and drives everything, with `hidden` initial hidden nodes."""
    actuators = tuple(range(len(task.actuator_names)))
    pins = tuple(map(Pin, task.whole))
    body = Module("body", (0.0, 0.0), 0, pins, outputs=len(actuators), hidden=hidden, drives=actuators)
    return Plan((body,), task.sensed_size, len(actuators))


def plan_modules(task: Task, geometry: Geometry, linkage: str, wiring: Wiring, *, hidden: int) -> Plan:
    """The plan of a module for each part of the body and, depending on `wiring`, one for the trunk.

    Args:
        task: provides parts, trunk and sizes.
        geometry: which modules share genomes.
        linkage: one of `LINKAGES`.
        wiring: settings of the central module and the trunk.
        hidden: initial hidden nodes of every module.

    Raises:
        ConfigError: the combination makes no sense; the key is the one to change.
    """
    check_choice("linkage", linkage, tuple(LINKAGES))
    parts = task.parts
    central = _has_central(task, wiring)
    outputs = tuple(wiring.output_width if central else len(part.actuators) for part in parts)
    links = _links(task, linkage, outputs, hidden, central=central)
    subpopulations = geometry.subpopulations(parts)
    modules = [
        Module(
            name=part.name,
            position=part.position,
            subpopulation=subpopulations[own],
            pins=(*map(Pin, part.sensors), *map(Pin, part.trunk if wiring.trunk == "shared" else ()), *links[own]),
            outputs=outputs[own],
            hidden=hidden,
            drives=() if central else part.actuators,
        )
        for own, part in enumerate(parts)
    ]
    for shared in set(subpopulations):
        widths = {module.name: module.shape for module in modules if module.subpopulation == shared}
        if len(set(widths.values())) > 1:
            expected = "modules of equal size (inputs, hidden nodes, outputs) where they share genomes"
            raise ConfigError("geometry", expected, widths)
    if central or wiring.trunk == "module":
        modules.append(_trunk_module(task, modules, hidden, central=central))
    return Plan(tuple(modules), task.sensed_size, len(task.actuator_names))


def _has_central(task: Task, wiring: Wiring) -> bool:
    """Whether there is a central module; refuses settings of the trunk that are incompatible with it."""
    named, trunk = f"task={task.name}", task.trunk
    central = trunk is not None and wiring.trunk == "none" if wiring.central is None else wiring.central
    if trunk is None and (central or wiring.trunk != "none"):
        key, value = ("wiring.central", True) if central else ("wiring.trunk", wiring.trunk)
        raise ConfigError(key, "false" if central else "none", value, f"{named} has no trunk for a module or to share")
    if central and wiring.trunk != "none":
        fix = "a central module senses the trunk and drives all joints already"
        raise ConfigError("wiring.trunk", "none together with wiring.central=true", wiring.trunk, fix)
    if not central and wiring.output_width != Wiring().output_width:
        fix = "without a central module each part module has one output per actuator"
        raise ConfigError("wiring.output_width", f"{Wiring().output_width}, its default", wiring.output_width, fix)
    if trunk is not None and not central:
        driven = ", ".join(task.actuator_names[actuator] for actuator in trunk.actuators)
        if driven and wiring.trunk != "module":
            fix = "or set wiring.central=true"
            raise ConfigError("wiring.trunk", f"module, as nothing else drives {driven}", wiring.trunk, fix)
        if wiring.trunk == "module" and not driven:
            raise ConfigError(
                "wiring.trunk", "none or shared", "module", f"the trunk of {named} has no joints to drive"
            )
    return central


def _links(task: Task, linkage: str, outputs: Sequence[int], hidden: int, *, central: bool) -> list[tuple[Pin, ...]]:
    """The links of each part module; refuses a linkage that reads something that does not exist."""
    links = _pins(task, linkage, outputs, hidden)
    if why := _refusal(task, linkage, links, outputs, hidden, central=central):
        fitting = [
            name
            for name in LINKAGES
            if not _refusal(task, name, _pins(task, name, outputs, hidden), outputs, hidden, central=central)
        ]
        raise ConfigError(
            "linkage", f"{' or '.join(fitting)} with task={task.name} and its other settings", linkage, why
        )
    return links


def _pins(task: Task, linkage: str, outputs: Sequence[int], hidden: int) -> list[tuple[Pin, ...]]:
    # Without hidden nodes a linkage that reads them would return no pins and pass unnoticed.
    return [LINKAGES[linkage](task.parts, own, outputs, max(1, hidden)) for own in range(len(task.parts))]


def _refusal(
    task: Task, linkage: str, links: Sequence[Sequence[Pin]], outputs: Sequence[int], hidden: int, *, central: bool
) -> str:
    """What links would read that does not exist, and what to set; empty if nothing is missing."""
    parts, pins = len(task.parts), [pin for own in links for pin in own]
    if linkage != "none" and parts > 1 and not pins:
        return f"task={task.name} has nothing that such links could read"
    missing = []
    if not central and any(pin.module == parts for pin in pins):
        fix = "set wiring.central=true" if task.trunk else f"task={task.name} has no trunk for one"
        missing.append(f"a central module: {fix}")
    if hidden == 0 and any(0 <= pin.module < parts and pin.index >= outputs[pin.module] for pin in pins):
        missing.append("hidden nodes, which modules start without here: set evolution.module_hidden")
    return f"such links read {'; and '.join(missing)}" if missing else ""


def _trunk_module(task: Task, others: Sequence[Module], hidden: int, *, central: bool) -> Module:
    """The module that senses the trunk and drives its joints; a central one also reads the others and drives all."""
    assert task.trunk is not None
    read = [Pin(k, own) for own, other in enumerate(others) for k in range(other.outputs)] if central else []
    actuators = tuple(range(len(task.actuator_names))) if central else task.trunk.actuators
    return Module(
        name=CENTRAL if central else task.trunk.name,
        position=task.trunk.position,
        subpopulation=1 + max(other.subpopulation for other in others),
        pins=(*map(Pin, task.trunk.sensors), *read),
        outputs=len(actuators),
        hidden=hidden,
        drives=actuators,
    )


def refuse_modules(algorithm: str, geometry: Geometry, linkage: str, wiring: Wiring) -> None:
    """Refuse settings of modules for an algorithm without part modules.

    Raises:
        ConfigError: one of them is not at its default.
    """
    fix = f"algorithm={algorithm} has no part modules; drop this setting or use algorithm=exneat"
    if geometry.name != "single":
        raise ConfigError("geometry", "single, its default", geometry.name, fix)
    if linkage != "none":
        raise ConfigError("linkage", "none, its default", linkage, fix)
    if wiring.central:
        raise ConfigError("wiring.central", "null or false", True, fix)
    for key in ("output_width", "trunk"):
        default, came = getattr(Wiring(), key), getattr(wiring, key)
        if came != default:
            raise ConfigError(f"wiring.{key}", f"{default}, its default", came, fix)
