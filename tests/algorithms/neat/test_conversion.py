"""Between array genomes and neat-python's own nothing is lost, and what does not fit is refused."""

from __future__ import annotations

from typing import Any

import neat
import pytest

from exneat_cli.algorithms import EvolutionSettings, from_stock, to_stock
from exneat_cli.errors import ExneatError
from tests.algorithms.neat.genomes import COLUMNS, assert_equal, initial_genomes, lively, relatives, seeded_config

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


@pytest.mark.parametrize("column", COLUMNS)
def test_genomes_come_back_from_the_other_kind_as_they_were(column: str) -> None:
    settings = lively(COLUMNS[column], genome="stock")
    genomes = relatives(seeded_config(settings, SHAPE, 1), 30, 300)
    assert {genome.fitness is None for genome in genomes} == {True, False}
    assert any(not gene.enabled for genome in genomes for gene in genome.connections.values())
    for genome in genomes:
        back = to_stock(from_stock(genome))
        assert contents(back) == contents(genome)
        assert_equal(from_stock(back), from_stock(genome))


@pytest.mark.parametrize(
    ("attribute", "value"), [("aggregation", "product"), ("time_constant", 0.5), ("activation", "gauss")]
)
def test_a_node_that_arrays_cannot_hold_is_refused_by_its_key(attribute: str, value: object) -> None:
    (genome,) = initial_genomes(seeded_config(EvolutionSettings(genome="stock"), SHAPE, 0), 1)
    setattr(genome.nodes[3], attribute, value)
    with pytest.raises(ExneatError, match=f"node 3: .*{value}"):
        from_stock(genome)


def test_both_kinds_of_genome_count_their_nodes_and_enabled_connections_alike() -> None:
    genomes = relatives(seeded_config(lively(EvolutionSettings()), SHAPE, 2), 20, 200)
    assert len({genome.size() for genome in genomes}) > 5
    assert [genome.size() for genome in genomes] == [to_stock(genome).size() for genome in genomes]
