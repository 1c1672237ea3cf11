"""history.csv: one row per generation."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from exneat_cli.records.files import write_csv


class HistoryRow(NamedTuple):
    """One generation, counted from 1.

    Attributes:
        generation: counted from 1.
        best_fitness, mean_fitness, median_fitness: over the generation's teams; the best of those that
            did not fail.
        best_so_far: running maximum of `best_fitness`.
        episodes, env_steps: training episodes and control steps since the run began.
        species: sum over subpopulations.
        connections, hidden_nodes: of the best team, each genome once; enabled connections, nodes that
            are not outputs.
        failed_episodes: of this generation.
        extinctions: subpopulations that were created anew for this generation.
        wall_seconds: time since training began; the only column that differs between equal runs.
    """

    generation: int
    best_fitness: float
    mean_fitness: float
    median_fitness: float
    best_so_far: float
    episodes: int
    env_steps: int
    species: int
    connections: int
    hidden_nodes: int
    failed_episodes: int
    extinctions: int
    wall_seconds: float


def write_history(path: Path, rows: Sequence[HistoryRow]) -> None:
    """Write all rows so far.

    Raises:
        ExneatError: the file cannot be written.
    """
    write_csv(path, HistoryRow._fields, rows)
