"""Who enters the hall of fame."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from exneat_cli.algorithms import HallOfFame, Team


def team(*ids: int) -> Team:
    return Team(genomes=(), ids=ids)


def test_only_teams_within_a_tenth_of_the_best_stay() -> None:
    hall = HallOfFame()
    for key, fitness in enumerate([50.0, 100.0, 91.0, 90.0, 89.9]):
        hall.add(team(key), fitness, generation=0)
    assert [entry.fitness for entry in hall.entries] == [100.0, 91.0, 90.0]


def test_the_margin_of_a_negative_best_reaches_below_it() -> None:
    hall = HallOfFame()
    for key, fitness in enumerate([-10.0, -10.9, -11.1]):
        hall.add(team(key), fitness, generation=0)
    assert [entry.fitness for entry in hall.entries] == [-10.0, -10.9]


def test_a_team_that_comes_again_keeps_its_best_figure_and_one_place() -> None:
    hall = HallOfFame()
    for generation, fitness in enumerate([100.0, 97.0, 103.0]):
        hall.add(team(1, 2), fitness, generation)
    (entry,) = hall.entries
    assert (entry.fitness, entry.generation) == (103.0, 2)


@given(st.lists(st.tuples(st.integers(0, 30), st.floats(-100, 100)), min_size=1, max_size=100))
def test_at_most_twenty_unique_teams_best_first_and_the_best_ever_among_them(offers: list[tuple[int, float]]) -> None:
    hall = HallOfFame()
    for generation, (key, fitness) in enumerate(offers):
        hall.add(team(key), fitness, generation)
    entries = hall.entries
    assert len(entries) <= 20
    assert len({entry.team.ids for entry in entries}) == len(entries)
    assert [entry.fitness for entry in entries] == sorted((entry.fitness for entry in entries), reverse=True)
    assert entries[0].fitness == max(fitness for _, fitness in offers)
