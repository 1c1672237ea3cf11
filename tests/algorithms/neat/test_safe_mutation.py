"""Mutations that are smaller where sensors show much, against a sensitivity that is known."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from exneat_cli.algorithms import Coevolution, EvolutionSettings, ExNEAT, Results
from exneat_cli.algorithms.neat.settings import LEAST_SENSITIVITY
from exneat_cli.wiring import Moments
from tests.algorithms.problems import contents, problem_of

SAFE = EvolutionSettings(
    safe_mutation=True,
    initial_connection="full_direct",
    weight_init_stdev=0.0,
    weight_mutate_power=0.1,
    weight_mutate_rate=1.0,
    weight_replace_rate=0.0,
    conn_add_prob=0.0,
    conn_delete_prob=0.0,
    node_add_prob=0.0,
    node_delete_prob=0.0,
    elitism=0,
    crossover_prob=0.0,
)
SENSED = Moments(np.array([4.0, 4.0, 0.0]), np.array([3.0, 0.0, 7.0]), np.array([64.0, 0.0, 0.0]))
"""Root mean squares 5 and 0, and a pin that sensed nothing."""


def told(search: Coevolution, sensed: Moments = SENSED) -> None:
    teams = len(search.ask()[0])
    assert search.tell(Results(np.ones((teams, 1)), np.zeros(teams, np.bool_), (sensed,)))


@pytest.mark.parametrize(("pin", "sd"), [(0, 0.1 / 5.0), (1, 0.1 / LEAST_SENSITIVITY), (2, 0.1)])
def test_shifts_are_divided_by_the_root_mean_square_of_what_was_sensed(pin: int, sd: float) -> None:
    search = Coevolution(problem_of(SAFE, 600))
    told(search)
    tables = [team.genomes[0].connections for team in search.ask()[0]]
    weights = np.concatenate([table["weight"][table["source"] == -1 - pin] for table in tables])
    assert len(weights) == 3 * 600
    assert stats.kstest(weights / sd, stats.norm.cdf).pvalue > 0.001


def test_weights_that_read_nodes_are_shifted_as_without_it() -> None:
    search = Coevolution(problem_of(SAFE, 600))
    told(search)
    tables = [team.genomes[0].connections for team in search.ask()[0]]
    weights = np.concatenate([table["weight"][table["source"] >= 0] for table in tables])
    assert stats.kstest(weights / 0.1, stats.norm.cdf).pvalue > 0.001


def test_everything_that_was_ever_sensed_counts_also_after_going_on_from_a_state() -> None:
    problem = problem_of(SAFE, 20)
    search = Coevolution(problem)
    told(search)
    told(search, SENSED._replace(means=np.array([30.0, 1.0, 0.0])))
    plain, arrays = search.state()
    restored = ExNEAT().restored(problem, (json.loads(json.dumps(plain)), dict(arrays)))
    assert isinstance(restored, Coevolution)
    ours, theirs = ([contents(team.genomes[0]) for team in each.ask()[0]] for each in (search, restored))
    assert ours == theirs
    np.testing.assert_allclose(arrays["sensed.0"][:, 0], [8.0, 16.5, 128.0 + 8.0 * 13.5**2])


@pytest.mark.parametrize("column", [None, np.zeros((3, 2)), np.full((3, 3), np.nan)])
def test_a_state_without_what_was_sensed_is_refused(column: object) -> None:
    problem = problem_of(SAFE, 20)
    search = Coevolution(problem)
    told(search)
    plain, arrays = search.state()
    del arrays["sensed.0"]
    with pytest.raises((KeyError, ValueError)):
        Coevolution(problem, (plain, arrays if column is None else {**arrays, "sensed.0": column}))


def test_an_algorithm_asks_for_what_is_sensed_only_if_mutations_are_safe() -> None:
    assert ExNEAT().wants_moments(SAFE)
    assert not ExNEAT().wants_moments(replace(SAFE, safe_mutation=False))
