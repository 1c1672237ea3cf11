"""From a task and the settings of its modules to a plan, refusing what makes no sense.

Source: Zhang (2025), section 3.1; the geometry `cross` as described there (the two diagonals), not as printed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from exneat_cli.errors import ConfigError, check_choice, check_flag, check_whole
from exneat_cli.tasks import Part, Task
from exneat_cli.wiring.linkage import LINKAGES
from exneat_cli.wiring.plan import CENTRAL, Module, Pin, Plan

QUADRUPED_VECTORS = {"fb": (0, 0, 1, 1), "lr": (0, 1, 0, 1), "cross": (0, 1, 1, 0)}
"""Geometry vectors that need four legs, for the order front left, front right, back left, back right."""
QUADRUPED_PARTS = {"front_left", "front_right", "back_left", "back_right"}
GEOMETRIES = ("single", *QUADRUPED_VECTORS, "all", "custom")


@dataclass(frozen=True)
class Geometry:
    """Which modules share genomes, by name or, for `custom`, by vector.

    Attributes:
        name: one of `GEOMETRIES`.
        vector: for `custom` alone, the subpopulation of each part's module, e.g. ``(0, 0, 1, 0)``.

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
        if self.name in QUADRUPED_VECTORS:
            if {part.name for part in parts} != QUADRUPED_PARTS:
                raise ConfigError("geometry", "single, all or custom", self.name, f"this task has: {names}")
            return QUADRUPED_VECTORS[self.name]
        assert self.vector is not None
        if len(self.vector) != len(parts):
            raise ConfigError("geometry.vector", f"{len(parts)} entries, one for each of {names}", list(self.vector))
        first_seen = list(dict.fromkeys(self.vector))
        return tuple(first_seen.index(entry) for entry in self.vector)


@dataclass(frozen=True)
class Wiring:
    """The central module's settings.

    Attributes:
        central: whether there is a central module; None means yes where the task has a trunk.
        output_width: outputs of each part module where a central module reads them.

    Raises:
        ConfigError: a value is out of range.
    """

    central: bool | None = None
    output_width: int = 2

    def __post_init__(self) -> None:
        if self.central is not None:
            check_flag("wiring.central", self.central)
        check_whole("wiring.output_width", self.output_width, 1, 100)


def plan_body(task: Task, *, hidden: int) -> Plan:
    """The plan of one module that senses and drives everything, with this many initial hidden nodes."""
    actuators = tuple(range(len(task.actuator_names)))
    pins = tuple(map(Pin, range(task.sensed_size)))
    body = Module("body", (0.0, 0.0), 0, pins, outputs=len(actuators), hidden=hidden, drives=actuators)
    return Plan((body,), task.sensed_size, len(actuators))


def plan_modules(task: Task, geometry: Geometry, linkage: str, wiring: Wiring, *, hidden: int) -> Plan:
    """The plan of a module for each part of the body, and maybe a central one.

    Args:
        task: gives parts, trunk and sizes.
        geometry: which modules share genomes.
        linkage: one of `LINKAGES`.
        wiring: the central module's settings.
        hidden: initial hidden nodes of every module.

    Raises:
        ConfigError: the combination makes no sense, naming the key to change.
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
            pins=(*map(Pin, part.sensors), *links[own]),
            outputs=outputs[own],
            hidden=hidden,
            drives=() if central else part.actuators,
        )
        for own, part in enumerate(parts)
    ]
    for shared in set(subpopulations):
        widths = {module.name: module.shape for module in modules if module.subpopulation == shared}
        if len(set(widths.values())) > 1:
            raise ConfigError("geometry", "sharers of equal widths (inputs, hidden nodes, outputs)", widths)
    if central:
        modules.append(_central_module(task, modules, hidden))
    return Plan(tuple(modules), task.sensed_size, len(task.actuator_names))


def _has_central(task: Task, wiring: Wiring) -> bool:
    central = task.trunk is not None if wiring.central is None else wiring.central
    if central and task.trunk is None:
        raise ConfigError("wiring.central", "false", True, f"task={task.name} has no trunk for a central module")
    if not central and wiring.output_width != Wiring().output_width:
        fix = "without a central module each part module has one output per actuator"
        raise ConfigError("wiring.output_width", f"{Wiring().output_width}, its default", wiring.output_width, fix)
    return central


def _links(task: Task, linkage: str, outputs: Sequence[int], hidden: int, *, central: bool) -> list[tuple[Pin, ...]]:
    """The extra pins of each part module; refuses those that read what is not there."""
    parts = task.parts
    # Without hidden nodes a linkage that reads them would return no pins and pass unnoticed.
    links = [LINKAGES[linkage](parts, own, outputs, max(1, hidden)) for own in range(len(parts))]
    pins = [pin for own in links for pin in own]
    if not central and any(pin.module == len(parts) for pin in pins):
        fix = "these links read a central module: set wiring.central=true"
        if task.trunk is None:
            fix = f"these links read a central module, and task={task.name} has no trunk for one"
        raise ConfigError("linkage", "links that read no central module", linkage, fix)
    if hidden == 0 and any(0 <= pin.module < len(parts) and pin.index >= outputs[pin.module] for pin in pins):
        fix = "modules start without hidden nodes here: set evolution.module_hidden"
        raise ConfigError("linkage", "links that read no hidden nodes", linkage, fix)
    return links


def _central_module(task: Task, encoders: Sequence[Module], hidden: int) -> Module:
    assert task.trunk is not None
    encoded = [Pin(k, own) for own, encoder in enumerate(encoders) for k in range(encoder.outputs)]
    actuators = tuple(range(len(task.actuator_names)))
    return Module(
        name=CENTRAL,
        position=task.trunk.position,
        subpopulation=1 + max(encoder.subpopulation for encoder in encoders),
        pins=(*map(Pin, task.trunk.sensors), *encoded),
        outputs=len(actuators),
        hidden=hidden,
        drives=actuators,
    )


def refuse_modules(algorithm: str, geometry: Geometry, linkage: str, wiring: Wiring) -> None:
    """Refuse settings of modules for an algorithm that has none.

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
    if wiring.output_width != Wiring().output_width:
        raise ConfigError("wiring.output_width", f"{Wiring().output_width}, its default", wiring.output_width, fix)
