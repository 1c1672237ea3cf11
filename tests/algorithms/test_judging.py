"""Judging by all episodes: what it costs, who gets a second look, who survives; and which teams are remembered."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from exneat_cli.algorithms import Candidate, Coevolution, EvolutionSettings, Problem, Results, Team
from exneat_cli.algorithms.candidates import RACERS, with_racers
from tests.algorithms.problems import problem_of


def judged_problem(population: int, subpopulations: int = 1, *, champion: str = "race", seed: int = 0) -> Problem:
    settings = EvolutionSettings(compatibility_threshold=100.0)
    problem = problem_of(settings, population, subpopulations, seed=seed)
    return Problem(**{**vars(problem), "judging": "mean", "champion": champion})


def generation(search: Coevolution, fitness_of: Callable[[Team], float]) -> list[tuple[list[Team], list[float]]]:
    """One generation; returns the teams and figures of every turn."""
    turns: list[tuple[list[Team], list[float]]] = []
    over = False
    while not over:
        teams, episodes = search.ask()
        fitness = [fitness_of(team) for team in teams]
        over = search.tell(Results(np.repeat(np.array(fitness)[:, None], episodes, 1), np.zeros(len(teams), np.bool_)))
        turns.append((teams, fitness))
    return turns


@pytest.mark.parametrize("population", [2, 5, 6, 12, 100])
@pytest.mark.parametrize("subpopulations", [1, 3])
def test_a_generation_costs_as_many_episodes_as_the_population_has_teams(population: int, subpopulations: int) -> None:
    search, rng = Coevolution(judged_problem(population, subpopulations)), np.random.default_rng(0)
    for _ in range(3):
        turns = generation(search, lambda _: float(rng.standard_normal()))
        assert sum(len(teams) for teams, _ in turns) == population
        assert len(turns) == (1 if population < 6 else 2)


def test_the_second_look_goes_to_the_best_and_counts_as_much_as_the_first() -> None:
    search = Coevolution(judged_problem(12))
    teams, _ = search.ask()
    first = [0.0, 1.0, 9.0, 3.0, 8.0, 2.0, 4.0, 5.0, 6.0, 7.0]
    assert not search.tell(Results(np.array(first)[:, None], np.zeros(10, np.bool_)))
    again, _ = search.ask()
    assert [team.ids for team in again] == [teams[2].ids, teams[4].ids]
    assert search.tell(Results(np.array([[-9.0], [7.5]]), np.zeros(2, np.bool_)))
    assert search.columns()["judged_fitness"] == 7.75
    assert search.ask()[0][0].ids == teams[4].ids


def test_who_survives_is_judged_by_the_mean_of_all_its_episodes() -> None:
    search, rng, got = Coevolution(judged_problem(30, 2)), np.random.default_rng(1), {}
    for _ in range(6):
        for teams, fitness in generation(search, lambda _: float(rng.standard_normal())):
            for team, value in zip(teams, fitness, strict=True):
                got.setdefault(team.ids, []).append(value)
        means = {team.ids: float(np.mean(got[team.ids])) for team in search._teams}
        assert search.columns()["judged_fitness"] == pytest.approx(max(means.values()))
    assert max(len(values) for values in got.values()) > 4


@pytest.mark.parametrize("subpopulations", [1, 2])
@pytest.mark.parametrize("threshold", [0.05, 100.0], ids=["many species", "one species"])
def test_a_tenth_survives_at_least_whatever_elitism_says(subpopulations: int, threshold: float) -> None:
    settings = EvolutionSettings(compatibility_threshold=threshold, elitism=0)
    problem = Problem(**{**vars(problem_of(settings, 60, subpopulations)), "judging": "mean"})
    search, rng = Coevolution(problem), np.random.default_rng(2)
    before: list[set[int]] = [set()] * subpopulations
    for number in range(5):
        (teams, _), *_ = generation(search, lambda _: float(rng.standard_normal()))
        now = [{team.ids[index] for team in teams} for index in range(subpopulations)]
        assert number == 0 or all(len(old & new) >= 5 for old, new in zip(before, now, strict=True))
        before = now


def test_noise_misleads_the_mean_less_than_the_last_episode() -> None:
    def quality(team: Team) -> float:
        """-1 times the distance of its biases from 1, without noise."""
        return -float(np.mean(np.abs(team.genomes[0].nodes["bias"] - 1.0)))

    def reached(judging: str) -> float:
        best = []
        for seed in range(6):
            settings = EvolutionSettings(compatibility_threshold=100.0, conn_delete_prob=0.0, node_delete_prob=0.0)
            problem = Problem(**{**vars(problem_of(settings, 60, seed=seed)), "judging": judging, "champion": "race"})
            search, rng = Coevolution(problem), np.random.default_rng(seed)
            for _ in range(20):
                generation(search, lambda team, rng=rng: quality(team) + 0.3 * float(rng.standard_normal()))  # type: ignore[misc]
            best.append(quality(search.candidates()[0].team))
        return float(np.mean(best))

    assert reached("mean") > reached("last")


def racers_after(generations: Sequence[Sequence[tuple[int, float]]]) -> list[Candidate]:
    racers: list[Candidate] = []
    for number, best in enumerate(generations):
        offered = [Candidate(Team((), (key,)), fitness, number) for key, fitness in best]
        racers = with_racers(racers, sorted(offered, key=lambda each: -each.fitness))
    return racers


offers = st.lists(st.tuples(st.integers(0, 60), st.floats(-100, 100)), min_size=1, max_size=6, unique_by=lambda o: o[0])


@given(st.lists(offers, min_size=1, max_size=40))
def test_a_race_has_the_last_generations_best_and_no_team_twice(generations: list[list[tuple[int, float]]]) -> None:
    racers = racers_after(generations)
    ids = [each.team.ids for each in racers]
    assert len(set(ids)) == len(ids) <= RACERS
    last = max(fitness for _, fitness in generations[-1])
    assert any(each.generation == len(generations) - 1 and each.fitness == last for each in racers)


def test_a_racer_goes_by_what_it_was_judged_on_last() -> None:
    racers = racers_after([[(1, 90.0)], [(2, 50.0)], [(1, 40.0)]])
    assert [(each.team.ids, each.fitness) for each in racers] == [((2,), 50.0), ((1,), 40.0)]


def test_a_failure_in_the_second_look_drops_a_team() -> None:
    search = Coevolution(judged_problem(12, champion="thesis"))
    teams, _ = search.ask()
    search.tell(Results(np.arange(10.0)[:, None], np.zeros(10, np.bool_)))
    search.ask()
    search.tell(Results(np.array([[-100.0], [8.0]]), np.array([True, False])))
    assert teams[9].ids not in {each.team.ids for each in search.candidates()}
    assert search.ask()[0][0].ids == teams[8].ids
