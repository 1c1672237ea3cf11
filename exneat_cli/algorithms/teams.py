"""Teams that are kept: the hall of fame, from which the champion is chosen, and teams as columns for checkpoints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exneat_cli.algorithms.algorithm import Candidate, Problem, Team
from exneat_cli.algorithms.neat.packing import pack, unpack

MARGIN = 0.1
"""A team is in the hall of fame while its fitness is at least best - MARGIN * |best|."""
CAPACITY = 20


def with_candidate(hall_of_fame: Sequence[Candidate], offered: Candidate) -> list[Candidate]:
    """The hall of fame after a team that did not fail was offered to it.

    Args:
        hall_of_fame: at most `CAPACITY` teams close to the best fitness so far, unique by the ids of their genomes;
            the best first, of equals the earlier one first.
        offered: enters, with the best fitness that it ever had, if it is good enough.
    """
    entries = {entry.team.ids: entry for entry in hall_of_fame}
    known = entries.get(offered.team.ids)
    if known is None or offered.fitness > known.fitness:
        entries[offered.team.ids] = offered
    ranked = sorted(entries.values(), key=lambda entry: (-entry.fitness, entry.generation))
    threshold = ranked[0].fitness - MARGIN * abs(ranked[0].fitness)
    return [entry for entry in ranked if entry.fitness >= threshold][:CAPACITY]


def pack_teams(teams: Sequence[Team], prefix: str) -> dict[str, NDArray[Any]]:
    """Ids of the teams' genomes, (T, subpopulations), and each genome once; column names begin with `prefix`."""
    arrays: dict[str, NDArray[Any]] = {f"{prefix}.ids": np.array([team.ids for team in teams], np.int64)}
    for index, genomes in enumerate(zip(*(team.genomes for team in teams), strict=True)):
        arrays |= pack(list({genome.key: genome for genome in genomes}.values()), f"{prefix}.{index}")
    return arrays


def unpack_teams(arrays: Mapping[str, NDArray[Any]], prefix: str, problem: Problem) -> list[Team]:
    """The teams that `pack_teams` was given.

    Args:
        arrays: from `pack_teams`, or from a file of anyone's.
        prefix: as it was.
        problem: whose networks the genomes must make.

    Raises:
        KeyError, ValueError: a column is missing or damaged, or a genome does not fit.
    """
    shapes, ids = problem.plan.subpopulation_shapes, arrays[f"{prefix}.ids"]
    if not ids.size:
        return []
    if ids.dtype != np.int64 or ids.shape[1:] != (len(shapes),):
        expected = f"whole numbers, {len(shapes)} of each team"
        raise ValueError(f"{prefix}.ids: expected {expected}, got {ids.dtype} {ids.shape}")
    feed_forward = problem.evolution.feed_forward
    known: list[dict[int, Any]] = [
        {genome.key: genome for genome in unpack(arrays, f"{prefix}.{index}", shape, feed_forward=feed_forward)}
        for index, shape in enumerate(shapes)
    ]
    return [Team(tuple(own[key] for own, key in zip(known, keys, strict=True)), tuple(keys)) for keys in ids.tolist()]
