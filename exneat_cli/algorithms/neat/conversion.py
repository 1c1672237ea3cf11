"""Array genomes to and from neat-python's own, losing nothing."""

from __future__ import annotations

import neat
import numpy as np
from neat.genes import DefaultConnectionGene, DefaultNodeGene

from exneat_cli.algorithms.neat.genes import ACTIVATIONS, CONNECTION, NODE, Connections, Nodes
from exneat_cli.algorithms.neat.genome import ArrayGenome
from exneat_cli.errors import ExneatError


def from_stock(genome: neat.DefaultGenome) -> ArrayGenome:
    """The same genome in arrays.

    Raises:
        ExneatError: a node has an activation, aggregation or time constant that arrays do not hold.
    """
    converted = ArrayGenome(genome.key)
    converted.fitness = genome.fitness
    nodes, connections = tables_of(genome)
    converted.nodes = np.sort(nodes, order="key")
    converted.connections = np.sort(connections, order=["target", "source"])
    return converted


def to_stock(genome: ArrayGenome) -> neat.DefaultGenome:
    """The same genome as neat-python's own, with its genes in the same order."""
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


def tables_of(genome: ArrayGenome | neat.DefaultGenome) -> tuple[Nodes, Connections]:
    """Nodes and connections in the genome's own order.

    Raises:
        ExneatError: a node has an activation, aggregation or time constant that arrays do not hold.
    """
    if isinstance(genome, ArrayGenome):
        return genome.nodes, genome.connections
    rows = [
        (target, source, gene.innovation, gene.weight, gene.enabled)
        for (source, target), gene in genome.connections.items()
    ]
    return np.array([_node_row(node) for node in genome.nodes.values()], NODE), np.array(rows, CONNECTION)


def _node_row(gene: DefaultNodeGene) -> tuple[int, float, float, int]:
    if gene.aggregation != "sum" or gene.time_constant != 1.0 or gene.activation not in ACTIVATIONS:
        expected = f"aggregation sum, time constant 1 and an activation of {', '.join(ACTIVATIONS)}"
        came = f"{gene.aggregation}, {gene.time_constant} and {gene.activation}"
        raise ExneatError(f"node {gene.key}: expected {expected}, got {came}")
    return gene.key, gene.bias, gene.response, ACTIVATIONS.index(gene.activation)
