"""Ask/tell over subpopulations: equality with neat-python, pairing, ties, and that no run aborts."""

from __future__ import annotations

import math
import random

import neat
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from exneat_cli.algorithms import (
    ArrayGenome,
    Coevolution,
    EvolutionSettings,
    Team,
    from_stock,
    neat_config,
    to_stock,
)
from exneat_cli.algorithms.exneat import best_first, separate_ties
from exneat_cli.algorithms.neat.subpopulation import Subpopulation
from exneat_cli.seeding import stream
from tests.algorithms.neat.genomes import genes_of

SHAPE = (3, 2, 1)
XOR = [((0.0, 0.0), 0.0), ((0.0, 1.0), 1.0), ((1.0, 0.0), 1.0), ((1.0, 1.0), 0.0)]


def coevolution(
    settings: EvolutionSettings, subpopulations: int, population: int, seed: int, pairing: str = "rank"
) -> Coevolution:
    configs = [neat_config(settings, population, SHAPE) for _ in range(subpopulations)]
    seeds = [stream(seed, "evolution", index) for index in range(subpopulations)]
    return Coevolution(configs, seeds, stream(seed, "pairing"), pairing)


def fingerprint(genome: ArrayGenome) -> object:
    return genes_of(genome)


def synthetic(team: Team) -> float:
    """A cheap fitness that depends on every genome: large weights are good, large networks a little bad."""
    tables = [genome.connections for genome in team.genomes]
    weights = [abs(weight) for table in tables for weight in table["weight"][table["enabled"]].tolist()]
    return math.fsum(weights) / (1 + len(weights)) - 0.01 * len(weights)


def test_one_subpopulation_evolves_exactly_like_neat_population(ant_settings: EvolutionSettings) -> None:
    changes = {"node_add_prob": 0.3, "conn_add_prob": 0.4, "compatibility_threshold": 1.0, "max_stagnation": 3}
    settings = EvolutionSettings(**{**vars(ant_settings), **changes})
    shape = (2, 1, 1)
    theirs: list[list[object]] = []

    def fitness_of(genome: neat.DefaultGenome, config: neat.Config) -> float:
        network = neat.nn.FeedForwardNetwork.create(genome, config)
        return float(4.0 - sum((network.activate(inputs)[0] - target) ** 2 for inputs, target in XOR))

    def evaluate(genomes: list[tuple[int, neat.DefaultGenome]], config: neat.Config) -> None:
        theirs.append([fingerprint(from_stock(genome)) for _, genome in genomes])
        for _, genome in genomes:
            genome.fitness = fitness_of(genome, config)

    seed = stream(7, "evolution", 0)
    state = random.getstate()
    random.seed(int.from_bytes(seed.generate_state(8).tobytes(), "little"))
    neat.Population(neat_config(settings, 40, shape, neat.DefaultGenome)).run(evaluate, 8)
    random.setstate(state)

    config = neat_config(settings, 40, shape, neat.DefaultGenome)
    ours = Coevolution([config], [seed], stream(7, "pairing"), "index")
    species = set()
    for generation in range(8):
        teams = ours.ask()
        assert [fingerprint(team.genomes[0]) for team in teams] == theirs[generation]
        species.add(ours.species_count)
        ours.tell([fitness_of(to_stock(team.genomes[0]), config) for team in teams])
    assert max(species) > 1


def test_evolution_leaves_pythons_random_state_alone(ant_settings: EvolutionSettings) -> None:
    random.seed(5)
    before = random.getstate()
    subpopulation = Subpopulation(neat_config(ant_settings, 10, SHAPE), stream(0, "evolution", 0))
    subpopulation.advance(dict.fromkeys(subpopulation.genomes, 0.0))
    assert random.getstate() == before


