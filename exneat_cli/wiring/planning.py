"""From a task and the wiring's settings to a plan, refusing what makes no sense."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

from exneat_cli.errors import ConfigError, check_choice, check_flag, check_whole
from exneat_cli.tasks import Task
from exneat_cli.wiring.geometry import Geometry
from exneat_cli.wiring.linkage import LINKAGES, Sizes
from exneat_cli.wiring.plan import CENTRAL, Module, Pin, Plan, sensor_pins


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
    pins = sensor_pins(range(task.sensed_size))
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
    links = _links(task, linkage, Sizes(outputs, hidden), central=central)
    modules = [
        Module(
            name=part.name,
            position=part.position,
            subpopulation=subpopulation,
            pins=sensor_pins(part.sensors) + links[own],
            outputs=outputs[own],
            hidden=hidden,
            drives=() if central else part.actuators,
        )
        for own, (part, subpopulation) in enumerate(zip(parts, geometry.subpopulations(parts), strict=True))
    ]
    _check_sharers(modules)
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


def _links(task: Task, linkage: str, sizes: Sizes, *, central: bool) -> list[tuple[Pin, ...]]:
    """The extra pins of each part module; refuses those that read what is not there."""
    parts = task.parts
    # Without hidden nodes a linkage that reads them would return no pins and pass unnoticed.
    asked = Sizes(sizes.outputs, max(1, sizes.hidden))
    links = [LINKAGES[linkage](parts, own, asked) for own in range(len(parts))]
    pins = [pin for own in links for pin in own]
    if not central and any(pin.module == len(parts) for pin in pins):
        fix = "these links read a central module: set wiring.central=true"
        if task.trunk is None:
            fix = f"these links read a central module, and task={task.name} has no trunk for one"
        raise ConfigError("linkage", "links that read no central module", linkage, fix)
    if sizes.hidden == 0 and any(
        0 <= pin.module < len(parts) and pin.index >= sizes.outputs[pin.module] for pin in pins
    ):
        fix = "modules start without hidden nodes here: set evolution.module_hidden"
        raise ConfigError("linkage", "links that read no hidden nodes", linkage, fix)
    return links


def _central_module(task: Task, encoders: Sequence[Module], hidden: int) -> Module:
    assert task.trunk is not None
    encoded = tuple(Pin(k, own) for own, encoder in enumerate(encoders) for k in range(encoder.outputs))
    actuators = tuple(range(len(task.actuator_names)))
    return Module(
        name=CENTRAL,
        position=task.trunk.position,
        subpopulation=1 + max(encoder.subpopulation for encoder in encoders),
        pins=sensor_pins(task.trunk.sensors) + encoded,
        outputs=len(actuators),
        hidden=hidden,
        drives=actuators,
    )


def _check_sharers(modules: Sequence[Module]) -> None:
    sharers = defaultdict(list)
    for module in modules:
        sharers[module.subpopulation].append(module)
    for group in sharers.values():
        widths = {module.name: module.shape for module in group}
        if len(set(widths.values())) > 1:
            raise ConfigError("geometry", "sharers of equal widths (inputs, hidden nodes, outputs)", widths)


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
