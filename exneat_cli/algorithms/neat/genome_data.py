"""Genomes as plain data: what a champion file holds, readable without exneat."""

from __future__ import annotations

import math
from operator import index
from typing import Any

import numpy as np

from exneat_cli.algorithms.neat.genes import ACTIVATIONS, CONNECTION, NODE
from exneat_cli.algorithms.neat.genome import ArrayGenome
from exneat_cli.algorithms.neat.soundness import check_genes


def genome_to_data(genome: ArrayGenome) -> dict[str, Any]:
    """The genome as numbers, strings, lists and dicts."""
    return {
        "id": genome.key,
        "nodes": [
            {"id": key, "bias": bias, "response": response, "activation": ACTIVATIONS[activation]}
            for key, bias, response, activation in genome.nodes.tolist()
        ],
        "connections": [
            {"from": source, "to": target, "weight": weight, "enabled": enabled, "innovation": innovation}
            for target, source, innovation, weight, enabled in genome.connections.tolist()
        ],
    }


def genome_from_data(data: dict[str, Any]) -> ArrayGenome:
    """The genome that `genome_to_data` was given.

    Raises:
        KeyError, OverflowError, TypeError, ValueError: a field is missing, of the wrong type or not finite; a node
            or connection comes twice; a connection leads from or to a node that does not exist.
    """
    genome = ArrayGenome(index(data["id"]))
    nodes = [
        (
            index(entry["id"]),
            _finite(entry["bias"]),
            _finite(entry["response"]),
            _activation(entry["activation"]),
        )
        for entry in data["nodes"]
    ]
    connections = [
        (
            index(entry["to"]),
            index(entry["from"]),
            index(entry["innovation"]),
            _finite(entry["weight"]),
            _flag(entry["enabled"]),
        )
        for entry in data["connections"]
    ]
    genome.nodes = np.array(sorted(nodes), NODE)
    genome.connections = np.array(sorted(connections), CONNECTION)
    check_genes(genome.key, genome.nodes, genome.connections)
    return genome


def _activation(name: object) -> int:
    if name not in ACTIVATIONS:
        raise ValueError(f"expected an activation of {', '.join(ACTIVATIONS)}, got {name!r}")
    return ACTIVATIONS.index(name)


def _flag(value: object) -> bool:
    if not isinstance(value, bool):
        raise TypeError(f"expected true or false, got {value!r}")
    return value


def _finite(value: float) -> float:
    if not math.isfinite(value):
        raise ValueError(f"expected a finite number, got {value!r}")
    return float(value)
