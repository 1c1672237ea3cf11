"""Compiled operators on genes: crossover, genetic distance, mutation of attributes.

Source: Stanley and Miikkulainen, "Evolving neural networks through augmenting topologies" (2002), sections 3.1 to 3.3,
in neat-python's form, which is said at each.
"""

from __future__ import annotations

from typing import NamedTuple

from numpy.random import Generator

from exneat_cli.algorithms.neat.genes import Genes
from exneat_cli.compiling import compiled

STAYS_DISABLED = 0.75
"""Chance that a gene is disabled which is disabled in a parent (the 2002 paper, section 4.1)."""


@compiled
def cross(fitter: Genes, other: Genes, rng: Generator) -> Genes:
    """The genes of a child.

    Matching genes mix attribute by attribute. All others come from the fitter parent, so that a child's graph is that
    parent's and cannot have a cycle which that has not.
    """
    return _cross_nodes(fitter[0], other[0], rng), _cross_connections(fitter[1], other[1], rng)


@compiled
def _cross_nodes(fitter, other, rng):  # type: ignore[no-untyped-def]
    child = fitter.copy()
    j = 0
    for i in range(child.size):
        # Both tables are sorted: one pass finds what matches.
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
def _cross_connections(fitter, other, rng):  # type: ignore[no-untyped-def]
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


@compiled
def genetic_distance(one: Genes, other: Genes, disjoint_coefficient: float, weight_coefficient: float) -> float:
    """Distance of two genomes, at least 0; symmetric but for rounding.

    Equation 1 of the paper, but excess and disjoint genes count alike, differences are not averaged over matching
    genes alone, nodes count as well as connections, and connections match by the nodes that they join.

    Args:
        one: the genes of one genome.
        other: those of the other.
        disjoint_coefficient: weight of genes that only one of them has.
        weight_coefficient: weight of differences between genes that both have.
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
    """The same of connections, which match by the nodes that they join."""
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


class Number(NamedTuple):
    """How one attribute that is a number begins and changes.

    Attributes:
        mean, sd: drawn anew it is N(mean, sd).
        shift_rate: chance of a shift.
        replace_rate: chance of being drawn anew.
        power: a shift is N(0, power).
        low, high: the value never leaves [low, high].
    """

    mean: float
    sd: float
    shift_rate: float
    replace_rate: float
    power: float
    low: float
    high: float


@compiled
def draw(number: Number, rng: Generator) -> float:
    """A new value."""
    return _within(number, number.mean + number.sd * rng.standard_normal())  # type: ignore[no-any-return]


@compiled
def mutate_attributes(
    genes: Genes, numbers: tuple[Number, Number, Number], disable_rate: float, enable_rate: float, rng: Generator
) -> None:
    """Change weights, enabled flags, biases and responses in place: each is shifted, drawn anew or left.

    Args:
        genes: of one genome.
        numbers: how weights, biases and responses change.
        disable_rate: chance that an enabled connection's flag is drawn anew, either way with equal chance.
        enable_rate: the same of a disabled connection.
        rng: of all draws.
    """
    (nodes, connections), (weight, bias, response) = genes, numbers
    for i in range(connections.size):
        connections[i].weight = _mutated(connections[i].weight, weight, rng)
        if rng.random() < (disable_rate if connections[i].enabled else enable_rate):
            connections[i].enabled = rng.random() < 0.5
    for i in range(nodes.size):
        nodes[i].bias = _mutated(nodes[i].bias, bias, rng)
        nodes[i].response = _mutated(nodes[i].response, response, rng)


@compiled
def _mutated(value, number, rng):  # type: ignore[no-untyped-def]
    if number.shift_rate + number.replace_rate <= 0.0:
        return value
    chance = rng.random()
    if chance < number.shift_rate:
        return _within(number, value + number.power * rng.standard_normal())
    if chance < number.shift_rate + number.replace_rate:
        return draw(number, rng)
    return value


@compiled
def _within(number, value):  # type: ignore[no-untyped-def]
    return max(min(value, number.high), number.low)
