"""The genes of a genome: two tables with one row per gene, compiled queries of their graph, and compiled operators.

Rows are sorted, nodes by `key` and connections by (`target`, `source`), so that two genomes are compared and crossed
in one pass, and the connections into a node are adjacent.

Source of crossover, distance and mutation: Stanley and Miikkulainen, "Evolving neural networks through augmenting
topologies" (2002), sections 3.1 to 3.3, with neat-python's deviations, which are named at each operator.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from exneat_cli.compiling import compiled

ACTIVATIONS = ("tanh", "relu", "sigmoid", "identity", "clamped")
"""neat-python's names; a node gene holds the index."""

NODE = np.dtype(
    [("key", np.int64), ("bias", np.float64), ("response", np.float64), ("activation", np.int64)], align=True
)
"""Outputs have the keys 0, 1, ...; initial hidden nodes follow, then nodes added by mutations."""

CONNECTION = np.dtype(
    [
        ("target", np.int64),
        ("source", np.int64),
        ("innovation", np.int64),
        ("weight", np.float64),
        ("enabled", np.bool_),
    ],
    align=True,
)
"""`source` is a node's key, or -1 - k for input pin k. `innovation` is the number of the mutation that created it."""

Nodes = NDArray[np.void]
Connections = NDArray[np.void]
Genes = tuple[Nodes, Connections]
"""All genes of one genome."""

Number = tuple[float, float, float, float, float, float, float]
"""How a numeric attribute starts and changes: mean, sd, shift_rate, replace_rate, power, low and high. It is drawn anew
from N(mean, sd) with probability replace_rate, or shifted by N(0, power) with probability shift_rate, and clipped to
[low, high]."""

STAYS_DISABLED = 0.75
"""Probability with which crossover disables a gene that is disabled in either parent (the 2002 paper, section 4.1)."""


def end_to_end(tables: Iterable[NDArray[np.void]], kind: np.dtype[np.void]) -> NDArray[np.void]:
    """All rows of all tables of this kind; copies bytes, which is faster than NumPy's copy field by field."""
    return np.frombuffer(bytearray().join(table.data for table in tables), kind)


@compiled
def row_of(connections: Connections, target: int, source: int) -> int:
    """Row of the first connection that is not before (`target`, `source`): the row where it is, or belongs."""
    low, high = 0, connections.size
    while low < high:
        middle = (low + high) // 2
        if (connections[middle].target, connections[middle].source) < (target, source):
            low = middle + 1
        else:
            high = middle
    return low


@compiled
def node_row(nodes: Nodes, key: int) -> int:
    """Row of the node `key`, or -1 if there is none."""
    low, high = 0, nodes.size
    while low < high:
        middle = (low + high) // 2
        if nodes[middle].key < key:
            low = middle + 1
        else:
            high = middle
    return low if low < nodes.size and nodes[low].key == key else -1


@compiled
def mark_sources(nodes: Nodes, connections: Connections, marked: NDArray[np.bool_], only_enabled: bool) -> None:
    """Mark all nodes that lead to a node in `marked`, (N,), through all or only enabled connections, in place."""
    stack = np.empty(nodes.size, np.int64)  # rows that are marked, but whose sources are not yet marked
    depth = 0
    for row in range(nodes.size):
        if marked[row]:
            stack[depth] = row
            depth += 1
    while depth > 0:
        depth -= 1
        key = nodes[stack[depth]].key
        edge = row_of(connections, key, np.iinfo(np.int64).min)  # the first connection into the node
        while edge < connections.size and connections[edge].target == key:
            if connections[edge].source >= 0 and (connections[edge].enabled or not only_enabled):
                row = node_row(nodes, connections[edge].source)
                if row >= 0 and not marked[row]:
                    marked[row] = True
                    stack[depth] = row
                    depth += 1
            edge += 1


@compiled
def would_close_a_cycle(nodes: Nodes, connections: Connections, target: int, source: int) -> bool:
    """Whether a connection from `source` to `target` would add a cycle to a graph without cycles."""
    if source < 0:
        return False
    marked = np.zeros(nodes.size, np.bool_)
    marked[node_row(nodes, source)] = True
    mark_sources(nodes, connections, marked, False)
    return bool(marked[node_row(nodes, target)])


@compiled
def cross(fitter: Genes, other: Genes, average: bool, rng: Generator) -> Genes:
    """The genes of a child.

    Matching genes are mixed attribute by attribute; their weights and biases may be averaged instead. All other genes
    come from the fitter parent, so that the child has that parent's graph and no additional cycles.
    """
    return _cross_nodes(fitter[0], other[0], average, rng), _cross_connections(fitter[1], other[1], average, rng)


