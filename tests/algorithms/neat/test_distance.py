"""The compiled genetic distance is neat-python's."""

from __future__ import annotations

import random

import neat
import numpy as np
import pytest

from exneat_cli.algorithms import ACTIVATIONS, ArrayGenome, EvolutionSettings, from_stock, to_stock
from exneat_cli.algorithms.neat.stock_genome import HomologousGenome
from tests.algorithms.neat.genomes import genome_of, lively, relatives, seeded_config

SHAPE = (3, 2, 2)


def varied_genomes(settings: EvolutionSettings, genome_type: type[object]) -> tuple[list[ArrayGenome], neat.Config]:
    """Genomes that differ in everything that the distance looks at."""
    config = seeded_config(lively(settings), SHAPE, 3, genome_type)
    genomes = relatives(config, 60, 900)
    arrays = [genome if isinstance(genome, ArrayGenome) else from_stock(genome) for genome in genomes]
    rng = np.random.default_rng(0)
    for genome in arrays:
        genome.nodes["activation"] = rng.integers(len(ACTIVATIONS), size=genome.nodes.size)
        genome.nodes["response"] += rng.choice([0.0, 0.25, -0.5], size=genome.nodes.size)
    return arrays, config


@pytest.mark.parametrize("genome_type", [ArrayGenome, HomologousGenome])
@pytest.mark.parametrize("column", ["ant", "grid"])
def test_the_distance_of_a_thousand_pairs_is_neat_pythons(
    request: pytest.FixtureRequest, column: str, genome_type: type[object]
) -> None:
    genomes, config = varied_genomes(request.getfixturevalue(f"{column}_settings"), genome_type)
    assert len({genome.nodes.size for genome in genomes}) > 3
    assert len({genome.connections.size for genome in genomes}) > 5
    assert any(not genome.connections["enabled"].all() for genome in genomes)
    for _ in range(1000):
        one, other = random.choices(genomes, k=2)
        expected = to_stock(one).distance(to_stock(other), config.genome_config)
        assert one.distance(other, config.genome_config) == pytest.approx(expected, rel=1e-12, abs=1e-14)
        again = from_stock(to_stock(one)).distance(from_stock(to_stock(other)), config.genome_config)
        assert again == one.distance(other, config.genome_config)


@pytest.mark.parametrize("column", ["ant", "grid"])
def test_the_distance_is_symmetric_zero_to_itself_and_above_zero_to_others(
    request: pytest.FixtureRequest, column: str
) -> None:
    genomes, config = varied_genomes(request.getfixturevalue(f"{column}_settings"), ArrayGenome)
    for one in genomes:
        assert one.distance(one, config.genome_config) == 0.0
        for other in genomes:
            distance = one.distance(other, config.genome_config)
            assert distance == pytest.approx(other.distance(one, config.genome_config), rel=1e-12)
            assert one is other or distance > 0.0


def test_a_distance_reckoned_by_hand(ant_settings: EvolutionSettings) -> None:
    config = seeded_config(ant_settings, SHAPE, 0).genome_config
    config.compatibility_disjoint_coefficient, config.compatibility_weight_coefficient = 1.5, 0.5
    one = genome_of(
        [(0, 1.0, 1.0, 0), (1, 0.0, 1.0, 0), (4, 0.0, 1.0, 0)],
        [(0, -1, 1, 2.0, True), (0, 4, 2, 1.0, True), (1, -1, 3, 0.0, True), (4, -2, 4, 1.0, True)],
    )
    other = genome_of(
        [(0, -1.0, 0.5, 1), (1, 0.0, 1.0, 0)],
        [(0, -1, 9, 2.5, False), (0, 0, 8, 1.0, True)],
    )
    nodes = (0.5 * (2.0 + 0.5 + 1.0) + 1.5 * 1) / 3
    connections = (0.5 * (0.5 + 1.0) + 1.5 * (3 + 1)) / 4
    assert one.distance(other, config) == pytest.approx(nodes + connections, rel=1e-12)


def test_genomes_without_connections_differ_by_their_nodes_alone(ant_settings: EvolutionSettings) -> None:
    config = seeded_config(ant_settings, SHAPE, 0).genome_config
    one, other = genome_of([(0, 0.0, 1.0, 0)], []), genome_of([(0, 2.0, 1.0, 0)], [])
    assert one.distance(other, config) == pytest.approx(2.0 * 1.25)
    assert ArrayGenome(1).distance(ArrayGenome(2), config) == 0.0
