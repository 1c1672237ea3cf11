"""`exneat inspect`: a run's wiring in words, a task's parts before any run, or the list of runs."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable
from pathlib import Path

from exneat_cli.algorithms import BASELINES
from exneat_cli.commands.command_line import CommandLine
from exneat_cli.commands.jobs import name_code
from exneat_cli.errors import ExneatError, check_path
from exneat_cli.records import RUNNING, Champion, Manifest, RunDirectory, find_runs, read_champion
from exneat_cli.runs import read_task
from exneat_cli.tasks import Task
from exneat_cli.wiring import GEOMETRIES, Geometry, Module

_WITH_TASKS = (
    *("task", "algorithm", "linkage", "geometry", "evolution", "recipe", "wiring", "judging", "champion", "pairing"),
    *("budgets", "executor", "name"),
)
"""What a task's file and its recipe set; of all that, only the task is shown."""


def run(line: CommandLine) -> int:
    """Print the wiring of ``run=<directory>``, the parts of ``task=<name>``, or the runs below ``output=<directory>``.

    Raises:
        ExneatError: an argument makes no sense, or the run has no champion to show.
    """
    plain = line.compose_only(("run", "output"), _WITH_TASKS)
    if "task" in plain:
        name_code(line, plain)
        _show_task(read_task(plain["task"]))
    elif plain["run"] is not None:
        _show(RunDirectory(check_path("run", plain["run"], "a run directory")))
    else:
        _list(check_path("output", plain["output"]))
    return 0


def _show_task(task: Task) -> None:
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
        print("One part: its module is all there is, so modules make no difference, and ExNEAT trains what NEAT does.")


def _filled(word: str, text: str) -> str:
    return textwrap.fill(text, 110, initial_indent=f"  {word:<8} ", subsequent_indent=" " * 11)


def _show(run: RunDirectory) -> None:
    if not run.is_there():
        raise ExneatError(f"run={run.path}: no run is there; exneat inspect without run= lists them")
    manifest = run.read_manifest()
    if not run.champion.exists():
        why = "a baseline has no networks" if manifest.variant in BASELINES else "it is not finished"
        raise ExneatError(f"run={run.path}: has no champion to show: {why} (status {manifest.status})")
    champion = read_champion(run.champion)
    print(f"{run.path}  ({_status(run, manifest)})")
    kind = "feed-forward" if champion.feed_forward else "recurrent"
    subpopulations = len(champion.plan.subpopulation_shapes)
    print(f"{champion.variant}: {len(champion.plan.modules)} modules, {subpopulations} subpopulations, {kind}\n")
    for module in champion.plan.modules:
        x, y = module.position
        print(f"{module.name}  at ({x:+.2f}, {y:+.2f}), subpopulation {module.subpopulation}")
        for word, texts in (("senses", _sensed(champion, module)), ("reads", _links(champion, module))):
            for text in texts:
                print(_filled(word, text))
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


def _sensed(champion: Champion, module: Module) -> Iterable[str]:
    yield "; ".join(champion.sensors[entry] for entry in module.sensors) or "nothing itself"


def _links(champion: Champion, module: Module) -> Iterable[str]:
    groups: dict[tuple[int, str, bool], list[str]] = {}
    for pin in module.pins:
        if not pin.is_sensor:
            group = pin.module, champion.plan.kind_of(pin), pin.delayed
            groups.setdefault(group, []).append(champion.node_name(pin))
    for (source, kind, delayed), names in groups.items():
        when = "of the previous step" if delayed else "of this step"
        yield f"{kind} {', '.join(names)} of {champion.plan.modules[source].name}, {when}"


def _list(output: Path) -> None:
    runs = find_runs(output)
    if not runs:
        print(f"No runs below {output}; exneat train makes one.")
        return
    print(f"{'status':<12}{'seed':>5}  {'test fitness':>20}  run")
    for run in runs:
        try:
            manifest = run.read_manifest()
            status = _status(run, manifest)
            tested = manifest.result.champion if manifest.result else None
            figure = f"{tested.fitness_mean:.4g} (sd {tested.fitness_std:.3g})" if tested else "-"
            print(f"{status:<12}{manifest.seed:>5}  {figure:>20}  {run.path}")
        except ExneatError:
            print(f"{'damaged':<12}{'?':>5}  {'-':>20}  {run.path}")


def _status(run: RunDirectory, manifest: Manifest) -> str:
    """The manifest's status; a killed process cannot write its own."""
    return "killed" if manifest.status == RUNNING and not run.is_held() else manifest.status
