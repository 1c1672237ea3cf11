"""Who enters the hall of fame."""

from __future__ import annotations

from collections.abc import Iterable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from exneat_cli.algorithms import Candidate, Team
from exneat_cli.algorithms.teams import with_candidate


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
