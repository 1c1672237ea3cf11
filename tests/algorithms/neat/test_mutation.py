"""Mutation of attributes follows neat-python's distributions."""

from __future__ import annotations

from collections import Counter
from typing import Any

import neat
import numpy as np
import pytest

from exneat_cli.algorithms import ArrayGenome, EvolutionSettings, to_stock
from exneat_cli.algorithms.neat.mutation import draw
from tests.algorithms.neat.genomes import (
    NO_ATTRIBUTES,
    NO_STRUCTURE,
    assert_same_distribution,
    assert_same_frequencies,
    copy_of,
    genome_of,
    seeded_config,
)

GENES = 200
REPEATS = 60
GENOME = genome_of(
    [(key, 0.5, 0.5, 0) for key in range(GENES)], [(key, -1, key, 0.5, key % 2 == 0) for key in range(GENES)]
)


def config_of(**items: float) -> Any:
    """A configuration that changes no structure and only those attributes that the items name."""
    settings = EvolutionSettings(**{**NO_STRUCTURE, **NO_ATTRIBUTES})  # type: ignore[arg-type]
    config = seeded_config(settings, (3, 2, 2), 0).genome_config
    for name, value in items.items():
        assert hasattr(config, name)
        setattr(config, name, value)
    return config


def mutated(config: Any) -> tuple[list[ArrayGenome], list[neat.DefaultGenome]]:
    """`GENOME` after one mutation each, ours and neat-python's."""
    ours, theirs = [], []
    for _ in range(REPEATS):
        ours.append(copy_of(GENOME))
        ours[-1].mutate(config)
        theirs.append(to_stock(GENOME))
        theirs[-1].mutate(config)
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
def test_flags_change_as_neat_pythons_do(rates: tuple[float, float, float]) -> None:
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


def test_new_numbers_are_drawn_as_neat_pythons_initial_ones_are() -> None:
    config = config_of(weight_init_mean=0.5, weight_init_stdev=1.0, weight_min_value=-1.0, weight_max_value=1.25)
    ours = [draw(config.number("weight"), config.generator) for _ in range(10_000)]
    gene = neat.genes.DefaultConnectionGene((-1, 0), innovation=1)
    theirs = []
    for _ in range(10_000):
        gene.init_attributes(config)
        theirs.append(gene.weight)
    assert_same_distribution(ours, theirs)
    assert (min(ours), max(ours)) == (-1.0, 1.25)


def test_a_mutation_changes_no_keys_innovations_and_activations() -> None:
    rates = {
        f"{name}_{rate}": 0.5 for name in ("weight", "bias", "response") for rate in ("mutate_rate", "replace_rate")
    }
    genome = copy_of(GENOME)
    genome.mutate(config_of(**rates, enabled_mutate_rate=1.0))
    for name in ("key", "activation"):
        np.testing.assert_array_equal(genome.nodes[name], GENOME.nodes[name])
    for name in ("target", "source", "innovation"):
        np.testing.assert_array_equal(genome.connections[name], GENOME.connections[name])
