"""A training between two generations, to and from a checkpoint."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from exneat_cli.algorithms import ArrayGenome, Columns, Entry, Snapshot, Team, pack, unpack
from exneat_cli.records import Checkpoint, HistoryRow

_CURRENT, _REMEMBERED = "current", "remembered"


@dataclass(frozen=True)
class SavedTraining:
    """All that the rest of a training depends on.

    Attributes:
        coevolution: of the current generation.
        hall_of_fame: best first.
        first_generation: the best team of the first generation.
        history: one row per generation.
    """

    coevolution: Snapshot
    hall_of_fame: list[Entry]
    first_generation: Team
    history: list[HistoryRow]

    def as_checkpoint(self) -> Checkpoint:
        """The same as plain data and columns."""
        arrays: dict[str, Any] = {}
        for index, columns in enumerate(self.coevolution.genomes):
            arrays |= _named(columns, index, _CURRENT)
        for index, genomes in enumerate(self._remembered()):
            arrays |= _named(pack(genomes), index, _REMEMBERED)
        plain = {
            "coevolution": self.coevolution.plain,
            "hall_of_fame": [[entry.team.ids, entry.fitness, entry.generation] for entry in self.hall_of_fame],
            "first_generation": self.first_generation.ids,
            "history": self.history,
        }
        return Checkpoint(len(self.history), plain, arrays)

    def _remembered(self) -> list[list[ArrayGenome]]:
        """The genomes of the teams that are kept for the end, each once, by subpopulation."""
        teams = [self.first_generation, *(entry.team for entry in self.hall_of_fame)]
        return [
            list({genome.key: genome for genome in genomes}.values())
            for genomes in zip(*(team.genomes for team in teams), strict=True)
        ]

    @classmethod
    def read(cls, checkpoint: Checkpoint, subpopulations: int) -> SavedTraining:
        """The training that `as_checkpoint` was given.

        Args:
            checkpoint: from this run, or from anyone.
            subpopulations: how many there must be.

        Raises:
            IndexError, KeyError, OverflowError, TypeError, ValueError: it is none, or does not fit.
        """
        plain, numbers = checkpoint.plain, range(subpopulations)
        remembered = [
            {genome.key: genome for genome in unpack(_of(checkpoint.arrays, index, _REMEMBERED))} for index in numbers
        ]
        history = [_row(number, values) for number, values in enumerate(plain["history"], start=1)]
        return cls(
            Snapshot(plain["coevolution"], [_of(checkpoint.arrays, index, _CURRENT) for index in numbers]),
            [_entry(values, remembered, len(history)) for values in plain["hall_of_fame"]],
            _team(plain["first_generation"], remembered),
            history,
        )


def _named(columns: Columns, index: int, group: str) -> Columns:
    return {f"{index}.{group}.{name}": column for name, column in columns.items()}


def _of(arrays: Mapping[str, Any], index: int, group: str) -> Columns:
    prefix = f"{index}.{group}."
    return {name.removeprefix(prefix): column for name, column in arrays.items() if name.startswith(prefix)}


def _team(ids: Sequence[Any], genomes: Sequence[Mapping[int, ArrayGenome]]) -> Team:
    keys = tuple(int(key) for key in ids)
    return Team(tuple(own[key] for own, key in zip(genomes, keys, strict=True)), keys)


def _entry(values: Sequence[Any], genomes: Sequence[Mapping[int, ArrayGenome]], generations: int) -> Entry:
    ids, fitness, generation = values
    entry = Entry(_team(ids, genomes), float(fitness), int(generation))
    if not math.isfinite(entry.fitness) or not 0 <= entry.generation < generations:
        raise ValueError(f"expected a finite fitness in one of {generations} generations, got {values}")
    return entry


def _row(number: int, values: Sequence[Any]) -> HistoryRow:
    row = HistoryRow(*values)
    if row.generation != number or not all(isinstance(each, int | float) and math.isfinite(each) for each in row):
        raise ValueError(f"expected the figures of generation {number}, got {values}")
    return row
