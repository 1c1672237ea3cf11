"""Structural mutations happen as often, and to the same genes, as neat-python's."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from itertools import count
from typing import Any

import neat
import pytest

from exneat_cli.algorithms import ArrayGenome, EvolutionSettings, to_stock
from tests.algorithms.neat.genomes import (
    NO_ATTRIBUTES,
    NO_STRUCTURE,
    assert_same_distribution,
    assert_same_frequencies,
    assert_sound,
    copy_of,
    genome_of,
    seeded_config,
)

SHAPE = (2, 2, 2)
MUTATIONS = 2500
GENOME = genome_of(
    [(0, 0.1, 1.0, 0), (1, 0.2, 1.0, 0), (2, 0.3, 1.0, 0), (5, 0.4, 1.0, 0)],
    [
        (0, -1, 1, 0.5, True),
        (0, 2, 2, 1.5, True),
        (1, 2, 3, 2.5, False),
        (1, 5, 4, 3.5, True),
        (2, -2, 5, 4.5, True),
        (5, 2, 6, 5.5, True),
    ],
)
"""Acyclic; one hidden node leads to the other, one connection is disabled, two thirds of all pairs are free."""


def config_of(settings: EvolutionSettings, **chances: float) -> Any:
    changed = replace(settings, **{**NO_STRUCTURE, **NO_ATTRIBUTES, **chances})  # type: ignore[arg-type]
    config = seeded_config(changed, SHAPE, 0).genome_config
    config.node_indexer = count(6)
    config.innovation_tracker.global_counter = 100
    return config


def ours_after(config: Any) -> tuple[set[int], dict[tuple[int, int], bool]]:
    """Keys of nodes, and flags by (source, target), after one of our mutations."""
    genome = copy_of(GENOME)
    genome.mutate(config)
    assert_sound(genome)
    flags = {(source, target): enabled for target, source, _, _, enabled in genome.connections.tolist()}
    return set(genome.nodes["key"].tolist()), flags


def theirs_after(config: Any) -> tuple[set[int], dict[tuple[int, int], bool]]:
    """The same after one of neat-python's."""
    genome = to_stock(GENOME)
    genome.mutate(config)
    return set(genome.nodes), {key: gene.enabled for key, gene in genome.connections.items()}


BEFORE = ({0, 1, 2, 5}, {(source, target): enabled for target, source, _, _, enabled in GENOME.connections.tolist()})


def change(nodes: set[int], flags: dict[tuple[int, int], bool]) -> tuple[object, ...]:
    """What differs from `BEFORE`; a new node is called n whatever its key is."""

    def named(pair: tuple[int, int]) -> tuple[str, ...]:
        return tuple("n" if key > 5 else str(key) for key in pair)

    return (
        tuple(sorted(BEFORE[0] - nodes)),
        len(nodes - BEFORE[0]),
        tuple(sorted(BEFORE[1].keys() - flags)),
        tuple(sorted(named(pair) for pair in flags.keys() - BEFORE[1])),
        tuple(sorted(pair for pair in flags.keys() & BEFORE[1] if flags[pair] != BEFORE[1][pair])),
    )


@pytest.mark.parametrize("column", ["ant", "grid"])
@pytest.mark.parametrize(
    ("kind", "outcomes"),
    [("node_add_prob", 6), ("node_delete_prob", 2), ("conn_add_prob", None), ("conn_delete_prob", 6)],
)
def test_every_kind_of_mutation_meets_the_genes_that_neat_pythons_meets(
    request: pytest.FixtureRequest, column: str, kind: str, outcomes: int | None
) -> None:
    settings: EvolutionSettings = request.getfixturevalue(f"{column}_settings")
    config = config_of(settings, **{kind: 1.0})
    ours = Counter(change(*ours_after(config)) for _ in range(MUTATIONS))
    theirs = Counter(change(*theirs_after(config)) for _ in range(MUTATIONS))
    # Free pairs are 16 - 6; feed-forward forbids two of a node with itself and one that closes a cycle; or nothing.
    assert len(ours) == (outcomes or (8 if settings.feed_forward else 11))
    assert set(ours) == set(theirs)
    assert_same_frequencies(ours, theirs)


