"""Teams as columns of numbers, for checkpoints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exneat_cli.algorithms.algorithm import Problem, Team
from exneat_cli.algorithms.neat.packing import columns_of, pack, unpack
from exneat_cli.algorithms.neat.soundness import check_genome


def pack_teams(teams: Sequence[Team], prefix: str) -> dict[str, NDArray[Any]]:
    """Ids of the teams' genomes, (T, subpopulations), and each genome once; column names begin with `prefix`."""
    arrays: dict[str, NDArray[Any]] = {f"{prefix}.ids": np.array([team.ids for team in teams], np.int64)}
    for index, genomes in enumerate(zip(*(team.genomes for team in teams), strict=True)):
        columns = pack(list({genome.key: genome for genome in genomes}.values()))
        arrays |= {f"{prefix}.{index}.{name}": column for name, column in columns.items()}
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
    shapes = problem.plan.subpopulation_shapes
    ids = arrays[f"{prefix}.ids"]
    if ids.dtype != np.int64 or (ids.size and ids.shape[1:] != (len(shapes),)):
        raise ValueError(
            f"{prefix}.ids: expected whole numbers, {len(shapes)} of each team, got {ids.dtype} {ids.shape}"
        )
    if not ids.size:
        return []
    known = []
    for index, (inputs, _, outputs) in enumerate(shapes):
        genomes = unpack(columns_of(arrays, f"{prefix}.{index}"))
        for genome in genomes:
            check_genome(genome, inputs, outputs, feed_forward=problem.evolution.feed_forward)
        known.append({genome.key: genome for genome in genomes})
    return [Team(tuple(own[key] for own, key in zip(known, keys, strict=True)), tuple(keys)) for keys in ids.tolist()]
