"""The first generation's connections, biases and weights are like neat-python's."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import pytest

from exneat_cli.algorithms import EvolutionSettings, neat_config
from exneat_cli.algorithms.neat.initial_connections import INITIAL_CONNECTIONS
from exneat_cli.algorithms.neat.stock_genome import HomologousGenome
from exneat_cli.algorithms.neat.subpopulation import Subpopulation
from exneat_cli.seeding import stream
from tests.algorithms.neat.genomes import (
    assert_same_distribution,
    assert_same_frequencies,
    assert_sound,
    initial_genomes,
    pairs_of,
    seeded_config,
)

FULL = [kind for kind in INITIAL_CONNECTIONS if not kind.startswith("fs_neat")]
FS_NEAT = [kind for kind in INITIAL_CONNECTIONS if kind.startswith("fs_neat")]


def settings_of(kind: str, feed_forward: bool) -> EvolutionSettings:
    return EvolutionSettings(initial_connection=kind, feed_forward=feed_forward)


@pytest.mark.parametrize("hidden", [0, 3])
@pytest.mark.parametrize("feed_forward", [True, False], ids=["feed-forward", "recurrent"])
@pytest.mark.parametrize("kind", FULL)
def test_initial_genomes_have_neat_pythons_nodes_and_connections(kind: str, feed_forward: bool, hidden: int) -> None:
    settings, shape = settings_of(kind, feed_forward), (3, hidden, 2)
    (ours,) = initial_genomes(seeded_config(settings, shape, 0), 1)
    (theirs,) = initial_genomes(seeded_config(settings, shape, 0, HomologousGenome), 1)
    assert_sound(ours)
    assert ours.nodes["key"].tolist() == sorted(theirs.nodes)
    assert pairs_of(ours) == sorted((target, source) for source, target in theirs.connections)
    assert ours.connections["enabled"].all()
    assert bool(pairs_of(ours)) == (kind != "unconnected")


@pytest.mark.parametrize("hidden", [0, 3])
@pytest.mark.parametrize("feed_forward", [True, False], ids=["feed-forward", "recurrent"])
@pytest.mark.parametrize("kind", FS_NEAT)
def test_one_pin_of_all_leads_where_it_does_in_neat_python(kind: str, feed_forward: bool, hidden: int) -> None:
    settings, shape = settings_of(kind, feed_forward), (5, hidden, 2)
    ours = initial_genomes(seeded_config(settings, shape, 0), 1000)
    theirs = initial_genomes(seeded_config(settings, shape, 0, HomologousGenome), 1000)
    ends = (
        Counter(tuple(pairs_of(genome)) for genome in ours),
        Counter(tuple(sorted((target, source) for source, target in genome.connections)) for genome in theirs),
    )
    assert set(ends[0]) == set(ends[1])
    assert [len({source for _, source in pairs}) for pairs in ends[0]] == [1] * 5
    assert_same_frequencies(*ends)
    assert all(genome.connections["enabled"].all() for genome in ours)


@pytest.mark.parametrize("kind", INITIAL_CONNECTIONS)
def test_a_first_generation_shares_innovations_and_no_two_connections_share_one(kind: str) -> None:
    config = neat_config(settings_of(kind, False), 30, (3, 2, 2))
    genomes = Subpopulation(config, stream(0, "evolution", 0)).genomes.values()
    numbers: dict[tuple[int, int], set[int]] = {}
    for genome in genomes:
        assert_sound(genome)
        for target, source, innovation, _, _ in genome.connections.tolist():
            numbers.setdefault((target, source), set()).add(innovation)
    assert all(len(innovations) == 1 for innovations in numbers.values())
    assert len(set.union(set(), *numbers.values())) == len(numbers)


@pytest.mark.parametrize("positive_start", [False, True])
@pytest.mark.parametrize("bound", [0.5, 30.0])
@pytest.mark.parametrize("means", [0.0, 0.25])
def test_initial_weights_biases_and_responses_are_distributed_as_neat_pythons(
    means: float, bound: float, positive_start: bool
) -> None:
    settings = replace(
        settings_of("full_nodirect", True),
        positive_start=positive_start,
        weight_max_value=bound,
        bias_max_value=bound,
        weight_init_stdev=0.4,
    )
    samples: dict[str, list[list[float]]] = {"weight": [], "bias": [], "response": []}
    for genome_type in (None, HomologousGenome):
        config = seeded_config(settings, (10, 5, 4), 1, genome_type)
        config.genome_config.response_init_stdev = 0.25
        for name in samples:
            setattr(config.genome_config, f"{name}_init_mean", means)
        genomes = initial_genomes(config, 80)
        for name, sample in samples.items():
            table = "connections" if name == "weight" else "nodes"
            if genome_type is None:
                sample.append([value for genome in genomes for value in getattr(genome, table)[name].tolist()])
            else:
                sample.append([getattr(g, name) for genome in genomes for g in getattr(genome, table).values()])
    for name, (ours, theirs) in samples.items():
        assert_same_distribution(ours, theirs)
        assert max(map(abs, ours)) <= (1.0 if name == "response" else bound)
    assert (min(samples["weight"][0]) >= 0.0) == positive_start