@pytest.mark.parametrize("tied", [False, True], ids=["distinct", "heavily tied"])
@pytest.mark.parametrize("subpopulations", [1, 2, 3, 4, 5])
@pytest.mark.parametrize("genome", ["array", "stock"])
def test_the_best_team_meets_the_next_generation_intact(
    ant_settings: EvolutionSettings, genome: str, subpopulations: int, tied: bool
) -> None:
    changes = {"genome": genome, "compatibility_threshold": 0.8, "max_stagnation": 4}
    settings = EvolutionSettings(**{**vars(ant_settings), **changes})
    evolution = coevolution(settings, subpopulations, population=30, seed=3)
    rng = np.random.default_rng(subpopulations)
    most_species = 0
    for _ in range(30):
        teams = evolution.ask()
        values = [float(rng.integers(0, 3)) if tied else synthetic(team) for team in teams]
        evolution.tell(values)
        best = [team.ids for team, value in zip(teams, values, strict=True) if value == max(values)]
        # neat-python itself breaks the ties of a lone population; several follow the order of the teams.
        allowed = best if subpopulations == 1 else best[:1]
        following = evolution.ask()
        assert any(team.ids in allowed for team in following)
        if subpopulations > 1 or not tied:
            assert following[0].ids == best[0]
        most_species = max(most_species, evolution.species_count)
        evolution.tell([synthetic(team) for team in following])
    assert most_species > subpopulations


def test_survivors_of_several_subpopulations_are_the_same_objects(ant_settings: EvolutionSettings) -> None:
    evolution = coevolution(ant_settings, 3, population=20, seed=0)
    teams = evolution.ask()
    evolution.tell([float(index) for index in range(20)])
    before = [fingerprint(genome) for genome in teams[-1].genomes]
    assert [fingerprint(genome) for genome in evolution.ask()[0].genomes] == before


def test_index_pairing_keeps_neat_pythons_order(ant_settings: EvolutionSettings) -> None:
    evolution = coevolution(ant_settings, 2, population=12, seed=1, pairing="index")
    for _ in range(3):
        teams = evolution.ask()
        for index, subpopulation in enumerate(evolution._subpopulations):
            assert [team.ids[index] for team in teams] == list(subpopulation.genomes)
        evolution.tell([synthetic(team) for team in teams])


def test_initial_hidden_nodes_have_the_same_ids_also_after_an_extinction(ant_settings: EvolutionSettings) -> None:
    changes = {"max_stagnation": 1, "species_elitism": 0, "node_add_prob": 1.0}
    settings = EvolutionSettings(**{**vars(ant_settings), **changes})
    evolution = coevolution(settings, 2, population=10, seed=0)
    extinctions = 0
    for _ in range(12):
        teams = evolution.ask()
        if evolution.extinctions == 2:
            extinctions += 1
            assert all(genome.nodes["key"].tolist() == [0, 1, 2] for team in teams for genome in team.genomes)
        evolution.tell([1.0] * len(teams))
    assert extinctions >= 2


def test_ask_and_tell_refuse_to_be_called_out_of_turn(ant_settings: EvolutionSettings) -> None:
    evolution = coevolution(ant_settings, 1, population=5, seed=0)
    with pytest.raises(RuntimeError, match="expected ask"):
        evolution.tell([0.0] * 5)
    evolution.ask()
    with pytest.raises(RuntimeError, match="expected tell"):
        evolution.ask()
    with pytest.raises(ValueError, match="expected 5 fitness values, got 4"):
        evolution.tell([0.0] * 4)
    with pytest.raises(ValueError, match="got nan for team 2"):
        evolution.tell([0.0, 0.0, math.nan, 0.0, 0.0])
    evolution.tell([0.0] * 5)
    with pytest.raises(RuntimeError, match="expected ask"):
        evolution.tell([0.0] * 5)


@given(st.lists(st.floats(-1e6, 1e6) | st.sampled_from([0.0, -0.0, 1.0, -100.0]), min_size=1, max_size=60))
def test_separated_ties_keep_the_order_and_never_rise(fitness: list[float]) -> None:
    separated = separate_ties(fitness)
    assert len(set(separated)) == len(fitness)
    assert best_first(separated) == best_first(fitness)
    assert all(after <= before for after, before in zip(separated, fitness, strict=True))
    assert max(separated) == max(fitness)
    assert max(abs(a - b) for a, b in zip(separated, fitness, strict=True)) <= 60 * max(np.spacing(1e6), 1e-9)


@pytest.mark.parametrize("genome", ["array", "stock"])
def test_two_seeds_evolve_differently_and_one_seed_repeats(ant_settings: EvolutionSettings, genome: str) -> None:
    settings = EvolutionSettings(**{**vars(ant_settings), "genome": genome})

    def run(seed: int) -> list[object]:
        evolution = coevolution(settings, 2, population=10, seed=seed)
        for _ in range(3):
            teams = evolution.ask()
            evolution.tell([synthetic(team) for team in teams])
        return [fingerprint(genome) for team in evolution.ask() for genome in team.genomes]

    assert run(0) == run(0)
    assert run(0) != run(1)
