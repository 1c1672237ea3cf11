"""Mutation powers that genomes carry, children of one parent, and parents by rank, against SciPy and known extremes."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from neat.innovation import InnovationTracker
from numpy.random import PCG64, Generator
from scipy import stats

from exneat_cli.algorithms import ArrayGenome, Coevolution, EvolutionSettings, neat_config
from exneat_cli.algorithms.neat.neat_python import RankedParents
from tests.algorithms.problems import problem_of, synthetic, tell

ADAPTIVE = EvolutionSettings(
    mutation="adaptive",
    weight_mutate_power=0.1,
    weight_mutate_power_min=1e-9,
    weight_mutate_power_max=1e9,
    weight_mutate_rate=1.0,
    weight_replace_rate=0.0,
    bias_mutate_power=0.3,
    bias_mutate_rate=1.0,
    bias_replace_rate=0.0,
    conn_add_prob=0.0,
    conn_delete_prob=0.0,
    node_add_prob=0.0,
    node_delete_prob=0.0,
    enabled_mutate_rate=0.0,
)


def configured(settings: EvolutionSettings, seed: int = 0) -> Any:
    items = neat_config(settings, 50, (5, 3, 2)).genome_config
    items.generator, items.innovation_tracker = Generator(PCG64(seed)), InnovationTracker()
    items.node_indexer = iter(range(5, 10_000))
    return items


def new(config: Any, key: int = 1) -> ArrayGenome:
    genome = ArrayGenome(key)
    genome.configure_new(config)
    genome.fitness = 0.0
    return genome


def child_of(config: Any, one: ArrayGenome, other: ArrayGenome) -> ArrayGenome:
    child = ArrayGenome(99)
    child.configure_crossover(one, other, config)
    return child


def test_powers_change_log_normally_with_the_rate_of_the_number_of_genes() -> None:
    config = configured(ADAPTIVE)
    parent = new(config)
    assert parent.power == 0.1
    logs = []
    for _ in range(2000):
        child = child_of(config, parent, parent)
        child.mutate(config)
        assert child.power is not None
        logs.append(math.log(child.power / 0.1))
    genes = len(parent.nodes) + len(parent.connections)
    assert stats.kstest(logs, stats.norm(0.0, 1.0 / math.sqrt(genes)).cdf).pvalue > 0.001


def test_shifts_have_the_genomes_own_power_and_biases_go_along() -> None:
    config = configured(ADAPTIVE)
    parent = new(config)
    weights, biases = [], []
    for _ in range(400):
        child = child_of(config, parent, parent)
        child.mutate(config)
        assert child.power is not None
        weights += ((child.connections["weight"] - parent.connections["weight"]) / child.power).tolist()
        biases += ((child.nodes["bias"] - parent.nodes["bias"]) / (3.0 * child.power)).tolist()
    assert stats.kstest(weights, stats.norm.cdf).pvalue > 0.001
    assert stats.kstest(biases, stats.norm.cdf).pvalue > 0.001


def test_powers_stay_within_their_bounds_over_generations() -> None:
    settings = replace(ADAPTIVE, weight_mutate_power_min=0.09, weight_mutate_power_max=0.11)
    evolution = Coevolution(problem_of(settings, 20, 2))
    seen = set()
    for _ in range(10):
        teams = evolution.ask()[0]
        seen |= {genome.power for team in teams for genome in team.genomes}
        tell(evolution, [synthetic(team) for team in teams])
    assert {0.09, 0.11} < seen
    assert all(0.09 <= power <= 0.11 for power in seen)


def test_a_child_of_two_has_the_geometric_mean_of_their_powers() -> None:
    config = configured(ADAPTIVE)
    one, other = new(config), new(config, 2)
    one.power, other.power = 0.02, 0.5
    assert child_of(config, one, other).power == pytest.approx(0.1)


def test_without_crossover_a_child_is_a_copy_of_its_first_parent_even_if_the_second_is_fitter() -> None:
    config = configured(replace(ADAPTIVE, crossover_prob=0.0))
    one, other = new(config), new(config, 2)
    one.power, other.fitness = 0.02, 5.0
    child = child_of(config, one, other)
    assert child.power == 0.02
    np.testing.assert_array_equal(child.connections, one.connections)
    np.testing.assert_array_equal(child.nodes, one.nodes)
    child.mutate(config)
    assert not np.array_equal(child.connections, one.connections), "and a mutation leaves the parent alone"


def test_the_share_of_children_with_two_parents_is_the_setting() -> None:
    config = configured(replace(ADAPTIVE, crossover_prob=0.3))
    one, other = new(config), new(config, 2)
    mixed = sum(not np.array_equal(child_of(config, one, other).connections, one.connections) for _ in range(2000))
    assert stats.binomtest(mixed, 2000, 0.3).pvalue > 0.001


def test_parents_by_rank_are_chosen_as_by_linear_ranking() -> None:
    chance, count = RankedParents(4), 12
    counts = Counter(chance.choice(range(count)) for _ in range(12_000))
    expected = [12_000 * (2 * (count - k) - 1) / count**2 for k in range(count)]
    assert stats.chisquare([counts[k] for k in range(count)], expected).pvalue > 0.001


def test_clamped_outputs_are_neat_pythons() -> None:
    settings = EvolutionSettings(genome="stock", output_activation="clamped", weight_init_stdev=2.0)
    teams = Coevolution(problem_of(settings, 5, shape=(3, 2, 2))).ask()[0]
    config = neat_config(settings, 5, (3, 2, 2)).genome_config
    clamped = config.activation_defs.get("clamped")
    kinds = {node["activation"].item() for team in teams for node in team.genomes[0].nodes[2:]}
    outputs = {node["activation"].item() for team in teams for node in team.genomes[0].nodes[:2]}
    assert (kinds, outputs) == ({0}, {4})
    assert [clamped(x) for x in (-3.0, -0.5, 0.5, 3.0)] == [-1.0, -0.5, 0.5, 1.0]


def test_an_averaged_child_has_the_mean_of_matching_weights_and_biases_and_the_rest_of_the_fitter_parent() -> None:
    config = configured(replace(ADAPTIVE, crossover="average", initial_connection="full_direct"))
    one, other = new(config), new(config, 2)
    other.fitness, one.connections = 5.0, one.connections[3:].copy()
    child = child_of(config, one, other)
    expected = other.connections["weight"].copy()
    expected[3:] = (expected[3:] + one.connections["weight"]) / 2.0
    np.testing.assert_allclose(child.connections["weight"], expected, rtol=1e-15)
    np.testing.assert_allclose(child.nodes["bias"], (one.nodes["bias"] + other.nodes["bias"]) / 2.0, rtol=1e-15)