@pytest.mark.parametrize("column", ["ant", "grid"])
def test_the_kinds_of_mutation_come_together_as_often_as_neat_pythons(
    request: pytest.FixtureRequest, column: str
) -> None:
    chances = {"node_add_prob": 0.5, "node_delete_prob": 0.3, "conn_add_prob": 0.7, "conn_delete_prob": 0.4}
    config = config_of(request.getfixturevalue(f"{column}_settings"), **chances)

    def kinds(nodes: set[int], flags: dict[tuple[int, int], bool]) -> tuple[int, ...]:
        lost, new, cut, made, _ = change(nodes, flags)
        return len(lost), new, len(cut), len(made)  # type: ignore[arg-type, return-value]

    ours = Counter(kinds(*ours_after(config)) for _ in range(2 * MUTATIONS))
    theirs = Counter(kinds(*theirs_after(config)) for _ in range(2 * MUTATIONS))
    assert len(ours) > 20
    assert_same_frequencies(ours, theirs)


@pytest.mark.parametrize("chance", [0.0, 1.0])
def test_chances_of_zero_and_one_mean_never_and_always(ant_settings: EvolutionSettings, chance: float) -> None:
    config = config_of(ant_settings, node_add_prob=chance)
    assert [len(ours_after(config)[0]) for _ in range(50)] == [4 + int(chance)] * 50


def test_a_split_keeps_the_weight_behind_the_new_node_and_disables_the_old_connection(
    ant_settings: EvolutionSettings,
) -> None:
    config = config_of(ant_settings, node_add_prob=1.0)
    config.response_init_stdev = 0.25
    config.response_max_value = 3.0
    responses = []
    for split in range(60):
        genome = copy_of(GENOME)
        genome.mutate(config)
        key, bias, response, activation = genome.nodes[-1].item()
        assert (key, bias, activation) == (6 + split, 0.0, 0)
        (into,) = genome.connections[genome.connections["target"] == key].tolist()
        (out,) = genome.connections[genome.connections["source"] == key].tolist()
        (old,) = [row for row in GENOME.connections.tolist() if row[:2] == (out[0], into[1])]
        assert into == (key, old[1], 101 + 2 * split, 1.0, True)
        assert out == (old[0], key, 102 + 2 * split, old[3], True)
        assert (*old[:4], False) in genome.connections.tolist()
        responses.append(response)
    theirs = [neat.DefaultGenome.create_node(config, 1).response for _ in range(1000)]
    assert_same_distribution(responses, theirs)


@pytest.mark.parametrize("genome_type", [ArrayGenome, neat.DefaultGenome])
def test_a_genome_without_connections_and_hidden_nodes_only_gains_connections(
    ant_settings: EvolutionSettings, genome_type: type[Any]
) -> None:
    config = config_of(ant_settings, node_add_prob=1.0, node_delete_prob=1.0, conn_delete_prob=1.0)
    bare = genome_of([(0, 0.1, 1.0, 0), (1, 0.2, 1.0, 0)], [])
    genome = bare if genome_type is ArrayGenome else to_stock(bare)
    for _ in range(20):
        genome.mutate(config)
        assert (len(genome.nodes), len(genome.connections)) == (2, 0)
    config.conn_add_prob, config.conn_delete_prob, config.node_add_prob = 1.0, 0.0, 0.0
    for _ in range(200):
        genome.mutate(config)
    assert (len(genome.nodes), len(genome.connections)) == (2, 4)


def test_the_same_connection_made_twice_in_a_generation_has_one_innovation_and_later_another(
    grid_settings: EvolutionSettings,
) -> None:
    config = config_of(grid_settings, conn_add_prob=1.0)
    numbers: list[dict[tuple[int, int], int]] = []
    for _ in range(2):
        config.innovation_tracker.reset_generation()
        found: dict[tuple[int, int], int] = {}
        for _ in range(200):
            genome = copy_of(GENOME)
            genome.mutate(config)
            new = set(genome.connections.tolist()) - set(GENOME.connections.tolist())
            for target, source, innovation, _, _ in new:
                assert found.setdefault((target, source), innovation) == innovation
        numbers.append(found)
    assert len(numbers[0]) == len(set(numbers[0].values())) == 10
    assert numbers[0].keys() == numbers[1].keys()
    assert set(numbers[0].values()).isdisjoint(numbers[1].values())


def test_new_connections_have_neat_pythons_weights(grid_settings: EvolutionSettings) -> None:
    config = config_of(grid_settings, conn_add_prob=1.0)
    config.weight_init_mean, config.weight_min_value = 0.5, -0.75
    old = set(BEFORE[1])
    ours, theirs = [], []
    for _ in range(MUTATIONS):
        genome, stock = copy_of(GENOME), to_stock(GENOME)
        genome.mutate(config)
        stock.mutate(config)
        ours += [row[3] for row in genome.connections.tolist() if (row[1], row[0]) not in old]
        theirs += [gene.weight for key, gene in stock.connections.items() if key not in old]
    assert_same_distribution(ours, theirs)
    assert min(ours) == -0.75
