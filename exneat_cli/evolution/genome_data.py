"""Genomes as plain data: what a champion file holds, readable without exneat."""

from __future__ import annotations

from typing import Any

import neat
from neat.genes import DefaultConnectionGene, DefaultNodeGene

Genome = neat.DefaultGenome
"""What every room beyond this one knows of a genome's type."""


def genome_to_data(genome: neat.DefaultGenome) -> dict[str, Any]:
    """The genome as numbers, strings, lists and dicts; nodes and connections keep their order."""
    return {
        "id": genome.key,
        "nodes": [
            {"id": key, "bias": node.bias, "response": node.response, "activation": node.activation}
            for key, node in genome.nodes.items()
        ],
        "connections": [
            {
                "from": source,
                "to": target,
                "weight": gene.weight,
                "enabled": gene.enabled,
                "innovation": gene.innovation,
            }
            for (source, target), gene in genome.connections.items()
        ],
    }


def genome_from_data(data: dict[str, Any]) -> neat.DefaultGenome:
    """The genome that `genome_to_data` was given, equal in everything that a network depends on.

    Raises:
        KeyError, TypeError, ValueError: a field is missing or of the wrong type.
    """
    genome = neat.DefaultGenome(int(data["id"]))
    for entry in data["nodes"]:
        node = DefaultNodeGene(int(entry["id"]))
        node.bias = float(entry["bias"])
        node.response = float(entry["response"])
        node.activation = str(entry["activation"])
        node.aggregation = "sum"
        node.time_constant = 1.0
        genome.nodes[node.key] = node
    for entry in data["connections"]:
        key = int(entry["from"]), int(entry["to"])
        gene = DefaultConnectionGene(key, innovation=int(entry["innovation"]))
        gene.weight = float(entry["weight"])
        gene.enabled = bool(entry["enabled"])
        genome.connections[key] = gene
    return genome
