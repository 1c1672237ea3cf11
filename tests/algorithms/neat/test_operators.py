"""Crossover, genetic distance and mutation of attributes, compared with neat-python's own."""

from __future__ import annotations

import random
from collections import Counter
from dataclasses import replace
from typing import Any

import neat
import numpy as np
import pytest

from exneat_cli.algorithms import ACTIVATIONS, RECURRENT, ArrayGenome, EvolutionSettings, from_stock, to_stock
from exneat_cli.algorithms.neat.genes import draw
from exneat_cli.algorithms.neat.genome import number
from tests.algorithms.neat.genomes import (
    COLUMNS,
    NO_ATTRIBUTES,
    NO_STRUCTURE,
    assert_equal,
    assert_same_distribution,
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
def config() -> Any:
    return seeded_config(EvolutionSettings(), SHAPE, 0).genome_config


def crossed(one: ArrayGenome, other: ArrayGenome, config: Any) -> ArrayGenome:
    child = ArrayGenome(9)
    child.configure_crossover(one, other, config)
    return child


def test_a_child_has_the_genes_of_the_fitter_parent_in_either_order(config: Any) -> None:
    for parents in ((FITTER, OTHER), (OTHER, FITTER)):
        child = crossed(*parents, config)
        assert child.nodes["key"].tolist() == [0, 1, 5]
        for name in ("target", "source", "innovation"):
            assert child.connections[name].tolist() == FITTER.connections[name].tolist()


def test_matching_genes_mix_attribute_by_attribute_and_all_others_stay_as_they_are(config: Any) -> None:
    weights, nodes = set(), set()
    for _ in range(200):
        child = crossed(FITTER, OTHER, config)
        # Disjoint and excess genes, the disabled one among them; the weight of the only match is of either parent.
        rows = [row for row in range(4) if row != 2]
        assert child.connections[rows].tolist() == FITTER.connections[rows].tolist()
        assert child.nodes[2].item() == FITTER.nodes[2].item()
        assert child.connections["enabled"][2]
        weights.add(child.connections["weight"][2])
        nodes.add(child.nodes[1].item())
    assert weights == {3.0, -3.0}
    assert nodes == {(1, bias, response, a) for bias in (2, -2) for response in (0.2, -0.2) for a in (0, 1)}


@pytest.mark.parametrize("disabled", [False, True])
def test_a_connection_that_began_twice_comes_unchanged_from_the_fitter_parent(config: Any, disabled: bool) -> None:
    rows = [(0, -1, 21, 7.0, False), (1, -1, 22, 8.0, not disabled), (5, -2, 23, 9.0, False)]
    other, fitter = genome_of([(0, 0.0, 1.0, 0)], rows, fitness=1.0), copy_of(FITTER)
    fitter.connections["enabled"][2] = not disabled
    for _ in range(50):
        np.testing.assert_array_equal(crossed(fitter, other, config).connections, fitter.connections)


def test_of_equally_fit_parents_the_second_counts_as_fitter(config: Any) -> None:
    one, other = copy_of(FITTER), copy_of(OTHER)
    one.fitness = other.fitness = 3.0
    assert pairs_of(crossed(one, other, config)) == pairs_of(other)
    assert pairs_of(crossed(other, one, config)) == pairs_of(one)


def test_crossover_and_mutation_of_the_child_leave_both_parents_as_they_were(config: Any) -> None:
    fitter, other = copy_of(FITTER), copy_of(OTHER)
    crossed(fitter, other, config).mutate(config)
    assert_equal(fitter, FITTER)
    assert_equal(other, OTHER)


def test_children_of_relatives_have_the_keys_that_neat_pythons_children_have() -> None:
    config = seeded_config(lively(RECURRENT), SHAPE, 4)
    genomes = relatives(config, 20, 300)
    for _ in range(200):
        one, other = random.choices(genomes, k=2)
        one.fitness, other.fitness = random.choices((0.0, 1.0), k=2)
        child, theirs = crossed(one, other, config.genome_config), neat.DefaultGenome(9)
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
        child, theirs = crossed(fitter, other, config), neat.DefaultGenome(9)
        theirs.configure_crossover(*stock, config)
        nodes[0].update(node[1:] for node in child.nodes.tolist())
        nodes[1].update((n.bias, n.response, ACTIVATIONS.index(n.activation)) for n in theirs.nodes.values())
        flags[0].update((target % 4, weight, enabled) for target, _, _, weight, enabled in child.connections.tolist())
        flags[1].update((key[1] % 4, gene.weight, gene.enabled) for key, gene in theirs.connections.items())
    assert len(nodes[0]) == 8
    assert_same_frequencies(*nodes)
    # Both enabled: never disabled; both disabled: always; else either.
    assert set(flags[0]) == set(flags[1])
    never, always = {(0, False)}, {(3, True)}
    assert not {(case, enabled) for case, _, enabled in flags[0]} & (never | always)
    for case in range(4):
        assert_same_frequencies(*(Counter({k: n for k, n in flag.items() if k[0] == case}) for flag in flags))


def varied_genomes(settings: EvolutionSettings) -> tuple[list[ArrayGenome], neat.Config]:
    """Genomes that differ in everything that the distance looks at."""
    config = seeded_config(lively(settings), SHAPE, 3)
    arrays = [
        genome if isinstance(genome, ArrayGenome) else from_stock(genome) for genome in relatives(config, 60, 900)
    ]
    rng = np.random.default_rng(0)
    for genome in arrays:
        genome.nodes["activation"] = rng.integers(len(ACTIVATIONS), size=genome.nodes.size)
        genome.nodes["response"] += rng.choice([0.0, 0.25, -0.5], size=genome.nodes.size)
    return arrays, config


@pytest.mark.parametrize("genome", ["array", "stock"])
@pytest.mark.parametrize("column", COLUMNS)
def test_the_distance_of_a_thousand_pairs_is_neat_pythons_and_symmetric(column: str, genome: str) -> None:
    genomes, config = varied_genomes(replace(COLUMNS[column], genome=genome))
    assert len({genome.nodes.size for genome in genomes}) > 3
    assert len({genome.connections.size for genome in genomes}) > 5
    assert any(not genome.connections["enabled"].all() for genome in genomes)
    for _ in range(1000):
        one, other = random.choices(genomes, k=2)
        expected = to_stock(one).distance(to_stock(other), config.genome_config)
        distance = one.distance(other, config.genome_config)
        assert distance == pytest.approx(expected, rel=1e-12, abs=1e-14)
        assert distance == pytest.approx(other.distance(one, config.genome_config), rel=1e-12)
        assert (distance == 0.0) == (one is other)


def test_the_distance_is_that_of_a_case_worked_out_by_hand(config: Any) -> None:
    config.compatibility_disjoint_coefficient, config.compatibility_weight_coefficient = 1.5, 0.5
    one = genome_of(
        [(0, 1.0, 1.0, 0), (1, 0.0, 1.0, 0), (4, 0.0, 1.0, 0)],
        [(0, -1, 1, 2.0, True), (0, 4, 2, 1.0, True), (1, -1, 3, 0.0, True), (4, -2, 4, 1.0, True)],
    )
    other = genome_of([(0, -1.0, 0.5, 1), (1, 0.0, 1.0, 0)], [(0, -1, 9, 2.5, False), (0, 0, 8, 1.0, True)])
    nodes = (0.5 * (2.0 + 0.5 + 1.0) + 1.5 * 1) / 3
    connections = (0.5 * (0.5 + 1.0) + 1.5 * (3 + 1)) / 4
    assert one.distance(other, config) == pytest.approx(nodes + connections, rel=1e-12)
    assert ArrayGenome(1).distance(ArrayGenome(2), config) == 0.0


GENES = 200
REPEATS = 60
ALIKE = genome_of(
    [(key, 0.5, 0.5, 0) for key in range(GENES)], [(key, -1, key, 0.5, key % 2 == 0) for key in range(GENES)]
)


def config_of(**items: float) -> Any:
    """A configuration that changes no structure and only those attributes that the items name."""
    settings = EvolutionSettings(**{**NO_STRUCTURE, **NO_ATTRIBUTES})  # type: ignore[arg-type]
    config = seeded_config(settings, SHAPE, 0).genome_config
    for name, value in items.items():
        assert hasattr(config, name)
        setattr(config, name, value)
    return config


def mutated(config: Any) -> tuple[list[ArrayGenome], list[neat.DefaultGenome]]:
    """`ALIKE` after one mutation each, ours and neat-python's."""
    ours, theirs = [copy_of(ALIKE) for _ in range(REPEATS)], [to_stock(ALIKE) for _ in range(REPEATS)]
    for genome in (*ours, *theirs):
        genome.mutate(config)
    return ours, theirs


def values(name: str, ours: list[ArrayGenome], theirs: list[neat.DefaultGenome]) -> tuple[list[float], list[float]]:
    """All values of one attribute."""
    table = "connections" if name == "weight" else "nodes"
    return (
        [value for genome in ours for value in getattr(genome, table)[name].tolist()],
        [getattr(gene, name) for genome in theirs for gene in getattr(genome, table).values()],
    )


@pytest.mark.parametrize("name", ["weight", "bias", "response"])
@pytest.mark.parametrize(
    ("rates", "bounds"),
    [
        pytest.param((1.0, 0.0), (-30.0, 30.0), id="all shifted"),
        pytest.param((0.0, 1.0), (-30.0, 30.0), id="all replaced"),
        pytest.param((0.5, 0.3), (-30.0, 30.0), id="some shifted, some replaced"),
        pytest.param((0.5, 0.3), (-0.25, 0.75), id="clamped"),
        pytest.param((0.8, 0.7), (-30.0, 30.0), id="rates above one"),
    ],
)
def test_numbers_change_as_neat_pythons_do(name: str, rates: tuple[float, float], bounds: tuple[float, float]) -> None:
    items = {"init_mean": 0.25, "init_stdev": 0.75, "mutate_power": 0.3, "min_value": bounds[0], "max_value": bounds[1]}
    items |= {"mutate_rate": rates[0], "replace_rate": rates[1]}
    genomes = mutated(config_of(**{f"{name}_{item}": value for item, value in items.items()}))
    ours, theirs = values(name, *genomes)
    assert_same_distribution(ours, theirs)
    kinds = [Counter(v if v in (0.5, *bounds) else "inside" for v in sample) for sample in (ours, theirs)]
    assert set(kinds[0]) == set(kinds[1])
    if len(kinds[0]) > 1:
        assert_same_frequencies(*kinds)
    assert bounds[0] <= min(ours) < max(ours) <= bounds[1]
    for unchanged in {"weight", "bias", "response"} - {name}:
        assert set(values(unchanged, *genomes)[0]) == {0.5}


@pytest.mark.parametrize("rates", [(0.0, 0.0, 0.0), (0.3, 0.0, 0.0), (0.1, 0.4, 0.0), (0.0, 0.0, 0.5), (1.0, 0.0, 0.0)])
def test_flags_change_as_neat_pythons_do_and_keys_innovations_and_activations_never(
    rates: tuple[float, float, float],
) -> None:
    names = ("enabled_mutate_rate", "enabled_rate_to_true_add", "enabled_rate_to_false_add")
    ours, theirs = mutated(config_of(**dict(zip(names, rates, strict=True))))
    counts = (
        Counter((row % 2, flag) for genome in ours for row, flag in enumerate(genome.connections["enabled"].tolist())),
        Counter((key[1] % 2, gene.enabled) for genome in theirs for key, gene in genome.connections.items()),
    )
    assert set(counts[0]) == set(counts[1])
    assert_same_frequencies(*counts)
    if not any(rates):
        assert counts[0] == {(0, True): GENES * REPEATS // 2, (1, False): GENES * REPEATS // 2}
    for table, name in (("nodes", "key"), ("nodes", "activation"), *(("connections", n) for n in ("target", "source"))):
        np.testing.assert_array_equal(getattr(ours[0], table)[name], getattr(ALIKE, table)[name])


def test_new_numbers_are_drawn_as_neat_pythons_initial_ones_are() -> None:
    config = config_of(weight_init_mean=0.5, weight_init_stdev=1.0, weight_min_value=-1.0, weight_max_value=1.25)
    ours = [draw(number(config, "weight"), config.generator) for _ in range(10_000)]
    gene = neat.genes.DefaultConnectionGene((-1, 0), innovation=1)
    theirs = []
    for _ in range(10_000):
        gene.init_attributes(config)
        theirs.append(gene.weight)
    assert_same_distribution(ours, theirs)
    assert (min(ours), max(ours)) == (-1.0, 1.25)
