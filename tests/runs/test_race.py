"""Races find the best of many brains, on the episodes that they were given and no more of them than need be."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from exneat_cli.rollouts import Outcomes
from exneat_cli.runs.race import race


class Known:
    """A runner of "brains" that are rows of fitness, one for each of the "episodes", which are columns."""

    def __init__(self) -> None:
        self.done: list[tuple[int, int]] = []  # brains and episodes of each call

    def run(self, brains: Sequence[NDArray[np.float64]], episodes: Sequence[int]) -> Outcomes:
        self.done.append((len(brains), len(episodes)))
        fitness = np.array([[brain[k] for k in episodes] for brain in brains])
        return Outcomes(fitness, fitness, np.ones_like(fitness, np.int64), np.zeros_like(fitness, np.bool_))


def raced(table: Any, episodes: int, first: int = 2) -> tuple[int, list[int], Known]:
    """The winner, how many episodes each had, and the runner."""
    runner: Any = Known()
    brains: Any = np.array(table, float)
    best, got = race(runner, list(brains), range(episodes), first)  # type: ignore[arg-type]
    for row, outcomes in zip(brains, got, strict=True):
        np.testing.assert_array_equal(outcomes.fitness[0], row[: outcomes.fitness.shape[1]])
    return best, [outcomes.fitness.shape[1] for outcomes in got], runner


def test_thirty_two_race_in_four_rounds_to_ten_episodes() -> None:
    table = np.tile(np.arange(32.0)[:, None], (1, 10))
    best, counts, runner = raced(table, 10)
    assert best == 31
    assert runner.done == [(32, 2), (16, 2), (8, 4), (4, 2)]
    assert sorted(counts) == [2] * 16 + [4] * 8 + [8] * 4 + [10] * 4


def test_one_lucky_episode_wins_no_race() -> None:
    steady, lucky, early = [5.0] * 8, [0.0, 11.0, *[0.0] * 6], [4.0, 4.0, *[9.0] * 6]
    best, counts, _ = raced([steady, lucky, early, [0.0] * 8], 8)
    assert (best, counts) == (0, [8, 4, 2, 2])


@pytest.mark.parametrize(("brains", "episodes"), [(1, 1), (1, 10), (2, 1), (3, 2), (5, 3), (7, 100)])
def test_few_brains_and_few_episodes_end(brains: int, episodes: int) -> None:
    best, counts, _ = raced(np.tile(np.arange(float(brains))[:, None], (1, episodes)), episodes)
    assert (best, counts[best]) == (brains - 1, episodes)


@given(st.lists(st.lists(st.floats(-1e6, 1e6), min_size=6, max_size=6), min_size=1, max_size=12))
def test_a_first_round_of_all_episodes_is_the_best_mean_of_all(table: list[list[float]]) -> None:
    best, counts, runner = raced(table, 6, first=6)
    assert (runner.done, set(counts)) == ([(len(table), 6)], {6})
    means = np.array(table).mean(axis=1)
    assert best == int(np.argmax(means))