@compiled
def _cross_nodes(fitter, other, average, rng):  # type: ignore[no-untyped-def]
    child = fitter.copy()
    j = 0
    for i in range(child.size):
        # Both tables are sorted, so one pass finds the matching genes.
        while j < other.size and other[j].key < child[i].key:
            j += 1
        if j < other.size and other[j].key == child[i].key:
            if average:
                child[i].bias = 0.5 * (child[i].bias + other[j].bias)
            elif rng.random() < 0.5:
                child[i].bias = other[j].bias
            if rng.random() < 0.5:
                child[i].response = other[j].response
            if rng.random() < 0.5:
                child[i].activation = other[j].activation
    return child


@compiled
def _cross_connections(fitter, other, average, rng):  # type: ignore[no-untyped-def]
    child = fitter.copy()
    j = 0
    for i in range(child.size):
        gene = child[i]
        while j < other.size and (other[j].target, other[j].source) < (gene.target, gene.source):
            j += 1
        # An innovation number belongs to one pair of nodes, so genes that match by it meet here.
        if j < other.size and other[j].innovation == gene.innovation:
            either_disabled = not (gene.enabled and other[j].enabled)
            if average:
                gene.weight = 0.5 * (gene.weight + other[j].weight)
            elif rng.random() < 0.5:
                gene.weight = other[j].weight
            if rng.random() < 0.5:
                gene.enabled = other[j].enabled
            if either_disabled and rng.random() < STAYS_DISABLED:
                gene.enabled = False
    return child


@compiled
def genetic_distance(one: Genes, other: Genes, disjoint_coefficient: float, weight_coefficient: float) -> float:
    """Genetic distance of two genomes, at least 0; symmetric up to rounding.

    Equation 1 of the paper, except that excess and disjoint genes count alike, differences are not averaged over
    matching genes only, nodes count as well as connections, and connections match by the nodes that they join.
    """
    distance = 0.0
    most_nodes, most_connections = max(one[0].size, other[0].size), max(one[1].size, other[1].size)
    if most_nodes > 0:
        difference, unmatched = _compare_nodes(one[0], other[0])
        distance += (weight_coefficient * difference + disjoint_coefficient * unmatched) / most_nodes
    if most_connections > 0:
        difference, unmatched = _compare_connections(one[1], other[1])
        distance += (weight_coefficient * difference + disjoint_coefficient * unmatched) / most_connections
    return distance


@compiled
def _compare_nodes(one, other):  # type: ignore[no-untyped-def]
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
def _compare_connections(one, other):  # type: ignore[no-untyped-def]
    """The same for connections, which match by the nodes that they join."""
    difference, matched = 0.0, 0
    i = j = 0
    while i < one.size and j < other.size:
        a, b = (one[i].target, one[i].source), (other[j].target, other[j].source)
        if a == b:
            difference += abs(one[i].weight - other[j].weight)
            difference += 1.0 if one[i].enabled != other[j].enabled else 0.0
            matched += 1
        i, j = i + (a <= b), j + (b <= a)
    return difference, one.size + other.size - 2 * matched


@compiled
def draw(number: Number, rng: Generator) -> float:
    """A new value of a numeric attribute."""
    mean, sd, _, _, _, low, high = number
    return max(min(mean + sd * rng.standard_normal(), high), low)


@compiled
def mutate_attributes(
    genes: Genes,
    numbers: tuple[Number, Number, Number],
    disable_rate: float,
    enable_rate: float,
    sensitivity: NDArray[np.float64],
    rng: Generator,
) -> None:
    """Change weights, enabled flags, biases and responses in place: each is shifted, drawn anew or left.

    Args:
        genes: genes of one genome.
        numbers: how weights, biases and responses change.
        disable_rate: probability that the flag of an enabled connection is drawn anew, true or false with equal chance.
        enable_rate: the same for a disabled connection.
        sensitivity: (pins,) divisors of the shifts of weights that read these pins.
        rng: generator of all draws.
    """
    (nodes, connections), (weight, bias, response) = genes, numbers
    for i in range(connections.size):
        source = connections[i].source
        divisor = sensitivity[-1 - source] if source < 0 else 1.0
        connections[i].weight = _mutated(connections[i].weight, weight, divisor, rng)
        if rng.random() < (disable_rate if connections[i].enabled else enable_rate):
            connections[i].enabled = rng.random() < 0.5
    for i in range(nodes.size):
        nodes[i].bias = _mutated(nodes[i].bias, bias, 1.0, rng)
        nodes[i].response = _mutated(nodes[i].response, response, 1.0, rng)


@compiled
def _mutated(value, number, divisor, rng):  # type: ignore[no-untyped-def]
    _, _, shift_rate, replace_rate, power, low, high = number
    if shift_rate + replace_rate <= 0.0:
        return value
    chance = rng.random()
    if chance < shift_rate:
        return max(min(value + power / divisor * rng.standard_normal(), high), low)
    if chance < shift_rate + replace_rate:
        return draw(number, rng)
    return value
