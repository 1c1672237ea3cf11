"""From a task and the wiring's settings to a plan, refusing what makes no sense."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass

from exneat_cli.errors import ConfigError, check_choice, check_flag, check_whole
from exneat_cli.tasks import Task
from exneat_cli.wiring.geometry import Geometry
from exneat_cli.wiring.linkage import LINKAGES, link_pins
from exneat_cli.wiring.plan import CENTRAL, Module, Pin, Plan, sensor_pins

ALGORITHMS = ("exneat", "neat", "random", "motionless", "linear_fusion")
UNTRAINED = ("random", "motionless", "linear_fusion")


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


def plan_wiring(task: Task, algorithm: str, geometry: Geometry, linkage: str, wiring: Wiring, *, hidden: int) -> Plan:
    """The plan of one variant.

    Args:
        task: gives parts, trunk and sizes.
        algorithm: ``neat`` (one module senses and drives everything) or ``exneat``; those of
            `UNTRAINED` have no modules at all.
        geometry: which modules share genomes.
        linkage: one of `LINKAGES`.
        wiring: the central module's settings.
        hidden: initial hidden nodes of every module.

    Raises:
        ConfigError: the combination makes no sense, naming the key to change.
    """
    check_choice("algorithm", algorithm, ALGORITHMS)
    check_choice("linkage", linkage, LINKAGES)
    if algorithm == "exneat":
        return _plan_modules(task, geometry, linkage, wiring, hidden)
    _refuse_modular_settings(algorithm, geometry, linkage, wiring)
    if algorithm == "linear_fusion" and any(len(part.actuators) != 1 for part in task.parts):
        fix = "it moves to where the sum of a part's sensors is largest, so only grid worlds have it"
        raise ConfigError("algorithm", "exneat, neat or random", algorithm, fix)
    actuators = tuple(range(len(task.actuator_names)))
    everything = Module(
        name="body",
        position=(0.0, 0.0),
        subpopulation=0,
        pins=sensor_pins(range(task.observation_size)),
        outputs=len(actuators),
        hidden=hidden,
        drives=actuators,
    )
    return Plan((everything,) if algorithm == "neat" else (), task.observation_size, len(actuators))


def _plan_modules(task: Task, geometry: Geometry, linkage: str, wiring: Wiring, hidden: int) -> Plan:
    parts = task.parts
    central = task.trunk is not None if wiring.central is None else wiring.central
    _check_links(task, linkage, wiring, central, hidden)
    outputs = [wiring.output_width if central else len(part.actuators) for part in parts]
    modules = []
    for own, (part, subpopulation) in enumerate(zip(parts, geometry.subpopulations(parts), strict=True)):
        links = link_pins(linkage, parts, own, outputs=outputs, hidden=hidden, central=len(parts))
        modules.append(
            Module(
                name=part.name,
                position=part.position,
                subpopulation=subpopulation,
                pins=sensor_pins(part.sensors) + links,
                outputs=outputs[own],
                hidden=hidden,
                drives=() if central else part.actuators,
            )
        )
    _check_sharers(modules)
    if central:
        modules.append(_central_module(task, modules, hidden))
    return Plan(tuple(modules), task.observation_size, len(task.actuator_names))


def _central_module(task: Task, encoders: list[Module], hidden: int) -> Module:
    assert task.trunk is not None
    encoded = [(own, k) for own, encoder in enumerate(encoders) for k in range(encoder.outputs)]
    actuators = tuple(range(len(task.actuator_names)))
    return Module(
        name=CENTRAL,
        position=task.trunk.position,
        subpopulation=1 + max(encoder.subpopulation for encoder in encoders),
        pins=sensor_pins(task.trunk.sensors) + tuple(Pin("output", k, own) for own, k in encoded),
        outputs=len(actuators),
        hidden=hidden,
        drives=actuators,
    )


def _check_links(task: Task, linkage: str, wiring: Wiring, central: bool, hidden: int) -> None:
    if central and task.trunk is None:
        raise ConfigError("wiring.central", "false", True, f"task={task.name} has no trunk for a central module")
    if linkage in ("feedback", "full") and not central:
        fix = "these links read a central module: set wiring.central=true"
        if task.trunk is None:
            fix = f"these links read a central module, and task={task.name} has no trunk for one"
        raise ConfigError("linkage", "none, output or hidden without a central module", linkage, fix)
    if linkage in ("hidden", "full") and hidden == 0:
        fix = "modules start without hidden nodes here: set evolution.module_hidden"
        raise ConfigError("linkage", "links that read no hidden nodes", linkage, fix)
    if not central and wiring.output_width != Wiring().output_width:
        fix = "without a central module each part module has one output per actuator"
        raise ConfigError("wiring.output_width", f"{Wiring().output_width}, its default", wiring.output_width, fix)


def _check_sharers(modules: list[Module]) -> None:
    sharers = defaultdict(list)
    for module in modules:
        sharers[module.subpopulation].append(module)
    for group in sharers.values():
        widths = {module.name: module.shape for module in group}
        if len(set(widths.values())) > 1:
            expected = "sharers of equal widths (inputs, hidden nodes, outputs)"
            raise ConfigError("geometry", expected, widths)


def _refuse_modular_settings(algorithm: str, geometry: Geometry, linkage: str, wiring: Wiring) -> None:
    fix = f"algorithm={algorithm} has no part modules; drop this setting or use algorithm=exneat"
    if geometry.name != "single":
        raise ConfigError("geometry", "single, its default", geometry.name, fix)
    if linkage != "none":
        raise ConfigError("linkage", "none, its default", linkage, fix)
    if wiring.central:
        raise ConfigError("wiring.central", "null or false", True, fix)
    if wiring.output_width != Wiring().output_width:
        raise ConfigError("wiring.output_width", f"{Wiring().output_width}, its default", wiring.output_width, fix)
