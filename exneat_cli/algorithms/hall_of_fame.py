"""The best teams of a run, from which the champion is chosen at its end."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from exneat_cli.algorithms.exneat import Team

MARGIN = 0.1
"""A team is in while its fitness is at least best - MARGIN * |best|."""
CAPACITY = 20


class Entry(NamedTuple):
    """A team with the best training fitness that it ever had, and the generation (from 0) of that."""

    team: Team
    fitness: float
    generation: int


class HallOfFame:
    """At most `CAPACITY` teams close to the best fitness so far, unique by the ids of their genomes.

    Args:
        entries: of a hall of fame that this one goes on from, best first.
    """

    def __init__(self, entries: Sequence[Entry] = ()) -> None:
        self._entries = {entry.team.ids: entry for entry in entries}

    @property
    def entries(self) -> list[Entry]:
        """Best first; of equals, the earlier one first."""
        return list(self._entries.values())

    def add(self, team: Team, fitness: float, generation: int) -> None:
        """Offer a team that did not fail; it enters if it is good enough."""
        known = self._entries.get(team.ids)
        if known is None or fitness > known.fitness:
            self._entries[team.ids] = Entry(team, fitness, generation)
        ranked = sorted(self._entries.values(), key=lambda entry: (-entry.fitness, entry.generation))
        threshold = ranked[0].fitness - MARGIN * abs(ranked[0].fitness)
        kept = [entry for entry in ranked if entry.fitness >= threshold][:CAPACITY]
        self._entries = {entry.team.ids: entry for entry in kept}
