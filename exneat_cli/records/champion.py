"""champion.json and hall_of_fame.jsonl: teams as plain data, readable without exneat."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from exneat_cli.algorithms import ArrayGenome, Candidate, genome_from_data, genome_to_data
from exneat_cli.brains import Brain, assemble
from exneat_cli.records.champion_data import FORMAT, plan_from_data, read_champion_data
from exneat_cli.records.files import write_json, write_whole
from exneat_cli.wiring import Plan


@dataclass(frozen=True)
class Champion:
    """The team that a run hands over.

    Attributes:
        variant: what was trained, e.g. ``exneat-all-none``.
        task: the task's parameters.
        actuators: names of the entries of the action.
        feed_forward: the kind of networks.
        plan: who senses and drives what.
        genomes: one per subpopulation.
        scores: training, validation and test figures.
    """

    variant: str
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
        "variant": champion.variant,
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
        ExneatError: see `read_champion_data`.
    """
    content = read_champion_data(path)
    return Champion(
        variant=content["variant"],
        task=content["task"],
        actuators=tuple(content["actuators"]),
        feed_forward=content["feed_forward"],
        plan=plan_from_data(content["plan"]),
        genomes=tuple(genome_from_data(genome) for genome in content["genomes"]),
        scores=content["scores"],
    )


def write_hall_of_fame(path: Path, entries: Sequence[Candidate], validation: Sequence[float]) -> None:
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
