"""Genomes with a history, genomes made by hand, and comparisons of samples with neat-python's."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import neat
import numpy as np
from numpy.random import PCG64, Generator
from scipy.stats import chi2_contingency, ks_2samp

from exneat_cli.algorithms import RECURRENT, ArrayGenome, EvolutionSettings, neat_config
from exneat_cli.algorithms.neat.genes import CONNECTION, NODE
from exneat_cli.algorithms.neat.neat_python import SteadyReproduction

ALPHA = 1e-4
"""Seeds are fixed, so a test that holds once holds always."""

COLUMNS = {"feed-forward": EvolutionSettings(), "recurrent": RECURRENT}
NO_STRUCTURE = {"conn_add_prob": 0.0, "conn_delete_prob": 0.0, "node_add_prob": 0.0, "node_delete_prob": 0.0}
NO_ATTRIBUTES = {
    "weight_mutate_rate": 0.0,
    "weight_replace_rate": 0.0,
    "bias_mutate_rate": 0.0,
    "bias_replace_rate": 0.0,
    "enabled_mutate_rate": 0.0,
}


def lively(settings: EvolutionSettings, **changes: Any) -> EvolutionSettings:
    """The same with much structural mutation and many flags drawn anew."""
    often = {"conn_add_prob": 0.8, "conn_delete_prob": 0.3, "node_add_prob": 0.5, "node_delete_prob": 0.3}
    return replace(settings, **{**often, "enabled_mutate_rate": 0.3, **changes})


def seeded_config(settings: EvolutionSettings, shape: tuple[int, int, int], seed: int) -> neat.Config:
    """A configuration for genomes outside of a population; Python's random state begins with `seed` too."""
    random.seed(seed)
    config = neat_config(settings, 2, shape)
    config.genome_config.generator = Generator(PCG64(seed))
    config.genome_config.innovation_tracker = reproduction_of(config).innovation_tracker
    return config


def initial_genomes(config: neat.Config, number: int) -> list[Any]:
    """Genomes of a first generation, of the configuration's class."""
    return list(reproduction_of(config).create_new(config.genome_type, config.genome_config, number).values())


def reproduction_of(config: neat.Config) -> SteadyReproduction:
    """Reproduction as new, without species."""
    return SteadyReproduction(config.reproduction_config, None, None)  # type: ignore[arg-type]


def relatives(config: neat.Config, number: int, births: int) -> list[Any]:
    """Genomes of common descent: after each of the `births` a mutated child replaces a random genome."""
    genomes = initial_genomes(config, number)
    for birth in range(births):
        parents = random.choices(genomes, k=2)
        genomes[random.randrange(number)] = child_of(parents[0], parents[1], config, 1 + number + birth)
        config.genome_config.innovation_tracker.reset_generation()
    return genomes


def child_of(one: Any, other: Any, config: neat.Config, key: int) -> Any:
    """A mutated child of parents whose fitness is drawn."""
    one.fitness, other.fitness = random.random(), random.random()
    child = config.genome_type(key)
    child.configure_crossover(one, other, config.genome_config)
    child.mutate(config.genome_config)
    return child


def genome_of(
    nodes: Sequence[tuple[int, float, float, int]],
    connections: Sequence[tuple[int, int, int, float, bool]],
    fitness: float = 0.0,
) -> ArrayGenome:
    """A genome made by hand: (key, bias, response, activation) and (target, source, innovation, weight, enabled)."""
    genome = ArrayGenome(1)
    genome.nodes, genome.connections = np.array(nodes, NODE), np.array(connections, CONNECTION)
    genome.fitness = fitness
    return genome


def copy_of(genome: ArrayGenome) -> ArrayGenome:
    """Another one with the same genes and fitness."""
    return genome_of(genome.nodes.tolist(), genome.connections.tolist(), genome.fitness or 0.0)


def pairs_of(genome: ArrayGenome) -> list[tuple[int, int]]:
    """Target and source of every connection."""
    return list(zip(genome.connections["target"].tolist(), genome.connections["source"].tolist(), strict=True))


def assert_sound(genome: ArrayGenome) -> None:
    """Sorted tables without repetition, finite numbers, and connections between nodes that exist."""
    keys, pairs, innovations = genome.nodes["key"].tolist(), pairs_of(genome), genome.connections["innovation"].tolist()
    assert (genome.nodes.dtype, genome.connections.dtype) == (NODE, CONNECTION)
    assert keys == sorted(set(keys))
    assert pairs == sorted(set(pairs))
    assert len(set(innovations)) == len(innovations)
    assert {target for target, _ in pairs} <= set(keys)
    assert {source for _, source in pairs if source >= 0} <= set(keys)
    for table, names in ((genome.nodes, ("bias", "response")), (genome.connections, ("weight",))):
        assert all(np.isfinite(table[name]).all() for name in names)


def assert_equal(one: ArrayGenome, other: ArrayGenome) -> None:
    """Equal in key, fitness and every gene."""
    assert (one.key, one.fitness) == (other.key, other.fitness)
    np.testing.assert_array_equal(one.nodes, other.nodes, strict=True)
    np.testing.assert_array_equal(one.connections, other.connections, strict=True)


def assert_same_frequencies(ours: Counter[Any], theirs: Counter[Any]) -> None:
    """Chi-square test on two counts of categories; rare categories are taken together."""
    table = np.array([[counts[category] for category in ours | theirs] for counts in (ours, theirs)])
    rare = table.sum(axis=0) < 20
    table = np.column_stack([table[:, ~rare], table[:, rare].sum(axis=1)])
    table = table[:, table.any(axis=0)]
    assert table.shape[1] > 1, f"expected several categories, got {ours}"
    assert chi2_contingency(table, correction=False).pvalue > ALPHA, f"{ours}\n{theirs}"


def assert_same_distribution(ours: Sequence[float], theirs: Sequence[float]) -> None:
    """Kolmogorov-Smirnov test on two samples of numbers."""
    assert len(set(ours)) > 1
    assert ks_2samp(ours, theirs, method="asymp").pvalue > ALPHA
