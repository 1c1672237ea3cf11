"""Genomes as plain data and back."""

from __future__ import annotations

import copy
import json
from typing import Any

import pytest

from exneat_cli.algorithms import EvolutionSettings, genome_from_data, genome_to_data, neat_config
from exneat_cli.algorithms.neat.subpopulation import Subpopulation
from exneat_cli.seeding import stream
from tests.algorithms.neat.genomes import assert_equal, assert_sound, genome_of

GENOME = genome_of(
    [(0, 0.5, 1.0, 0), (1, -0.5, 1.0, 1), (7, 0.0, 1.0, 2)],
    [(0, -1, 1, 2.0, True), (0, 7, 5, -1.0, False), (7, -2, 4, 0.25, True)],
)
NODE = genome_to_data(GENOME)["nodes"][0]
CONNECTION = genome_to_data(GENOME)["connections"][0]


def test_a_genome_survives_json_without_losing_a_bit(ant_settings: EvolutionSettings) -> None:
    settings = EvolutionSettings(**{**vars(ant_settings), "node_add_prob": 0.9, "conn_delete_prob": 0.5})
    subpopulation = Subpopulation(neat_config(settings, 20, (4, 3, 2)), stream(0, "evolution", 0))
    for _ in range(4):
        subpopulation.advance(dict.fromkeys(subpopulation.genomes, 0.0))
    for genome in subpopulation.genomes.values():
        data = genome_to_data(genome)
        back = genome_from_data(json.loads(json.dumps(data)))
        assert genome_to_data(back) == data
        genome.fitness = None
        assert_equal(back, genome)


def test_data_in_any_order_make_sorted_tables() -> None:
    data = genome_to_data(GENOME)
    shuffled = {**data, "nodes": data["nodes"][::-1], "connections": data["connections"][::-1]}
    assert_sound(genome_from_data(shuffled))
    assert genome_to_data(genome_from_data(shuffled)) == data


def test_damaged_genome_data_is_refused() -> None:
    with pytest.raises((KeyError, TypeError, ValueError)):
        genome_from_data({"id": 1, "nodes": [{"id": 0, "bias": "much"}], "connections": []})


@pytest.mark.parametrize(
    ("part", "index", "field", "value", "message"),
    [
        ("nodes", 0, "bias", float("nan"), "finite"),
        ("nodes", 1, "response", float("inf"), "finite"),
        ("connections", 2, "weight", float("-inf"), "finite"),
        ("nodes", 1, "id", 0, "different ids"),
        ("nodes", 1, "id", -3, "at least 0"),
        ("nodes", 2, "activation", "gauss", "gauss"),
        ("connections", 1, "from", 8, "from 8 to 0"),
        ("connections", 1, "to", 3, "from 7 to 3"),
        ("connections", 1, "to", -1, "from 7 to -1"),
        ("connections", 1, "from", -1, "at most one connection"),
        ("connections", 1, "from", -(2**63) - 1, "too large|too big|out of bounds"),
        ("connections", 1, "innovation", 2**63, "too large|too big|out of bounds"),
        ("nodes", 1, "id", 2**63, "too large|too big|out of bounds"),
    ],
)
def test_a_value_that_no_genome_can_have_is_refused(
    part: str, index: int, field: str, value: object, message: str
) -> None:
    data: dict[str, Any] = copy.deepcopy(genome_to_data(GENOME))
    data[part][index][field] = value
    with pytest.raises((ValueError, OverflowError), match=message):
        genome_from_data(data)


@pytest.mark.parametrize(
    ("part", "field", "value"),
    [
        ("nodes", "id", 0.5),
        ("nodes", "bias", "1"),
        ("connections", "from", "-1"),
        ("connections", "innovation", 1.0),
        ("connections", "enabled", "no"),
        ("connections", "enabled", 1),
    ],
)
def test_a_value_of_the_wrong_type_is_refused(part: str, field: str, value: object) -> None:
    data: dict[str, Any] = copy.deepcopy(genome_to_data(GENOME))
    data[part][0][field] = value
    with pytest.raises(TypeError):
        genome_from_data(data)


@pytest.mark.parametrize(("part", "entry"), [("nodes", NODE), ("connections", CONNECTION)])
def test_a_gene_that_comes_twice_is_refused(part: str, entry: dict[str, Any]) -> None:
    data = genome_to_data(GENOME)
    data[part].append(dict(entry))
    with pytest.raises(ValueError, match=r"different ids|at most one connection"):
        genome_from_data(data)


@pytest.mark.parametrize(("part", "entry"), [("nodes", NODE), ("connections", CONNECTION)])
def test_a_gene_that_lacks_a_field_is_refused(part: str, entry: dict[str, Any]) -> None:
    for field in entry:
        data = copy.deepcopy(genome_to_data(GENOME))
        del data[part][0][field]
        with pytest.raises(KeyError, match=field):
            genome_from_data(data)
