"""Compiled mutation of the attributes of genes.

Source: Stanley and Miikkulainen, "Evolving neural networks through augmenting topologies" (2002), section 3.1,
in neat-python's form: a value is shifted, drawn anew or left, each with a chance of its own.
"""

from __future__ import annotations

from typing import NamedTuple

from numpy.random import Generator

from exneat_cli.algorithms.neat.genes import Connections, Nodes
from exneat_cli.compiling import compiled


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
    nodes: Nodes,
    connections: Connections,
    numbers: tuple[Number, Number, Number],
    disable_rate: float,
    enable_rate: float,
    rng: Generator,
) -> None:
    """Change weights, enabled flags, biases and responses in place.

    Args:
        nodes: (N,).
        connections: (C,).
        numbers: how weights, biases and responses change.
        disable_rate: chance that an enabled connection's flag is drawn anew, either way with equal chance.
        enable_rate: the same of a disabled connection.
        rng: of all draws.
    """
    weight, bias, response = numbers
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
