"""A champion as genomes and configurations of neat-python, where its modules do not read each other."""

from __future__ import annotations

import inspect
import json

import msgspec

from exneat_cli.algorithms import EvolutionSettings, config_text
from exneat_cli.algorithms.neat import loader
from exneat_cli.errors import ExneatError
from exneat_cli.records.champion import Champion
from exneat_cli.tasks import Task


def files(champion: Champion, task: Task, evolution: EvolutionSettings) -> dict[str, str]:
    """Contents of the directory's files; see `exneat_cli.records.exports.exported`.

    Raises:
        ExneatError: a module reads another one.
    """
    plan, linked = champion.plan, []
    for module in plan.modules:
        linked += [f"{module.name} reads {plan.modules[pin.module].name}" for pin in module.pins if not pin.is_sensor]
    if linked:
        fix = "format=python and format=onnx hold links"
        raise ExneatError(f"format=neat: expected modules that do not read each other, got {linked[0]}\n  {fix}")
    names = [f"genome_{k}" for k in range(len(champion.genomes))]
    made = {}
    for name, genome, shape in zip(names, champion.genomes, plan.subpopulation_shapes, strict=True):
        made[f"{name}.json"] = json.dumps(msgspec.to_builtins(genome), indent=1)
        made[f"{name}.ini"] = config_text(evolution, shape)
    modules = [
        {"name": each.name, "genome": names[each.subpopulation], "senses": each.sensors, "drives": each.drives}
        for each in plan.modules
    ]
    text = {"sensors": champion.sensors, "actuators": champion.actuators, "modules": modules}
    made["modules.json"] = json.dumps(text, indent=1)
    made["networks.py"] = inspect.getsource(loader)
    return made
