"""All weights and biases of a team as one vector, and teams made from vectors, with input normalisation folded in.

Input normalisation: the value x of every sensor pin becomes (x - mean) / sd, with the statistics of all values that the
pin has sensed so far, pooled over the modules that share a genome (Mania et al., 2018, section 3.2). A network with
biases can include this in its parameters: each weight w becomes w / sd, and the sum of w mean / sd is subtracted from
the bias. The teams are therefore ordinary ones.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from exneat_cli.algorithms.algorithm import Problem, Team
from exneat_cli.algorithms.neat.genes import CONNECTION, NODE
from exneat_cli.algorithms.neat.genome import ArrayGenome
from exneat_cli.algorithms.neat.neat_python import neat_config
from exneat_cli.algorithms.neat.settings import EvolutionSettings
from exneat_cli.algorithms.neat.subpopulation import Subpopulation
from exneat_cli.seeding import stream
from exneat_cli.wiring import Moments

LEAST_SD = 0.01
"""Minimum sd, in a pin's unit: otherwise rare changes of an almost constant input would be amplified too much."""

Vectors = NDArray[np.float64]


def has_biases(evolution: EvolutionSettings) -> bool:
    """Whether evolution could ever give a node a bias."""
    return evolution.bias_init_stdev > 0.0 or min(evolution.bias_mutate_rate, evolution.bias_mutate_power) > 0.0


class Layout:
    """The layout of a problem's vector: for each subpopulation, the weights of connections, then any biases.

    Attributes:
        with_biases: whether nodes have biases.
        size: length of the vector.
        folded_size: length of a folded vector, in which every node has a bias.
    """

    def __init__(self, problem: Problem) -> None:
        self.with_biases = has_biases(problem.evolution)
        self._genomes = []
        for index, shape in enumerate(problem.plan.subpopulation_shapes):
            config = neat_config(problem.evolution, 2, shape)
            initial = Subpopulation(config, stream(problem.seed, "evolution", index))
            self._genomes.append(initial.in_arrays(min(initial.genomes)))
        weights = sum(len(genome.connections) for genome in self._genomes)
        biases = sum(len(genome.nodes) for genome in self._genomes)
        self.size, self.folded_size = weights + (biases if self.with_biases else 0), weights + biases

    def folded(self, vectors: Vectors, sensed: Sequence[Moments]) -> Vectors:
        """Vectors, (T, size), as weights and biases of networks, (T, folded_size), with input normalisation folded in.

        `sensed` are the moments of each subpopulation's pins; pins with fewer than two values are not normalised.
        """
        columns, first = [], 0
        for genome, moments in zip(self._genomes, sensed, strict=True):
            targets, sources = genome.connections["target"], genome.connections["source"]
            last = first + len(sources)
            mean, sd = _of_connections(sources, moments)
            weights = vectors[:, first:last] / sd
            biases = np.zeros((len(vectors), len(genome.nodes)))
            first = last
            if self.with_biases:
                first = last + len(genome.nodes)
                biases += vectors[:, last:first]
                for row, key in enumerate(genome.nodes["key"]):
                    into = targets == key
                    biases[:, row] -= (weights[:, into] * mean[into]).sum(axis=1)
            columns += [weights, biases]
        return np.concatenate(columns, axis=1)

    def teams(self, folded: Vectors, ids: Sequence[int]) -> list[Team]:
        """The teams of vectors from `folded`, all of whose genomes have the team's id."""
        members, first = [], 0
        for genome in self._genomes:
            last = first + len(genome.connections)
            connections = np.zeros((len(folded), len(genome.connections)), CONNECTION)
            connections[:] = genome.connections
            connections["weight"] = folded[:, first:last]
            nodes = np.zeros((len(folded), len(genome.nodes)), NODE)
            nodes[:] = genome.nodes
            first = last + len(genome.nodes)
            nodes["bias"] = folded[:, last:first]
            members.append([ArrayGenome(*genes) for genes in zip(ids, nodes, connections, strict=True)])
        return [Team(own, (key,) * len(own)) for key, own in zip(ids, zip(*members, strict=True), strict=True)]


def _of_connections(sources: NDArray[np.int64], moments: Moments) -> tuple[Vectors, Vectors]:
    """Mean and sd of the values that each connection reads; 0 and 1 for nodes and pins with fewer than two values."""
    counts, means, squares = moments
    known = counts >= 2.0
    sd = np.sqrt(np.divide(squares, counts, out=np.ones_like(counts), where=known))
    pins = np.maximum(-1 - sources, 0)
    mean_of, sd_of = np.where(known, means, 0.0)[pins], np.where(known, np.maximum(sd, LEAST_SD), 1.0)[pins]
    return np.where(sources < 0, mean_of, 0.0), np.where(sources < 0, sd_of, 1.0)
