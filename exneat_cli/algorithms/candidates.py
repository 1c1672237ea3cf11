"""Candidates: the teams that a search keeps, one of which may become the champion."""

from __future__ import annotations

from collections.abc import Sequence

from exneat_cli.algorithms.algorithm import Candidate

CHAMPIONS = ("race", "thesis")
"""``race``: the best teams of all generations race on validation episodes; ``thesis``: all teams near the best training
fitness get the same validation (Zhang, 2025, section 3.3)."""
MARGIN = 0.1
"""With ``thesis``, a team stays in the hall of fame while its fitness is at least best - MARGIN * |best|."""
CAPACITY = 20
RACERS = 32
"""Maximum number of candidates in a race."""


def with_candidate(hall_of_fame: Sequence[Candidate], offered: Candidate) -> list[Candidate]:
    """The hall of fame after a team that did not fail has been offered to it.

    It has at most `CAPACITY` teams close to the best fitness so far, unique by the ids of their genomes, each with the
    best fitness that it ever had; the best come first, and of equals the earlier one.
    """
    entries = {entry.team.ids: entry for entry in hall_of_fame}
    known = entries.get(offered.team.ids)
    if known is None or offered.fitness > known.fitness:
        entries[offered.team.ids] = offered
    ranked = sorted(entries.values(), key=lambda entry: (-entry.fitness, entry.generation))
    threshold = ranked[0].fitness - MARGIN * abs(ranked[0].fitness)
    return [entry for entry in ranked if entry.fitness >= threshold][:CAPACITY]


def with_racers(racers: Sequence[Candidate], best: Sequence[Candidate]) -> list[Candidate]:
    """The candidates of a race after a generation with these `best` teams, the best one first.

    At most `RACERS` teams with the highest fitness, as last judged, unique by the ids of their genomes; the best come
    first, and of equals the earlier one. The first of `best` is always among them.
    """
    entries = {entry.team.ids: entry for entry in (*racers, *best)}
    ranked = sorted(entries.values(), key=lambda entry: (-entry.fitness, entry.generation))
    if best and best[0] not in ranked[:RACERS]:
        return [*ranked[: RACERS - 1], best[0]]
    return ranked[:RACERS]
