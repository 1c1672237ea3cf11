"""What no history of mutation, crossover, selection and extinction may do to array genomes."""

from __future__ import annotations

import random
from dataclasses import replace
from graphlib import CycleError, TopologicalSorter

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from exneat_cli.algorithms import RECURRENT, ArrayGenome, EvolutionSettings, neat_config
from exneat_cli.algorithms.neat.subpopulation import Subpopulation
from exneat_cli.seeding import stream
from tests.algorithms.neat.genomes import (
    assert_sound,
    child_of,
    initial_genomes,
    lively,
    pairs_of,
    relatives,
    seeded_config,
)

SHAPE = (2, 2, 2)
INITIAL_KEYS = [0, 1, 2, 3]
SETTINGS = {"feed-forward": EvolutionSettings(), "recurrent": RECURRENT}


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
    config = seeded_config(replace(lively(EvolutionSettings()), initial_connection=kind), SHAPE, seed)
    genomes = initial_genomes(config, 5)
    for key, (one, other, replaced) in enumerate(births):
        genomes[replaced] = child_of(genomes[one], genomes[other], config, key)
        assert_sound(genomes[replaced])
        assert not has_a_cycle(genomes[replaced])


def test_recurrent_genomes_get_cycles_of_several_nodes(grid_settings: EvolutionSettings) -> None:
    """So what looks for cycles finds them where there are some."""
    config = seeded_config(replace(lively(grid_settings), initial_connection="unconnected"), SHAPE, 0)
    genomes = relatives(config, 20, 400)
    for genome in genomes:
        genome.connections = genome.connections[genome.connections["target"] != genome.connections["source"]]
    assert any(has_a_cycle(genome) for genome in genomes)


class Chronicle:
    """What was ever seen of a subpopulation, checked generation by generation."""

    def __init__(self) -> None:
        self.ends: dict[int, tuple[int, int]] = {}
        self.keys: set[int] = set()
        self.previous_keys: set[int] = set()
        self.previous_innovations: set[int] = set()

    def add(self, genomes: list[ArrayGenome]) -> None:
        """Check that whatever this generation has and the last one had not was never there before."""
        owners: dict[int, int] = {}
        seen_before = max(self.ends, default=0)
        innovations: set[int] = set()
        for genome in genomes:
            assert_sound(genome)
            assert genome.nodes["key"][:2].tolist() == [0, 1]
            for key in genome.nodes["key"].tolist():
                owners[key] = owners.get(key, 0) + 1
            for target, source, innovation, _, _ in genome.connections.tolist():
                assert self.ends.setdefault(innovation, (target, source)) == (target, source)
                innovations.add(innovation)
        new_keys = owners.keys() - self.previous_keys - set(INITIAL_KEYS)
        assert not new_keys & self.keys
        assert all(owners[key] == 1 for key in new_keys)
        assert all(number > seen_before for number in innovations - self.previous_innovations)
        self.keys |= new_keys
        self.previous_keys, self.previous_innovations = set(owners), innovations


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from(list(SETTINGS)), st.booleans(), st.integers(8, 16))
def test_keys_and_innovations_never_collide_in_a_history_with_extinctions(
    seed: int, name: str, dies_out: bool, population: int
) -> None:
    changes = {"max_stagnation": 1, "species_elitism": 0} if dies_out else {"max_stagnation": 5}
    changes |= {"elitism": 2, "min_species_size": 2}
    chosen = replace(lively(SETTINGS[name]), compatibility_threshold=2.0, **changes)  # type: ignore[arg-type]
    subpopulation = Subpopulation(neat_config(chosen, population, SHAPE), stream(seed, "evolution", 0))
    chronicle, fitness, extinctions = Chronicle(), random.Random(seed), 0
    extinct = True
    for _ in range(30):
        genomes = list(subpopulation.genomes.values())
        if extinct:
            assert all(genome.nodes["key"].tolist() == INITIAL_KEYS for genome in genomes)
        chronicle.add(genomes)
        # Fitness that seldom rises lets species stagnate.
        extinct = subpopulation.advance({key: fitness.choice((0.0, 1.0)) for key in subpopulation.genomes})
        extinctions += extinct
    assert chronicle.keys
    assert extinctions > 0 or not dies_out


@pytest.mark.parametrize("name", list(SETTINGS))
def test_keys_that_mutations_add_begin_after_the_initial_ones(name: str) -> None:
    config = seeded_config(lively(SETTINGS[name]), SHAPE, 0)
    genomes = relatives(config, 10, 100)
    later = {key for genome in genomes for key in genome.nodes["key"].tolist()} - set(INITIAL_KEYS)
    assert later
    assert min(later) > max(INITIAL_KEYS)
