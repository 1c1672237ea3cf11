"""Genomes as plain data and back."""

from __future__ import annotations

import json

import pytest

from exneat_cli.evolution import EvolutionSettings, genome_from_data, genome_to_data, neat_config
from exneat_cli.evolution.subpopulation import Subpopulation
from exneat_cli.seeding import stream


def test_a_genome_survives_json_without_losing_a_bit(ant_settings: EvolutionSettings) -> None:
    settings = EvolutionSettings(**{**vars(ant_settings), "node_add": 0.9, "connection_delete": 0.5})
    subpopulation = Subpopulation(neat_config(settings, 20, (4, 3, 2)), stream(0, "evolution", 0))
    for _ in range(4):
        subpopulation.advance(dict.fromkeys(subpopulation.genomes, 0.0))
    for genome in subpopulation.genomes.values():
        data = genome_to_data(genome)
        assert genome_to_data(genome_from_data(json.loads(json.dumps(data)))) == data


def test_damaged_genome_data_is_refused() -> None:
    with pytest.raises((KeyError, TypeError, ValueError)):
        genome_from_data({"id": 1, "nodes": [{"id": 0, "bias": "much"}], "connections": []})
