"""Crossover: which genes a child gets, and how often what of whom, compared with neat-python's."""

from __future__ import annotations

import random
from collections import Counter
from typing import Any

import neat
import numpy as np
import pytest

from exneat_cli.algorithms import ACTIVATIONS, ArrayGenome, EvolutionSettings, to_stock
from tests.algorithms.neat.genomes import (
    assert_equal,
    assert_same_frequencies,
    assert_sound,
    copy_of,
    genome_of,
    lively,
    pairs_of,
    relatives,
    seeded_config,
)

SHAPE = (3, 2, 2)
FITTER = genome_of(
    [(0, 1.0, 0.1, 0), (1, 2.0, 0.2, 0), (5, 3.0, 0.3, 0)],
    [(0, -1, 1, 1.0, True), (0, 5, 7, 2.0, False), (1, -1, 2, 3.0, True), (5, -2, 6, 4.0, True)],
    fitness=2.0,
)
OTHER = genome_of(
    [(0, -1.0, -0.1, 1), (1, -2.0, -0.2, 1), (2, -3.0, -0.3, 1), (6, -4.0, -0.4, 1)],
    [(0, -2, 9, -9.0, True), (1, -1, 2, -3.0, True), (1, 2, 3, -5.0, True), (6, -1, 8, -6.0, False)],
    fitness=1.0,
)


@pytest.fixture
def config(ant_settings: EvolutionSettings) -> Any:
    return seeded_config(ant_settings, SHAPE, 0).genome_config


def child_of(one: ArrayGenome, other: ArrayGenome, config: Any) -> ArrayGenome:
    child = ArrayGenome(9)
    child.configure_crossover(one, other, config)
    return child


def test_a_child_has_the_genes_of_the_fitter_parent_in_either_order(config: Any) -> None:
    for parents in ((FITTER, OTHER), (OTHER, FITTER)):
        child = child_of(*parents, config)
        assert child.nodes["key"].tolist() == [0, 1, 5]
        for name in ("target", "source", "innovation"):
            assert child.connections[name].tolist() == FITTER.connections[name].tolist()


def test_matching_genes_mix_attribute_by_attribute_and_all_others_stay_as_they_are(config: Any) -> None:
    seen: dict[str, set[object]] = {"nodes": set(), "weight": set()}
    for _ in range(200):
        child = child_of(FITTER, OTHER, config)
        # Disjoint and excess genes, the disabled one among them; the weight of the only match is of either parent.
        rows = [row for row in range(4) if row != 2]
        assert child.connections[rows].tolist() == FITTER.connections[rows].tolist()
        assert child.nodes[2].item() == FITTER.nodes[2].item()
        assert child.connections["enabled"][2]
        seen["weight"].add(child.connections["weight"][2])
        seen["nodes"].add(child.nodes[1].item())
    assert seen["weight"] == {3.0, -3.0}
    assert seen["nodes"] == {(1, bias, response, a) for bias in (2, -2) for response in (0.2, -0.2) for a in (0, 1)}


@pytest.mark.parametrize("disabled", [False, True])
def test_a_connection_that_began_twice_comes_unchanged_from_the_fitter_parent(config: Any, disabled: bool) -> None:
    other = genome_of(
        [(0, 0.0, 1.0, 0)], [(0, -1, 21, 7.0, False), (1, -1, 22, 8.0, not disabled), (5, -2, 23, 9.0, False)]
    )
    other.fitness = 1.0
    fitter = copy_of(FITTER)
    fitter.connections["enabled"][2] = not disabled
    for _ in range(50):
        np.testing.assert_array_equal(child_of(fitter, other, config).connections, fitter.connections)


def test_of_equally_fit_parents_the_second_counts_as_fitter(config: Any) -> None:
    one, other = copy_of(FITTER), copy_of(OTHER)
    one.fitness = other.fitness = 3.0
    assert pairs_of(child_of(one, other, config)) == pairs_of(other)
    assert pairs_of(child_of(other, one, config)) == pairs_of(one)


def test_a_genome_crossed_with_itself_gives_its_genes_and_a_disabled_one_stays_disabled(config: Any) -> None:
    for _ in range(20):
        child = child_of(FITTER, FITTER, config)
        child.key, child.fitness = FITTER.key, FITTER.fitness
        assert_equal(child, FITTER)


def test_crossover_leaves_both_parents_as_they_were(config: Any) -> None:
    fitter, other = copy_of(FITTER), copy_of(OTHER)
    child = child_of(fitter, other, config)
    child.mutate(config)
    assert_equal(fitter, FITTER)
    assert_equal(other, OTHER)


def test_children_of_relatives_have_the_keys_that_neat_pythons_children_have(grid_settings: EvolutionSettings) -> None:
    config = seeded_config(lively(grid_settings), SHAPE, 4)
    genomes = relatives(config, 20, 300)
    for _ in range(200):
        one, other = random.choices(genomes, k=2)
        one.fitness, other.fitness = random.choices((0.0, 1.0), k=2)
        child, theirs = child_of(one, other, config.genome_config), neat.DefaultGenome(9)
        theirs.configure_crossover(to_stock(one), to_stock(other), config.genome_config)
        assert_sound(child)
        assert set(child.nodes["key"].tolist()) == set(theirs.nodes)
        ours = {(source, target): number for target, source, number, _, _ in child.connections.tolist()}
        assert ours == {key: gene.innovation for key, gene in theirs.connections.items()}


def mirrored_parents(genes: int) -> tuple[ArrayGenome, ArrayGenome]:
    """Two genomes with the same genes, numbers of opposite sign, and all four combinations of flags."""
    nodes = [(key, 1.0, 1.0, 0) for key in range(genes)]
    connections = [(key, -1, key, 1.0, key % 4 < 2) for key in range(genes)]
    one, other = genome_of(nodes, connections, fitness=2.0), genome_of(nodes, connections, fitness=1.0)
    for name in ("bias", "response"):
        other.nodes[name] *= -1.0
    other.nodes["activation"] = 1
    other.connections["weight"] *= -1.0
    other.connections["enabled"] = np.arange(genes) % 2 == 0
    return one, other


def test_attributes_come_from_either_parent_as_often_as_in_neat_python(config: Any) -> None:
    """Jointly, so that attributes which were not drawn apart would show."""
    fitter, other = mirrored_parents(40)
    stock = to_stock(fitter), to_stock(other)
    nodes: tuple[Counter[Any], Counter[Any]] = (Counter(), Counter())
    flags: tuple[Counter[Any], Counter[Any]] = (Counter(), Counter())
    for _ in range(500):
        child, theirs = child_of(fitter, other, config), neat.DefaultGenome(9)
        theirs.configure_crossover(*stock, config)
        nodes[0].update(node[1:] for node in child.nodes.tolist())
        nodes[1].update((n.bias, n.response, ACTIVATIONS.index(n.activation)) for n in theirs.nodes.values())
        flags[0].update((target % 4, weight, enabled) for target, _, _, weight, enabled in child.connections.tolist())
        flags[1].update((key[1] % 4, gene.weight, gene.enabled) for key, gene in theirs.connections.items())
    assert len(nodes[0]) == 8
    assert_same_frequencies(*nodes)
    # Both enabled: never disabled; both disabled: always; else either.
    assert set(flags[0]) == set(flags[1])
    assert {(case, enabled) for case, _, enabled in flags[0]} == {
        (0, True),
        (1, True),
        (1, False),
        (2, True),
        (2, False),
        (3, False),
    }
    for case in range(4):
        assert_same_frequencies(*(Counter({k: n for k, n in flag.items() if k[0] == case}) for flag in flags))
