"""Ask and tell over subpopulations: equality with neat-python, pairing, ties, failures, hall of fame."""

from __future__ import annotations

import random
from collections.abc import Iterable
from dataclasses import replace

import neat
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from exneat_cli.algorithms import Candidate, Coevolution, EvolutionSettings, Team, from_stock, neat_config, to_stock
from exneat_cli.algorithms.candidates import with_candidate
from exneat_cli.algorithms.exneat import best_first, failed_last, separate_ties
from exneat_cli.seeding import stream
from tests.algorithms.problems import contents, problem_of, synthetic, tell

XOR = [((0.0, 0.0), 0.0), ((0.0, 1.0), 1.0), ((1.0, 0.0), 1.0), ((1.0, 1.0), 0.0)]


def test_one_subpopulation_evolves_exactly_like_neat_population() -> None:
    changes = {"node_add_prob": 0.3, "conn_add_prob": 0.4, "compatibility_threshold": 1.0, "max_stagnation": 3}
    settings, shape = replace(EvolutionSettings(genome="stock"), **changes), (2, 1, 1)  # type: ignore[arg-type]
    config = neat_config(settings, 40, shape)
    theirs: list[list[object]] = []

    def fitness_of(genome: neat.DefaultGenome) -> float:
        network = neat.nn.FeedForwardNetwork.create(genome, config)
        return float(4.0 - sum((network.activate(inputs)[0] - target) ** 2 for inputs, target in XOR))

    def evaluate(genomes: list[tuple[int, neat.DefaultGenome]], _: neat.Config) -> None:
        theirs.append([contents(from_stock(genome)) for _, genome in genomes])
        for _, genome in genomes:
            genome.fitness = fitness_of(genome)

    state = random.getstate()
    random.seed(int.from_bytes(stream(7, "evolution", 0).generate_state(8).tobytes(), "little"))
    neat.Population(config).run(evaluate, 8)
    random.setstate(state)

    ours = Coevolution(problem_of(settings, 40, shape=shape, pairing="index", seed=7))
    species = set()
    for generation in range(8):
        teams = ours.ask()[0]
        assert [contents(team.genomes[0]) for team in teams] == theirs[generation]
        species.add(ours.columns()["species"])
        tell(ours, [fitness_of(to_stock(team.genomes[0])) for team in teams])
    assert max(species) > 1


@pytest.mark.parametrize("tied", [False, True], ids=["distinct", "heavily tied"])
@pytest.mark.parametrize("subpopulations", [1, 3])
@pytest.mark.parametrize("genome", ["array", "stock"])
def test_the_best_team_meets_the_next_generation_intact(genome: str, subpopulations: int, tied: bool) -> None:
    settings = EvolutionSettings(genome=genome, compatibility_threshold=0.8, max_stagnation=4)
    evolution = Coevolution(problem_of(settings, 30, subpopulations, seed=3))
    rng = np.random.default_rng(subpopulations)
    most_species = 0
    for _ in range(30):
        teams = evolution.ask()[0]
        values = [float(rng.integers(0, 3)) if tied else synthetic(team) for team in teams]
        tell(evolution, values)
        best = [team for team, value in zip(teams, values, strict=True) if value == max(values)]
        before = [contents(genome) for genome in best[0].genomes]
        following = evolution.ask()[0]
        # neat-python itself breaks the ties of a lone population; several follow the order of the teams.
        allowed = best if subpopulations == 1 else best[:1]
        assert {team.ids for team in following} & {team.ids for team in allowed}
        if subpopulations > 1 or not tied:
            assert following[0].ids == best[0].ids
            assert [contents(genome) for genome in following[0].genomes] == before
        most_species = max(most_species, int(evolution.columns()["species"]))
        tell(evolution, [synthetic(team) for team in following])
    assert most_species > subpopulations


def test_index_pairing_keeps_neat_pythons_order() -> None:
    evolution = Coevolution(problem_of(EvolutionSettings(), 12, 2, pairing="index", seed=1))
    for _ in range(3):
        teams = evolution.ask()[0]
        for index, subpopulation in enumerate(evolution._subpopulations):
            assert [team.ids[index] for team in teams] == list(subpopulation.genomes)
        tell(evolution, [synthetic(team) for team in teams])


@pytest.mark.parametrize("genome", ["array", "stock"])
def test_parents_pairing_lets_siblings_meet_and_keeps_survivors_where_rank_has_them(genome: str) -> None:
    settings, met = EvolutionSettings(genome=genome, compatibility_threshold=100.0, survival_threshold=0.1), 0
    evolution = Coevolution(problem_of(settings, 40, 3, pairing="parents", seed=4))
    teams = evolution.ask()[0]
    for _ in range(4):
        values = [synthetic(team) for team in teams]
        tell(evolution, values)
        team_of = [{team.ids[s]: k for k, team in enumerate(teams)} for s in range(3)]
        following = evolution.ask()[0]
        for subpopulation in evolution._subpopulations:
            assert subpopulation.genomes.keys() == {
                t.ids[evolution._subpopulations.index(subpopulation)] for t in following
            }
        best = sorted(range(40), key=lambda k: -values[k])[:2]
        assert [team.ids for team in following[:2]] == [teams[k].ids for k in best]
        for team in following[2:]:
            lines = {
                own[sub.first_parents[key]]
                for key, own, sub in zip(team.ids, team_of, evolution._subpopulations, strict=True)
            }
            met += len(lines) == 1
        teams = following
    # Of 38 offspring of 4 parents each; at random, a sixteenth would meet.
    assert met > 4 * 38 * 0.5


