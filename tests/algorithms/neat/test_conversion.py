"""Between array genomes and neat-python's own nothing is lost, and what does not fit is refused."""

from __future__ import annotations

from typing import Any

import neat
import pytest

from exneat_cli.algorithms import EvolutionSettings, from_stock, to_stock
from exneat_cli.algorithms.neat.stock_genome import HomologousGenome
from exneat_cli.errors import ExneatError
from tests.algorithms.neat.genomes import assert_equal, initial_genomes, lively, relatives, seeded_config

SHAPE = (3, 2, 2)
NODE_ATTRIBUTES = ("key", "bias", "response", "activation", "aggregation", "time_constant")
CONNECTION_ATTRIBUTES = ("key", "innovation", "weight", "enabled")


def contents(genome: neat.DefaultGenome) -> dict[str, Any]:
    """Every attribute, with its type."""

    def typed(gene: Any, names: tuple[str, ...]) -> list[tuple[str, type[Any], Any]]:
        return [(name, type(getattr(gene, name)), getattr(gene, name)) for name in names]

    return {
        "genome": (genome.key, genome.fitness),
        "nodes": {key: typed(gene, NODE_ATTRIBUTES) for key, gene in genome.nodes.items()},
        "connections": {key: typed(gene, CONNECTION_ATTRIBUTES) for key, gene in genome.connections.items()},
    }


@pytest.mark.parametrize("column", ["ant", "grid"])
def test_neat_pythons_genomes_come_back_from_arrays_as_they_were(request: pytest.FixtureRequest, column: str) -> None:
    settings: EvolutionSettings = request.getfixturevalue(f"{column}_settings")
    genomes = relatives(seeded_config(lively(settings), SHAPE, 1, HomologousGenome), 30, 300)
    assert any(genome.fitness is None for genome in genomes)
    assert any(genome.fitness is not None for genome in genomes)
    assert any(not gene.enabled for genome in genomes for gene in genome.connections.values())
    for genome in genomes:
        assert contents(to_stock(from_stock(genome))) == contents(genome)


@pytest.mark.parametrize("column", ["ant", "grid"])
def test_array_genomes_come_back_from_neat_pythons_as_they_were(request: pytest.FixtureRequest, column: str) -> None:
    settings: EvolutionSettings = request.getfixturevalue(f"{column}_settings")
    for genome in relatives(seeded_config(lively(settings), SHAPE, 1), 30, 300):
        assert_equal(from_stock(to_stock(genome)), genome)


@pytest.mark.parametrize(
    ("attribute", "value"), [("aggregation", "product"), ("time_constant", 0.5), ("activation", "gauss")]
)
def test_a_node_that_arrays_cannot_hold_is_refused_by_its_key(
    ant_settings: EvolutionSettings, attribute: str, value: object
) -> None:
    (genome,) = initial_genomes(seeded_config(ant_settings, SHAPE, 0, HomologousGenome), 1)
    setattr(genome.nodes[3], attribute, value)
    with pytest.raises(ExneatError, match=f"node 3: .*{value}"):
        from_stock(genome)


def test_both_kinds_of_genome_count_their_nodes_and_enabled_connections_alike(ant_settings: EvolutionSettings) -> None:
    genomes = relatives(seeded_config(lively(ant_settings), SHAPE, 2), 20, 200)
    assert len({genome.size() for genome in genomes}) > 5
    assert [genome.size() for genome in genomes] == [to_stock(genome).size() for genome in genomes]
