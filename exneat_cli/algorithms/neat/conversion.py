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
    """The same genome as neat-python's own, for its networks and tools."""
    converted = stock_genome(genome.key, genome.nodes, genome.connections, neat.DefaultGenome)
    converted.fitness = genome.fitness
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
    if gene.aggregation != "sum":
        raise ExneatError(f"node {gene.key}: expected aggregation sum, got {gene.aggregation!r}")
    if gene.time_constant != 1.0:
        raise ExneatError(f"node {gene.key}: expected a time constant of 1, got {gene.time_constant!r}")
    if gene.activation not in ACTIVATIONS:
        known = ", ".join(ACTIVATIONS)
        raise ExneatError(f"node {gene.key}: expected an activation of {known}, got {gene.activation!r}")
    return gene.key, gene.bias, gene.response, ACTIVATIONS.index(gene.activation)


def stock_genome(
    key: int, nodes: Nodes, connections: Connections, kind: type[neat.DefaultGenome]
) -> neat.DefaultGenome:
    """A genome of neat-python's, or of a class that extends it, with these genes in this order."""
    genome = kind(key)
    for node_key, bias, response, activation in nodes.tolist():
        node = DefaultNodeGene(node_key)
        node.bias, node.response, node.activation = bias, response, ACTIVATIONS[activation]
        node.aggregation, node.time_constant = "sum", 1.0
        genome.nodes[node_key] = node
    for target, source, innovation, weight, enabled in connections.tolist():
        gene = DefaultConnectionGene((source, target), innovation=innovation)
        gene.weight, gene.enabled = weight, enabled
        genome.connections[source, target] = gene
    return genome
