"""champion.json and hall_of_fame.jsonl: teams as plain data, readable without exneat."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from exneat_cli.brains import Brain, assemble
from exneat_cli.errors import ExneatError
from exneat_cli.evolution import ArrayGenome, Entry, genome_from_data, genome_to_data
from exneat_cli.records.files import read_json, write_json, write_whole
from exneat_cli.wiring import Module, Pin, Plan

FORMAT = 1


@dataclass(frozen=True)
class Champion:
    """The team that a run hands over.

    Attributes:
        arm: what was trained, e.g. ``exneat-all-none``.
        task: the task's parameters.
        actuators: names of the entries of the action.
        feed_forward: the kind of networks.
        plan: who senses and drives what.
        genomes: one per subpopulation.
        scores: training, validation and test figures.
    """

    arm: str
    task: dict[str, Any]
    actuators: tuple[str, ...]
    feed_forward: bool
    plan: Plan
    genomes: tuple[ArrayGenome, ...]
    scores: dict[str, Any]

    def brain(self) -> Brain:
        """The runnable network."""
        return assemble(self.plan, self.genomes, feed_forward=self.feed_forward)


def write_champion(path: Path, champion: Champion) -> None:
    """Write a champion.

    Raises:
        ExneatError: the file cannot be written.
    """
    content = {
        "format": FORMAT,
        "arm": champion.arm,
        "task": champion.task,
        "actuators": champion.actuators,
        "feed_forward": champion.feed_forward,
        "scores": champion.scores,
        "plan": asdict(champion.plan),
        "genomes": [genome_to_data(genome) for genome in champion.genomes],
    }
    write_json(path, content)


def read_champion(path: Path) -> Champion:
    """Read a champion as data: nothing in the file is run.

    Raises:
        ExneatError: the file is missing, damaged, or of another format.
    """
    content = read_json(path)
    if content.get("format") != FORMAT:
        raise ExneatError(f"{path}: expected a champion of format {FORMAT}, got {content.get('format')!r}")
    try:
        champion = Champion(
            arm=str(content["arm"]),
            task=dict(content["task"]),
            actuators=tuple(content["actuators"]),
            feed_forward=bool(content["feed_forward"]),
            plan=plan_from_data(content["plan"]),
            genomes=tuple(genome_from_data(genome) for genome in content["genomes"]),
            scores=dict(content["scores"]),
        )
        _check(champion)
        return champion
    except (KeyError, TypeError, ValueError, AttributeError, IndexError, OverflowError) as error:
        raise ExneatError(f"{path}: damaged: {type(error).__name__}: {error}") from error


def _check(champion: Champion) -> None:
    """Raise what `read_champion` turns into words if the parts do not fit together."""
    champion.plan.check()
    if len(champion.actuators) != champion.plan.action_size:
        raise ValueError(f"names {len(champion.actuators)} actuators for {champion.plan.action_size}")
    for figure in ("fitness_mean", "fitness_std", "episodes"):
        float(champion.scores["test"][figure])
    champion.brain()


def write_hall_of_fame(path: Path, entries: Sequence[Entry], validation: Sequence[float]) -> None:
    """Write one line per team, best on validation first.

    Args:
        path: of the file.
        entries: the teams.
        validation: mean fitness of each on the validation episodes.

    Raises:
        ExneatError: the file cannot be written.
    """
    ranked = sorted(zip(entries, validation, strict=True), key=lambda pair: -pair[1])
    lines = [
        json.dumps(
            {
                "rank": rank,
                "generation": entry.generation + 1,
                "training_fitness": entry.fitness,
                "validation_fitness": score,
                "genomes": [genome_to_data(genome) for genome in entry.team.genomes],
            },
            allow_nan=False,
        )
        for rank, (entry, score) in enumerate(ranked, start=1)
    ]
    write_whole(path, "".join(line + "\n" for line in lines))


def plan_from_data(data: dict[str, Any]) -> Plan:
    """The plan in a champion file, as read from JSON; not checked.

    Raises:
        KeyError, TypeError, ValueError: a field is missing or of the wrong type.
    """
    modules = tuple(
        Module(
            name=module["name"],
            position=(float(module["position"][0]), float(module["position"][1])),
            subpopulation=module["subpopulation"],
            pins=tuple(Pin(**pin) for pin in module["pins"]),
            outputs=module["outputs"],
            hidden=module["hidden"],
            drives=tuple(module["drives"]),
        )
        for module in data["modules"]
    )
    return Plan(modules, int(data["observation_size"]), int(data["action_size"]))
