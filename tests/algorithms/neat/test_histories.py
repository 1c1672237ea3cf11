"""What no history of mutation, crossover, selection and extinction may do to array genomes."""

from __future__ import annotations

import random
from collections import Counter
from graphlib import CycleError, TopologicalSorter

from hypothesis import given, settings
from hypothesis import strategies as st

from exneat_cli.algorithms import RECURRENT, ArrayGenome, EvolutionSettings, neat_config
from exneat_cli.algorithms.neat.subpopulation import Subpopulation
from exneat_cli.seeding import stream
from tests.algorithms.neat.genomes import (
    COLUMNS,
    assert_sound,
    child_of,
    initial_genomes,
    lively,
    pairs_of,
    relatives,
    seeded_config,
)


def has_a_cycle(genome: ArrayGenome) -> bool:
    sorter: TopologicalSorter[int] = TopologicalSorter()
    for target, source in pairs_of(genome):
        sorter.add(target, source)
    try:
        sorter.prepare()
    except CycleError:
        return True
    return False


@settings(max_examples=60, deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.lists(st.tuples(*[st.integers(0, 4)] * 3), min_size=20, max_size=80),
    st.sampled_from(["full_nodirect", "full_direct", "unconnected", "fs_neat_hidden"]),
)
def test_feed_forward_genomes_never_have_a_cycle(seed: int, births: list[tuple[int, int, int]], kind: str) -> None:
    config = seeded_config(lively(EvolutionSettings(), initial_connection=kind), (2, 2, 2), seed)
    genomes = initial_genomes(config, 5)
    for key, (one, other, replaced) in enumerate(births):
        genomes[replaced] = child_of(genomes[one], genomes[other], config, key)
        assert_sound(genomes[replaced])
        assert not has_a_cycle(genomes[replaced])


def test_recurrent_genomes_get_cycles_of_several_nodes() -> None:
    """So what looks for cycles finds them where there are some."""
    config = seeded_config(lively(RECURRENT, initial_connection="unconnected"), (2, 2, 2), 0)
    genomes = relatives(config, 20, 400)
    for genome in genomes:
        genome.connections = genome.connections[genome.connections["target"] != genome.connections["source"]]
    assert any(has_a_cycle(genome) for genome in genomes)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from(list(COLUMNS)), st.booleans(), st.integers(8, 16))
def test_keys_and_innovations_never_collide_in_a_history_with_extinctions(
    seed: int, column: str, dies_out: bool, population: int
) -> None:
    changes = {"max_stagnation": 1, "species_elitism": 0} if dies_out else {"max_stagnation": 5}
    chosen = lively(COLUMNS[column], compatibility_threshold=2.0, elitism=2, min_species_size=2, **changes)
    subpopulation = Subpopulation(neat_config(chosen, population, (2, 2, 2)), stream(seed, "evolution", 0))
    fitness, extinct, extinctions = random.Random(seed), True, 0
    ends: dict[int, tuple[int, int]] = {}  # of every innovation ever
    ever, before = {0, 1, 2, 3}, {0, 1, 2, 3}  # keys of nodes, ever and in the last generation
    innovations_before: set[int] = set()
    for _ in range(30):
        genomes = list(subpopulation.genomes.values())
        assert not extinct or all(genome.nodes["key"].tolist() == [0, 1, 2, 3] for genome in genomes)
        keys = Counter(key for genome in genomes for key in genome.nodes["key"].tolist())
        rows = [row for genome in genomes for row in genome.connections.tolist()]
        highest = max(ends, default=0)
        for genome in genomes:
            assert_sound(genome)
            assert genome.nodes["key"][:2].tolist() == [0, 1]
        for target, source, innovation, _, _ in rows:
            assert ends.setdefault(innovation, (target, source)) == (target, source)
        # Whatever this generation has and the last one had not was never there before, and each node is in one genome.
        new = keys.keys() - before - {0, 1, 2, 3}
        assert not new & ever
        assert all(keys[key] == 1 for key in new)
        assert all(number > highest for number in {row[2] for row in rows} - innovations_before)
        ever, before, innovations_before = ever | new, set(keys), {row[2] for row in rows}
        # Fitness that seldom rises lets species stagnate.
        extinct = subpopulation.advance({key: fitness.choice((0.0, 1.0)) for key in subpopulation.genomes})
        extinctions += extinct
    assert len(ever) > 4
    assert extinctions > 0 or not dies_out
