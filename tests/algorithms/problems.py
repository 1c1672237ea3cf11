"""Problems of several alike subpopulations, and what co-evolutions are told."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from exneat_cli.algorithms import ArrayGenome, Coevolution, EvolutionSettings, Problem, Results, Team
from exneat_cli.wiring import Module, Pin, Plan

SHAPE = (3, 2, 1)
"""Inputs, initial hidden nodes and outputs of every module."""


def problem_of(
    settings: EvolutionSettings,
    population: int,
    subpopulations: int = 1,
    *,
    shape: tuple[int, int, int] = SHAPE,
    pairing: str = "rank",
    seed: int = 0,
) -> Problem:
    """A problem of modules that sense the same, drive actuators of their own and share no genomes."""
    inputs, hidden, outputs = shape
    pins = tuple(Pin(k) for k in range(inputs))
    modules = [
        Module(f"module {k}", (0.0, 0.0), k, pins, outputs, hidden, tuple(range(k * outputs, (k + 1) * outputs)))
        for k in range(subpopulations)
    ]
    plan = Plan(tuple(modules), inputs, outputs * subpopulations)
    return Problem(plan, settings, population, episodes=1, pairing=pairing, seed=seed)


def tell(evolution: Coevolution, fitness: Sequence[float], failed: Sequence[int] = ()) -> None:
    """Tell the fitness of each team in one episode, in which some may have failed."""
    flags = np.isin(np.arange(len(fitness)), failed)
    assert evolution.tell(Results(np.array(fitness, float)[:, np.newaxis], flags))


def synthetic(team: Team) -> float:
    """A cheap fitness that depends on every genome: large weights are good, large networks a little bad."""
    tables = [genome.connections for genome in team.genomes]
    weights = [abs(weight) for table in tables for weight in table["weight"][table["enabled"]].tolist()]
    return math.fsum(weights) / (1 + len(weights)) - 0.01 * len(weights)


def contents(genome: ArrayGenome) -> object:
    """Id and genes, to be compared."""
    return genome.key, genome.nodes.tolist(), genome.connections.tolist()
