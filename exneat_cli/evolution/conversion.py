"""Array genomes to and from neat-python's own, losing nothing."""

from __future__ import annotations

import neat
import numpy as np
from neat.genes import DefaultConnectionGene, DefaultNodeGene

from exneat_cli.errors import ExneatError
from exneat_cli.evolution.array_genome import ArrayGenome
from exneat_cli.evolution.genes import ACTIVATIONS, CONNECTION, NODE


def from_stock(genome: neat.DefaultGenome) -> ArrayGenome:
    """The same genome in arrays.

    Raises:
        ExneatError: a node has an activation, aggregation or time constant that arrays do not hold.
    """
    converted = ArrayGenome(genome.key)
    converted.fitness = genome.fitness
    converted.nodes = np.array([_node_row(genome.nodes[key]) for key in sorted(genome.nodes)], NODE)
    rows = [
        (target, source, gene.innovation, gene.weight, gene.enabled)
        for (source, target), gene in genome.connections.items()
    ]
    converted.connections = np.array(sorted(rows), CONNECTION)
    return converted


def _node_row(gene: DefaultNodeGene) -> tuple[int, float, float, int]:
    if gene.aggregation != "sum":
        raise ExneatError(f"node {gene.key}: expected aggregation sum, got {gene.aggregation!r}")
    if gene.time_constant != 1.0:
        raise ExneatError(f"node {gene.key}: expected a time constant of 1, got {gene.time_constant!r}")
    if gene.activation not in ACTIVATIONS:
        known = ", ".join(ACTIVATIONS)
        raise ExneatError(f"node {gene.key}: expected an activation of {known}, got {gene.activation!r}")
    return gene.key, gene.bias, gene.response, ACTIVATIONS.index(gene.activation)


def to_stock(genome: ArrayGenome) -> neat.DefaultGenome:
    """The same genome as neat-python's own, for its networks and tools."""
    converted = neat.DefaultGenome(genome.key)
    converted.fitness = genome.fitness
    for key, bias, response, activation in genome.nodes.tolist():
        node = DefaultNodeGene(key)
        node.bias, node.response, node.activation = bias, response, ACTIVATIONS[activation]
        node.aggregation, node.time_constant = "sum", 1.0
        converted.nodes[key] = node
    for target, source, innovation, weight, enabled in genome.connections.tolist():
        gene = DefaultConnectionGene((source, target), innovation=innovation)
        gene.weight, gene.enabled = weight, enabled
        converted.connections[source, target] = gene
    return converted
