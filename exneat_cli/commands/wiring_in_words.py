"""Who senses and drives what, in words: in a finished run, or in a task before any run."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable

from exneat_cli.algorithms import BASELINES
from exneat_cli.errors import ExneatError
from exneat_cli.records import RunDirectory
from exneat_cli.records.champion import Champion, read_champion
from exneat_cli.tasks import Task
from exneat_cli.wiring import GEOMETRIES, Geometry, Module


def show_task(task: Task) -> None:
    """Print a task's parts, sensors and actuators, and how geometries share networks among the parts."""
    print(f"task {task.name}: {task.sensed_size} sensors, {len(task.actuator_names)} actuators\n")
    for part in (*task.parts, *filter(None, [task.trunk])):
        x, y = part.position
        print(f"{part.name}  at ({x:+.2f}, {y:+.2f}, {part.height:+.2f})")
        drives = "; ".join(task.actuator_names[actuator] for actuator in part.actuators)
        remarks = {**task.remarks_on(part), "drives": drives or "nothing itself"}
        remarks["senses"] = "; ".join(task.sensor_names[entry] for entry in part.sensors)
        if part.trunk:
            remarks["trunk"] = f"{len(part.trunk)} entries as seen from here, for wiring.trunk=shared"
        for word, text in remarks.items():
            print(_filled(word, text))
        print()
    print("geometry  which parts share a network: " + " ".join(part.name for part in task.parts))
    for name in GEOMETRIES[:-1]:
        try:
            vector = " ".join(map(str, Geometry(name).subpopulations(task.parts)))
        except ExneatError:
            vector = "does not fit"
        print(f"{name:<8}  {vector}")
    if len(task.parts) == 1:
        print("The task has a single part, hence a single module, so ExNEAT trains the same network as NEAT.")


def _filled(word: str, text: str) -> str:
    return textwrap.fill(text, 110, initial_indent=f"  {word:<8} ", subsequent_indent=" " * 11)


def show_run(run: RunDirectory) -> None:
    """Print the modules of a run's champion.

    Raises:
        ExneatError: there is no run, or it has no champion to show.
    """
    if not run.is_there():
        raise ExneatError(f"run={run.path}: there is no such run; exneat inspect without run= lists all runs")
    manifest = run.read_manifest()
    if not run.champion.exists():
        why = "a baseline has no networks" if manifest.variant in BASELINES else "it is not finished"
        raise ExneatError(f"run={run.path}: has no champion to show: {why} (status {manifest.status})")
    champion = read_champion(run.champion)
    print(f"{run.path}  ({run.status(manifest)})")
    kind = "feed-forward" if champion.feed_forward else "recurrent"
    subpopulations = len(champion.plan.subpopulation_shapes)
    print(f"{champion.variant}: {len(champion.plan.modules)} modules, {subpopulations} subpopulations, {kind}\n")
    for module in champion.plan.modules:
        x, y = module.position
        print(f"{module.name}  at ({x:+.2f}, {y:+.2f}), subpopulation {module.subpopulation}")
        senses = "; ".join(champion.sensors[entry] for entry in module.sensors)
        print(_filled("senses", senses or "nothing itself"))
        for read in _links(champion, module):
            print(_filled("reads", read))
        drives = "; ".join(champion.actuators[actuator] for actuator in module.drives)
        print(_filled("drives", drives or f"nothing; {module.outputs} outputs for others"))
        genome = champion.genomes[module.subpopulation]
        sizes = (
            f"{len(module.pins)} inputs, {len(genome.nodes) - module.outputs} hidden nodes, {module.outputs} outputs"
        )
        enabled = sum(connection.enabled for connection in genome.connections)
        print(f"  network  {sizes}, {enabled} enabled of {len(genome.connections)} connections\n")
    test = champion.scores.test
    print(f"test: fitness {test.fitness_mean:.4g} (sd {test.fitness_std:.3g}), {test.episodes} episodes")


def _links(champion: Champion, module: Module) -> Iterable[str]:
    groups: dict[tuple[int, str, bool], list[str]] = {}
    for pin in module.pins:
        if not pin.is_sensor:
            group = pin.module, champion.plan.kind_of(pin), pin.delayed
            groups.setdefault(group, []).append(champion.node_name(pin))
    for (source, kind, delayed), names in groups.items():
        when = "of the previous step" if delayed else "of this step"
        yield f"{kind} {', '.join(names)} of {champion.plan.modules[source].name}, {when}"