@pytest.mark.parametrize("genome", ["array", "stock"])
def test_initial_hidden_nodes_have_the_same_ids_also_after_an_extinction(genome: str) -> None:
    settings = EvolutionSettings(genome=genome, max_stagnation=1, species_elitism=0, node_add_prob=1.0)
    evolution = Coevolution(problem_of(settings, 10, 2))
    extinctions = 0
    for _ in range(12):
        teams = evolution.ask()[0]
        if evolution.columns()["extinctions"] == 2:
            extinctions += 1
            assert all(genome.nodes["key"].tolist() == [0, 1, 2] for team in teams for genome in team.genomes)
        tell(evolution, [1.0] * len(teams))
    assert extinctions >= 2


def test_a_team_that_failed_is_no_candidate_and_loses_to_all_others() -> None:
    evolution = Coevolution(problem_of(EvolutionSettings(), 10, 2))
    teams = evolution.ask()[0]
    tell(evolution, [float(k) for k in range(10)], failed=[8, 9])
    assert evolution.candidates()[0].team is teams[7]
    assert evolution.ask()[0][0].ids == teams[7].ids


@given(st.lists(st.floats(-1e6, 1e6) | st.sampled_from([0.0, -0.0, 1.0, -100.0]), min_size=1, max_size=60))
def test_separated_ties_keep_the_order_and_never_rise(fitness: list[float]) -> None:
    separated = separate_ties(fitness)
    assert len(set(separated)) == len(fitness)
    assert best_first(separated) == best_first(fitness)
    assert all(after <= before for after, before in zip(separated, fitness, strict=True))
    assert max(separated) == max(fitness)
    assert max(abs(a - b) for a, b in zip(separated, fitness, strict=True)) <= 60 * max(np.spacing(1e6), 1e-9)


@given(st.lists(st.tuples(st.floats(-1e6, 1e6), st.booleans()), min_size=1, max_size=30))
def test_failed_teams_rank_behind_all_sound_ones_which_keep_their_fitness(told: list[tuple[float, bool]]) -> None:
    sound = [k for k, (_, is_sound) in enumerate(told) if is_sound]
    ranked = failed_last([value for value, _ in told], sound)
    assert [ranked[k] for k in sound] == [told[k][0] for k in sound]
    failed = [value for k, value in enumerate(ranked) if k not in sound]
    assert not sound or not failed or max(failed) < min(ranked[k] for k in sound)


@pytest.mark.parametrize("genome", ["array", "stock"])
def test_one_seed_repeats_another_differs_and_pythons_random_state_stays(genome: str) -> None:
    def run(seed: int) -> list[object]:
        evolution = Coevolution(problem_of(EvolutionSettings(genome=genome), 10, 2, seed=seed))
        for _ in range(3):
            tell(evolution, [synthetic(team) for team in evolution.ask()[0]])
        return [contents(genome) for team in evolution.ask()[0] for genome in team.genomes]

    before = random.getstate()
    assert run(0) == run(0)
    assert run(0) != run(1)
    assert random.getstate() == before


def hall_of(offers: Iterable[tuple[int, float]]) -> list[Candidate]:
    """The hall of fame after these teams and figures, one per generation."""
    hall: list[Candidate] = []
    for generation, (key, fitness) in enumerate(offers):
        hall = with_candidate(hall, Candidate(Team((), (key,)), fitness, generation))
    return hall


@pytest.mark.parametrize(
    ("offered", "kept"),
    [([50.0, 100.0, 91.0, 90.0, 89.9], [100.0, 91.0, 90.0]), ([-10.0, -10.9, -11.1], [-10.0, -10.9])],
)
def test_only_teams_within_a_tenth_of_the_best_stay(offered: list[float], kept: list[float]) -> None:
    assert [entry.fitness for entry in hall_of(enumerate(offered))] == kept


def test_a_team_that_comes_again_keeps_its_best_figure_and_one_place() -> None:
    (entry,) = hall_of([(1, 100.0), (1, 97.0), (1, 103.0), (1, 102.0)])
    assert (entry.fitness, entry.generation) == (103.0, 2)


@given(st.lists(st.tuples(st.integers(0, 30), st.floats(-100, 100)), min_size=1, max_size=100))
def test_at_most_twenty_unique_teams_best_first_and_the_best_ever_among_them(offers: list[tuple[int, float]]) -> None:
    hall = hall_of(offers)
    assert len({entry.team.ids for entry in hall}) == len(hall) <= 20
    assert [entry.fitness for entry in hall] == sorted((entry.fitness for entry in hall), reverse=True)
    assert hall[0].fitness == max(fitness for _, fitness in offers)
