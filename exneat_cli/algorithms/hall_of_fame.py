"""The best teams of a run, from which the champion is chosen at its end."""

from __future__ import annotations

from collections.abc import Sequence

from exneat_cli.algorithms.algorithm import Candidate

MARGIN = 0.1
"""A team is in while its fitness is at least best - MARGIN * |best|."""
CAPACITY = 20


class HallOfFame:
    """At most `CAPACITY` teams close to the best fitness so far, unique by the ids of their genomes.

    Args:
        entries: of a hall of fame that this one goes on from, best first.
    """

    def __init__(self, entries: Sequence[Candidate] = ()) -> None:
        self._entries = {entry.team.ids: entry for entry in entries}

    @property
    def entries(self) -> list[Candidate]:
        """Best first; of equals, the earlier one first."""
        return list(self._entries.values())

    def add(self, candidate: Candidate) -> None:
        """Offer a team that did not fail; it enters, with the best fitness that it ever had, if it is good enough."""
        known = self._entries.get(candidate.team.ids)
        if known is None or candidate.fitness > known.fitness:
            self._entries[candidate.team.ids] = candidate
        ranked = sorted(self._entries.values(), key=lambda entry: (-entry.fitness, entry.generation))
        threshold = ranked[0].fitness - MARGIN * abs(ranked[0].fitness)
        kept = [entry for entry in ranked if entry.fitness >= threshold][:CAPACITY]
        self._entries = {entry.team.ids: entry for entry in kept}
