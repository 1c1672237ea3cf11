"""Compiled genetic distance.

Source: Stanley and Miikkulainen, "Evolving neural networks through augmenting topologies" (2002), equation 1,
in neat-python's form: excess and disjoint genes count alike, differences are not averaged over matching genes
alone, nodes count as well as connections, and connections match by the nodes that they join.
"""

from __future__ import annotations

from exneat_cli.algorithms.neat.genes import Connections, Nodes
from exneat_cli.compiling import compiled


@compiled
def genetic_distance(
    nodes: Nodes,
    connections: Connections,
    other_nodes: Nodes,
    other_connections: Connections,
    disjoint_coefficient: float,
    weight_coefficient: float,
) -> float:
    """Distance of two genomes, at least 0; symmetric but for rounding.

    Args:
        nodes: of one genome.
        connections: of the same.
        other_nodes: of the other genome.
        other_connections: of the other genome.
        disjoint_coefficient: weight of genes that only one of them has.
        weight_coefficient: weight of differences between genes that both have.
    """
    distance = 0.0
    most_nodes = max(nodes.size, other_nodes.size)
    if most_nodes > 0:
        difference, unmatched = _compare_nodes(nodes, other_nodes)
        distance += (weight_coefficient * difference + disjoint_coefficient * unmatched) / most_nodes
    most_connections = max(connections.size, other_connections.size)
    if most_connections > 0:
        difference, unmatched = _compare_connections(connections, other_connections)
        distance += (weight_coefficient * difference + disjoint_coefficient * unmatched) / most_connections
    return distance


@compiled
def _compare_nodes(one: Nodes, other: Nodes) -> tuple[float, int]:
    """Sum of the differences of matching genes, and the number of the others."""
    difference, matched = 0.0, 0
    i = j = 0
    while i < one.size and j < other.size:
        a, b = one[i], other[j]
        if a.key == b.key:
            difference += abs(a.bias - b.bias) + abs(a.response - b.response)
            difference += 1.0 if a.activation != b.activation else 0.0
            matched += 1
        i, j = i + (a.key <= b.key), j + (b.key <= a.key)
    return difference, one.size + other.size - 2 * matched


@compiled
def _compare_connections(one: Connections, other: Connections) -> tuple[float, int]:
    """Sum of the differences of matching genes, and the number of the others."""
    difference, matched = 0.0, 0
    i = j = 0
    while i < one.size and j < other.size:
        a, b = one[i], other[j]
        if a.target == b.target and a.source == b.source:
            difference += abs(a.weight - b.weight)
            difference += 1.0 if a.enabled != b.enabled else 0.0
            matched += 1
            i += 1
            j += 1
        elif a.target < b.target or (a.target == b.target and a.source < b.source):
            i += 1
        else:
            j += 1
    return difference, one.size + other.size - 2 * matched
