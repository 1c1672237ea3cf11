"""Compiled crossover.

Source: Stanley and Miikkulainen, "Evolving neural networks through augmenting topologies" (2002), section 3.2,
in neat-python's form: matching genes mix attribute by attribute, and all others come from the fitter parent,
so that a child's graph is the fitter parent's and cannot have a cycle which that has not.
"""

from __future__ import annotations

from numpy.random import Generator

from exneat_cli.algorithms.neat.genes import Connections, Nodes
from exneat_cli.compiling import compiled

STAYS_DISABLED = 0.75
"""Chance that a gene is disabled which is disabled in a parent (the 2002 paper, section 4.1)."""


@compiled
def cross(
    nodes: Nodes, connections: Connections, other_nodes: Nodes, other_connections: Connections, rng: Generator
) -> tuple[Nodes, Connections]:
    """Nodes and connections of a child.

    Args:
        nodes: of the fitter parent.
        connections: of the fitter parent.
        other_nodes: of the other parent.
        other_connections: of the other parent.
        rng: draws one number per attribute of each matching gene, and one where a parent's gene is disabled.
    """
    return _cross_nodes(nodes, other_nodes, rng), _cross_connections(connections, other_connections, rng)


@compiled
def _cross_nodes(fitter: Nodes, other: Nodes, rng: Generator) -> Nodes:
    child = fitter.copy()
    j = 0
    for i in range(child.size):
        while j < other.size and other[j].key < child[i].key:
            j += 1
        if j < other.size and other[j].key == child[i].key:
            if rng.random() < 0.5:
                child[i].bias = other[j].bias
            if rng.random() < 0.5:
                child[i].response = other[j].response
            if rng.random() < 0.5:
                child[i].activation = other[j].activation
    return child


@compiled
def _cross_connections(fitter: Connections, other: Connections, rng: Generator) -> Connections:
    child = fitter.copy()
    j = 0
    for i in range(child.size):
        gene = child[i]
        while j < other.size and (
            other[j].target < gene.target or (other[j].target == gene.target and other[j].source < gene.source)
        ):
            j += 1
        # An innovation number belongs to one pair of nodes, so genes that match by it meet here.
        if j < other.size and other[j].innovation == gene.innovation:
            either_disabled = not (gene.enabled and other[j].enabled)
            if rng.random() < 0.5:
                gene.weight = other[j].weight
            if rng.random() < 0.5:
                gene.enabled = other[j].enabled
            if either_disabled and rng.random() < STAYS_DISABLED:
                gene.enabled = False
    return child
