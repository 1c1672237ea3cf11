"""Which teams a search remembers, so that one of them may become the champion."""

from __future__ import annotations

from collections.abc import Sequence

from exneat_cli.algorithms.algorithm import Candidate

CHAMPIONS = ("race", "thesis")
"""``race``: the best teams of all generations race on validation episodes; ``thesis``: those near the best training
fitness are validated alike (Zhang, 2025, section 3.3)."""
MARGIN = 0.1
"""Under ``thesis`` a team is in the hall of fame while its fitness is at least best - MARGIN * |best|."""
CAPACITY = 20
RACERS = 32
"""Most candidates of a race."""


def with_candidate(hall_of_fame: Sequence[Candidate], offered: Candidate) -> list[Candidate]:
    """The hall of fame after a team that did not fail was offered to it, which enters if it is good enough.

    There are at most `CAPACITY` teams close to the best fitness so far, unique by the ids of their genomes, with the
    best fitness that each ever had; the best first, of equals the earlier one first.
    """
    entries = {entry.team.ids: entry for entry in hall_of_fame}
    known = entries.get(offered.team.ids)
    if known is None or offered.fitness > known.fitness:
        entries[offered.team.ids] = offered
    ranked = sorted(entries.values(), key=lambda entry: (-entry.fitness, entry.generation))
    threshold = ranked[0].fitness - MARGIN * abs(ranked[0].fitness)
    return [entry for entry in ranked if entry.fitness >= threshold][:CAPACITY]


def with_racers(racers: Sequence[Candidate], best: Sequence[Candidate]) -> list[Candidate]:
    """The candidates of a race after a generation, of which `best` are the best teams, the first one of all.

    At most `RACERS` teams with the highest fitness that they were last judged to have, unique by the ids of their
    genomes; the best first, of equals the earlier one first. The first of `best` is among them whatever its fitness.
    """
    entries = {entry.team.ids: entry for entry in (*racers, *best)}
    ranked = sorted(entries.values(), key=lambda entry: (-entry.fitness, entry.generation))
    if best and best[0] not in ranked[:RACERS]:
        return [*ranked[: RACERS - 1], best[0]]
    return ranked[:RACERS]
