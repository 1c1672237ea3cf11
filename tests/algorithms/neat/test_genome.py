"""Initial genomes and structural mutations are like neat-python's."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from itertools import count
from typing import Any

import neat
import pytest

from exneat_cli.algorithms import RECURRENT, ArrayGenome, EvolutionSettings, to_stock
from exneat_cli.algorithms.neat.settings import INITIAL_CONNECTIONS
from tests.algorithms.neat.genomes import (
    COLUMNS,
    NO_ATTRIBUTES,
    NO_STRUCTURE,
    assert_same_distribution,
    assert_same_frequencies,
    assert_sound,
    copy_of,
    genome_of,
    initial_genomes,
    pairs_of,
    seeded_config,
)

INITIAL = [
    (kind, feed_forward, hidden) for kind in INITIAL_CONNECTIONS for feed_forward in (True, False) for hidden in (0, 3)
]


@pytest.mark.parametrize(("kind", "feed_forward", "hidden"), INITIAL)
def test_initial_genomes_have_neat_pythons_nodes_and_connections(kind: str, feed_forward: bool, hidden: int) -> None:
    settings, shape = EvolutionSettings(initial_connection=kind, feed_forward=feed_forward), (5, hidden, 2)
    number = 1000 if kind.startswith("fs_neat") else 2
    ours = initial_genomes(seeded_config(settings, shape, 0), number)
    theirs = initial_genomes(seeded_config(replace(settings, genome="stock"), shape, 0), number)
    assert [genome.nodes["key"].tolist() for genome in ours] == [sorted(genome.nodes) for genome in theirs]
    ends = (
        Counter(tuple(pairs_of(genome)) for genome in ours),
        Counter(tuple(sorted((target, source) for source, target in genome.connections)) for genome in theirs),
    )
    assert set(ends[0]) == set(ends[1])
    if kind.startswith("fs_neat"):
        assert [len({source for _, source in pairs}) for pairs in ends[0]] == [1] * 5
        assert_same_frequencies(*ends)
    # Homologous connections share an innovation, and no two connections share one.
    numbers = {(row[:2], row[2]) for genome in ours for row in genome.connections.tolist()}
    assert len({pair for pair, _ in numbers}) == len({innovation for _, innovation in numbers}) == len(numbers)
    for genome in ours:
        assert_sound(genome)
        assert genome.connections["enabled"].all()


@pytest.mark.parametrize("positive_start", [False, True])
@pytest.mark.parametrize("bound", [0.5, 30.0])
@pytest.mark.parametrize("means", [0.0, 0.25])
def test_initial_weights_biases_and_responses_are_distributed_as_neat_pythons(
    means: float, bound: float, positive_start: bool
) -> None:
    given = EvolutionSettings(
        positive_start=positive_start, weight_max_value=bound, bias_max_value=bound, weight_init_stdev=0.4
    )
    samples: dict[str, list[list[float]]] = {"weight": [], "bias": [], "response": []}
    for kind in ("array", "stock"):
        config = seeded_config(replace(given, genome=kind), (10, 5, 4), 1)
        config.genome_config.response_init_stdev = 0.25
        for name in samples:
            setattr(config.genome_config, f"{name}_init_mean", means)
        genomes = initial_genomes(config, 80)
        for name, sample in samples.items():
            table = "connections" if name == "weight" else "nodes"
            if kind == "array":
                sample.append([value for genome in genomes for value in getattr(genome, table)[name].tolist()])
            else:
                sample.append([getattr(g, name) for genome in genomes for g in getattr(genome, table).values()])
    for name, (ours, theirs) in samples.items():
        assert_same_distribution(ours, theirs)
        assert max(map(abs, ours)) <= (1.0 if name == "response" else bound)
    assert (min(samples["weight"][0]) >= 0.0) == (min(samples["weight"][1]) >= 0.0) == positive_start


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
State = tuple[set[int], dict[tuple[int, int], bool]]
"""Keys of nodes, and flags by (source, target)."""
BEFORE: State = (
    {0, 1, 2, 5},
    {(source, target): enabled for target, source, _, _, enabled in GENOME.connections.tolist()},
)


def config_of(settings: EvolutionSettings, **chances: float) -> Any:
    changed = replace(settings, **{**NO_STRUCTURE, **NO_ATTRIBUTES, **chances})  # type: ignore[arg-type]
    config = seeded_config(changed, (2, 2, 2), 0).genome_config
    config.node_indexer = count(6)
    config.innovation_tracker.global_counter = 100
    return config


def ours_after(config: Any) -> State:
    genome = copy_of(GENOME)
    genome.mutate(config)
    assert_sound(genome)
    flags = {(source, target): enabled for target, source, _, _, enabled in genome.connections.tolist()}
    return set(genome.nodes["key"].tolist()), flags


def theirs_after(config: Any) -> State:
    genome = to_stock(GENOME)
    genome.mutate(config)
    return set(genome.nodes), {key: gene.enabled for key, gene in genome.connections.items()}


def change(nodes: set[int], flags: dict[tuple[int, int], bool]) -> tuple[tuple[object, ...], ...]:
    """What is lost, new, cut, made and switched since `BEFORE`; a new node is called n whatever its key is."""

    def named(pair: tuple[int, int]) -> tuple[str, ...]:
        return tuple("n" if key > 5 else str(key) for key in pair)

    return (
        tuple(sorted(BEFORE[0] - nodes)),
        tuple("n" for _ in nodes - BEFORE[0]),
        tuple(sorted(BEFORE[1].keys() - flags)),
        tuple(sorted(named(pair) for pair in flags.keys() - BEFORE[1])),
        tuple(sorted(pair for pair in flags.keys() & BEFORE[1] if flags[pair] != BEFORE[1][pair])),
    )


def outcomes(after: Callable[[Any], State], config: Any, mutations: int) -> Counter[tuple[tuple[object, ...], ...]]:
    return Counter(change(*after(config)) for _ in range(mutations))


@pytest.mark.parametrize("column", COLUMNS)
@pytest.mark.parametrize(
    ("kind", "number"),
    [("node_add_prob", 6), ("node_delete_prob", 2), ("conn_add_prob", None), ("conn_delete_prob", 6)],
)
def test_every_kind_of_mutation_meets_the_genes_that_neat_pythons_meets(
    column: str, kind: str, number: int | None
) -> None:
    config = config_of(COLUMNS[column], **{kind: 1.0})
    ours, theirs = (outcomes(after, config, MUTATIONS) for after in (ours_after, theirs_after))
    # Free pairs are 16 - 6; feed-forward forbids two of a node with itself and one that closes a cycle; or nothing.
    assert len(ours) == (number or (8 if COLUMNS[column].feed_forward else 11))
    assert set(ours) == set(theirs)
    assert_same_frequencies(ours, theirs)


@pytest.mark.parametrize("column", COLUMNS)
def test_the_kinds_of_mutation_come_together_as_often_as_neat_pythons(column: str) -> None:
    chances = {"node_add_prob": 0.5, "node_delete_prob": 0.3, "conn_add_prob": 0.7, "conn_delete_prob": 0.4}
    config = config_of(COLUMNS[column], **chances)
    counts: list[Counter[object]] = []
    for after in (ours_after, theirs_after):
        counts.append(Counter())
        for outcome, times in outcomes(after, config, 2 * MUTATIONS).items():
            counts[-1][tuple(map(len, outcome[:4]))] += times
    assert len(counts[0]) > 20
    assert_same_frequencies(*counts)


def test_a_split_keeps_the_weight_behind_the_new_node_and_disables_the_old_connection() -> None:
    config = config_of(EvolutionSettings(), node_add_prob=1.0)
    config.response_init_stdev, config.response_max_value = 0.25, 3.0
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
def test_a_genome_without_connections_and_hidden_nodes_only_gains_connections(genome_type: type[Any]) -> None:
    config = config_of(EvolutionSettings(), node_add_prob=1.0, node_delete_prob=1.0, conn_delete_prob=1.0)
    bare = genome_of([(0, 0.1, 1.0, 0), (1, 0.2, 1.0, 0)], [])
    genome = bare if genome_type is ArrayGenome else to_stock(bare)
    for _ in range(20):
        genome.mutate(config)
        assert (len(genome.nodes), len(genome.connections)) == (2, 0)
    config.conn_add_prob, config.conn_delete_prob, config.node_add_prob = 1.0, 0.0, 0.0
    for _ in range(200):
        genome.mutate(config)
    assert (len(genome.nodes), len(genome.connections)) == (2, 4)


def test_a_new_connection_has_neat_pythons_weight_and_an_innovation_of_its_generation() -> None:
    config = config_of(RECURRENT, conn_add_prob=1.0)
    config.weight_init_mean, config.weight_min_value = 0.5, -0.75
    ours, theirs, numbers = [], [], []
    for _ in range(2):
        config.innovation_tracker.reset_generation()
        found: dict[tuple[int, int], int] = {}
        for _ in range(MUTATIONS // 2):
            genome, stock = copy_of(GENOME), to_stock(GENOME)
            genome.mutate(config)
            stock.mutate(config)
            for target, source, innovation, weight, _ in set(genome.connections.tolist()) - set(
                GENOME.connections.tolist()
            ):
                assert found.setdefault((target, source), innovation) == innovation
                ours.append(weight)
            theirs += [gene.weight for key, gene in stock.connections.items() if key not in BEFORE[1]]
        numbers.append(found)
    assert_same_distribution(ours, theirs)
    assert min(ours) == -0.75
    assert len(numbers[0]) == len(set(numbers[0].values())) == 10
    assert numbers[0].keys() == numbers[1].keys()
    assert set(numbers[0].values()).isdisjoint(numbers[1].values())
