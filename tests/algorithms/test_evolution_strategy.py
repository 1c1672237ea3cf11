"""Evolution strategies against known optima, steps worked out by hand, the library, and explicit normalisation."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import cmaes
import numpy as np
import pytest
import scipy.stats
from hypothesis import given, settings
from hypothesis import strategies as some
from numpy.typing import NDArray

from exneat_cli.algorithms import ALGORITHMS, ARS, CMAES, EvolutionSettings, OpenAIES, Results
from exneat_cli.algorithms.evolution_strategy import RACERS, EvolutionStrategy
from exneat_cli.algorithms.openai_es import centred_ranks
from exneat_cli.algorithms.weight_vector import LEAST_SD, Layout
from exneat_cli.brains import assemble
from exneat_cli.brains.brain import activate, memory_size
from exneat_cli.runs import RunSettings
from exneat_cli.seeding import stream
from exneat_cli.tasks import AntTask
from exneat_cli.wiring import Geometry, Moments
from tests.algorithms.problems import problem_of

LINEAR = EvolutionSettings(initial_connection="full_direct", output_activation="clamped")
STRATEGIES: dict[str, EvolutionStrategy] = {
    "ars": ARS(step_size=0.05, noise=0.05),
    "openai_es": OpenAIES(step_size=0.02, weight_decay=0.0),
    "cma_es, full": CMAES(sigma=0.3, covariance="full"),
    "cma_es, separable": CMAES(sigma=0.3, covariance="separable"),
}
SEED = stream(3, "evolution")
OPTIMUM = np.array([0.7, -1.0, 0.3, 0.0, 1.2])


@pytest.fixture(params=list(STRATEGIES))
def strategy(request: pytest.FixtureRequest) -> EvolutionStrategy:
    return STRATEGIES[request.param]


def test_every_optimiser_finds_the_centre_of_a_sphere(strategy: EvolutionStrategy) -> None:
    optimiser = strategy.optimiser(np.zeros(5), 20, SEED)
    for _ in range(250):
        optimiser.tell(-((optimiser.ask() - OPTIMUM) ** 2).sum(axis=1))
    np.testing.assert_allclose(optimiser.centre, OPTIMUM, atol=0.05)


def test_every_strategy_finds_the_line_through_points_whatever_the_units_of_its_inputs(
    strategy: EvolutionStrategy,
) -> None:
    rng = np.random.default_rng(0)
    inputs = rng.normal([5.0, -300.0, 0.0], [1.0, 100.0, 0.1], (64, 3))
    weights, bias = np.array([0.1, -0.002, 3.0]), -1.0
    targets = inputs @ weights + bias
    search = strategy.start(problem_of(LINEAR, 20, shape=(3, 0, 1)))
    sensed = Moments(np.full(3, 64.0), inputs.mean(axis=0), 64.0 * inputs.var(axis=0))
    for _ in range(250):
        teams, _ = search.ask()
        genomes = [team.genomes[0] for team in teams]
        outputs = [inputs[:, ::1] @ weights_of(genome) + genome.nodes["bias"][0] for genome in genomes]
        fitness = -np.mean((np.array(outputs) - targets) ** 2, axis=1)
        assert search.tell(Results(fitness[:, np.newaxis], np.zeros(len(teams), bool), (sensed,)))
    champion = search.candidates()[0].team.genomes[0]
    np.testing.assert_allclose(weights_of(champion) * inputs.std(axis=0), weights * inputs.std(axis=0), atol=0.03)
    np.testing.assert_allclose(inputs @ weights_of(champion) + champion.nodes["bias"][0], targets, atol=0.15)


def weights_of(genome: Any) -> NDArray[np.float64]:
    """Weights by pin, of a network without hidden nodes that has one output."""
    assert genome.nodes["activation"].tolist() == [4]
    return np.array(genome.connections["weight"][np.argsort(-genome.connections["source"])])


def test_an_update_of_ars_is_that_of_the_paper() -> None:
    start, fitness = np.array([1.0, -2.0, 0.5]), np.array([3.0, 0.0, -1.0, 8.0, 1.0, 5.0, -2.0, 7.5])
    optimiser = ARS(step_size=0.1, noise=0.2, top=2).optimiser(start, 8, SEED)
    samples = optimiser.ask()
    directions = (samples[:4] - start) / 0.2
    np.testing.assert_allclose(samples[4:], start - 0.2 * directions)
    optimiser.tell(fitness)
    # The best of the pairs (3, 1), (0, 5), (-1, -2) and (8, 7.5) are the last and the second.
    sd = np.std([8.0, 7.5, 0.0, 5.0])
    step = (0.5 * directions[3] - 5.0 * directions[1]) * 0.1 / (2 * sd)
    np.testing.assert_allclose(optimiser.centre, start + step, rtol=1e-12)


def test_a_first_update_of_openai_es_goes_by_the_sign_of_the_gradient_of_ranks_less_decay() -> None:
    start, fitness = np.array([1.0, -2.0, 0.5]), np.array([100.0, 0.0, -1.0, 7.0])
    optimiser = OpenAIES(step_size=0.1, noise=0.2, weight_decay=0.3).optimiser(start, 4, SEED)
    directions = (optimiser.ask()[:2] - start) / 0.2
    optimiser.tell(fitness)
    # Ranks 3, 1, 0, 2: the first pair gains 3 of 3 ranks, the second loses one.
    gradient = (directions[0] - directions[1] / 3) / (4 * 0.2) - 0.3 * start
    np.testing.assert_allclose(optimiser.centre, start + 0.1 * np.sign(gradient), rtol=1e-6)


@given(some.lists(some.integers(-5, 5), min_size=2, max_size=30))
def test_centred_ranks_are_scipys_between_a_half_below_and_above_zero(values: list[int]) -> None:
    expected = (scipy.stats.rankdata(values) - 1) / (len(values) - 1) - 0.5
    np.testing.assert_allclose(centred_ranks(np.array(values, float)), expected, atol=1e-12)


@pytest.mark.parametrize(("covariance", "library"), [("full", cmaes.CMA), ("separable", cmaes.SepCMA)])
def test_cma_es_samples_what_the_library_alone_samples_with_the_same_seed(covariance: str, library: Any) -> None:
    optimiser = CMAES(sigma=0.3, covariance=covariance).optimiser(np.zeros(5), 10, SEED)
    own = library(np.zeros(5), 0.3, population_size=10, seed=int(SEED.generate_state(1)[0]))
    for _ in range(30):
        asked = [own.ask() for _ in range(10)]
        assert optimiser.ask().tolist() == [each.tolist() for each in asked]
        optimiser.tell(np.array([-np.sum((each - OPTIMUM) ** 2) for each in asked]))
        own.tell([(each, float(np.sum((each - OPTIMUM) ** 2))) for each in asked])
    assert optimiser.centre.tolist() == own.mean.tolist()


@pytest.mark.parametrize(("weights", "kind"), [(300, cmaes.CMA), (301, cmaes.SepCMA)])
def test_cma_es_takes_the_full_matrix_while_it_fits(weights: int, kind: type) -> None:
    optimiser = CMAES().optimiser(np.zeros(weights), 8, SEED)
    assert isinstance(optimiser._library, kind)  # type: ignore[attr-defined]


@pytest.mark.parametrize("feed_forward", [True, False])
@given(seed=some.integers(0, 2**32))
@settings(max_examples=20, deadline=None)
def test_folded_networks_put_out_what_networks_with_normalised_inputs_do(feed_forward: bool, seed: int) -> None:
    evolution = replace(LINEAR, feed_forward=feed_forward, module_hidden=2)
    ant = RunSettings(AntTask(), ARS(), Geometry("fb"), linkage="hidden", evolution=evolution)
    layout, plan, rng = Layout(ant.problem), ant.plan, np.random.default_rng(seed)
    # In this wiring a reading is sensed by one module alone, and each pin of a subpopulation has statistics of its own.
    mean, sd = np.zeros(plan.observation_size), np.ones(plan.observation_size)
    moments = [Moments(*np.zeros((3, pins))) for pins, _, _ in plan.subpopulation_shapes]
    for own in moments:
        own.means[:], own.squares[:] = rng.normal(0.0, 10.0, (2, len(own.means)))
        own.squares[:] **= 2
    for module in plan.modules:
        counts, means, squares = moments[module.subpopulation]
        for k, pin in enumerate(module.pins):
            if pin.is_sensor:
                counts[k] = 4.0
                mean[pin.index], sd[pin.index] = means[k], max(math.sqrt(squares[k] / 4.0), LEAST_SD)
    vectors = rng.normal(0.0, 0.1, (2, layout.size))
    nothing = [Moments(*np.zeros((3, pins))) for pins, _, _ in plan.subpopulation_shapes]
    folded, plain = (
        assemble(
            plan,
            [team.genomes for team in layout.teams(layout.folded(vectors, known), [0, 1])],
            feed_forward=feed_forward,
        )
        for known in (moments, nothing)
    )
    readings = rng.normal(mean, sd, (6, plan.observation_size))
    for b in range(2):
        np.testing.assert_allclose(
            run(folded, b, readings), run(plain, b, (readings - mean) / sd), rtol=1e-12, atol=1e-12
        )


def run(brains: Any, b: int, readings: NDArray[np.float64]) -> NDArray[np.float64]:
    memory, actions = np.zeros(memory_size(brains)), []
    for row in readings:
        memory[: len(row)] = row
        actions.append(np.zeros(8))
        activate(brains, b, memory, actions[-1])
    return np.array(actions)


@pytest.mark.parametrize("name", ["ars", "openai_es", "cma_es"])
def test_no_two_teams_of_a_search_have_an_id_in_common_and_the_best_centres_and_the_last_are_kept(name: str) -> None:
    search = ALGORITHMS[name](name).start(problem_of(LINEAR, 4, 2))
    asked, told = set(), []
    for generation in range(RACERS + 3):
        teams, _ = search.ask()
        assert not asked & {team.ids for team in teams}
        asked |= {team.ids for team in teams}
        told.append(float(-generation if generation % 5 else generation))
        search.tell(Results(np.full((4, 1), told[-1]), np.zeros(4, bool), (Moments(*np.ones((3, 3))),) * 2))
    kept = search.candidates()
    ids = {candidate.team.ids for candidate in kept}
    assert len(ids) == RACERS
    assert not ids & asked
    last = RACERS + 2
    expected = {*sorted(range(last), key=lambda k: -told[k])[: RACERS - 1], last}
    assert {candidate.generation for candidate in kept} == expected


def test_weights_begin_at_zero_and_with_hidden_nodes_beside_it() -> None:
    problem = problem_of(LINEAR, 2, shape=(3, 0, 1))
    first = ARS().start(problem)._optimiser.centre  # type: ignore[attr-defined]
    assert not first.any()
    first = ARS().start(replace(problem_of(LINEAR, 2), seed=1))._optimiser.centre  # type: ignore[attr-defined]
    assert 0.0 < np.abs(first).max() < 0.2
