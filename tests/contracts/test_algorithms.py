"""What every algorithm promises to the training loop."""

from __future__ import annotations

import dataclasses
import io
import json
import math
from typing import Any

import numpy as np
import pytest

from exneat_cli.algorithms import ALGORITHMS, Algorithm, Problem, Results, Search, Team
from exneat_cli.brains import acting_by_rule
from exneat_cli.errors import ConfigError
from exneat_cli.runs import RunSettings
from exneat_cli.tasks import TASKS
from exneat_cli.wiring import Geometry, Moments

MADE = {name: algorithm(name=name) for name, algorithm in ALGORITHMS.items()}  # type: ignore[call-arg]
TRAINED = [name for name, algorithm in MADE.items() if algorithm.rule is None]
EPISODES = 2


@pytest.fixture(params=TRAINED)
def algorithm(request: pytest.FixtureRequest) -> Algorithm:
    return MADE[request.param]


@pytest.fixture(params=["ant", "foraging"])
def problem(algorithm: Algorithm, request: pytest.FixtureRequest) -> Problem:
    """Two kinds of networks; of as many subpopulations as the algorithm can have."""
    geometry = Geometry("all") if algorithm.modular else Geometry()
    settings = RunSettings(task=TASKS[request.param](), algorithm=algorithm, geometry=geometry)
    return Problem(settings.plan, settings.evolution, 12, EPISODES, "rank", seed=5)


def results(problem: Problem, teams: int, seed: int, failing: float = 0.3) -> Results:
    """Made up: random fitness, and a share of teams that failed."""
    rng = np.random.default_rng(seed)
    sensed = tuple(Moments(*rng.uniform(1.0, 2.0, (3, pins))) for pins, _, _ in problem.plan.subpopulation_shapes)
    return Results(rng.normal(size=(teams, EPISODES)), rng.random(teams) < failing, sensed)


def genes_of(team: Team) -> str:
    return repr([(genome.nodes.tolist(), genome.connections.tolist()) for genome in team.genomes])


def generation(search: Search, problem: Problem, number: int) -> list[Any]:
    """Turns of ask and tell until a generation is over; returns all that there is to see of it."""
    seen: list[Any] = []
    for turn in range(100):
        teams, episodes = search.ask()
        assert episodes >= 1
        assert all(len(team.genomes) == len(problem.plan.subpopulation_shapes) for team in teams)
        seen += [(team.ids, genes_of(team)) for team in teams]
        if search.tell(results(problem, len(teams), 100 * number + turn)):
            assert all(math.isfinite(value) for value in search.columns().values())
            seen += [(c.fitness, c.generation, genes_of(c.team)) for c in search.candidates()]
            return [*seen, search.columns()]
    raise AssertionError("the generation has no end")


@pytest.mark.parametrize("name", sorted(ALGORITHMS))
def test_an_algorithm_goes_by_its_name_and_is_frozen(name: str) -> None:
    assert MADE[name].name == name
    with pytest.raises(dataclasses.FrozenInstanceError):
        MADE[name].name = "other"
    with pytest.raises(ConfigError, match=r"^algorithm\.name: expected one of"):
        ALGORITHMS[name](name="other")  # type: ignore[call-arg]


def test_ask_and_tell_are_refused_out_of_turn_and_bad_results_at_once(algorithm: Algorithm, problem: Problem) -> None:
    search = algorithm.start(problem)
    with pytest.raises(RuntimeError, match="ask"):
        search.tell(results(problem, 12, 0))
    count = len(search.ask()[0])
    with pytest.raises(RuntimeError, match="tell"):
        search.ask()
    with pytest.raises(ValueError, match=f"expected {count}"):
        search.tell(results(problem, count + 1, 0))
    bad = results(problem, count, 0)
    bad.fitness[1] = math.nan
    with pytest.raises(ValueError, match="finite"):
        search.tell(bad)
    search.tell(results(problem, count, 0))
    with pytest.raises(RuntimeError, match="ask"):
        search.tell(results(problem, count, 0))


def test_a_restored_search_goes_on_to_the_byte_and_taking_its_state_changes_nothing(
    algorithm: Algorithm, problem: Problem
) -> None:
    undisturbed, saved = algorithm.start(problem), algorithm.start(problem)
    elsewhere = generation(algorithm.start(dataclasses.replace(problem, seed=6)), problem, 0)
    names = set()
    for number in range(3):
        expected = generation(undisturbed, problem, number)
        assert generation(saved, problem, number) == expected != elsewhere
        names.add(tuple(saved.columns()))
    assert len(names) == 1
    # A state is data: what a checkpoint makes of it is as good.
    (plain, columns), file = saved.state(), io.BytesIO()
    np.savez(file, **columns)
    file.seek(0)
    with np.load(file, allow_pickle=False) as arrays:
        restored = algorithm.restored(problem, (json.loads(json.dumps(plain)), dict(arrays)))
    for number in (3, 4):
        expected = generation(undisturbed, problem, number)
        assert generation(saved, problem, number) == expected
        assert generation(restored, problem, number) == expected


def test_candidates_never_failed_and_come_best_first(algorithm: Algorithm, problem: Problem) -> None:
    search = algorithm.start(problem)
    assert search.candidates() == []
    for number in range(4):
        failed: set[str] = set()
        over = False
        while not over:
            teams, _ = search.ask()
            # In the first generation nobody is sound, later the seemingly best teams are not.
            told = results(problem, len(teams), number)
            told.failed[:] = told.fitness.mean(axis=1) > (0.5 if number else -math.inf)
            failed |= {genes_of(team) for team, fails in zip(teams, told.failed, strict=True) if fails}
            over = search.tell(told)
        candidates = search.candidates()
        assert (number == 0) == (not candidates)
        for candidate in candidates:
            assert candidate.generation <= number
            assert candidate.fitness <= 0.5
            assert candidate.generation < number or genes_of(candidate.team) not in failed
        assert [c.fitness for c in candidates] == sorted((c.fitness for c in candidates), reverse=True)


def fitting(name: str, task: str) -> RunSettings | None:
    """Settings with an untrained algorithm, or None where its rule means nothing for the task."""
    try:
        return RunSettings(task=TASKS[task](), algorithm=MADE[name])
    except ConfigError:
        return None


@pytest.mark.parametrize("name", [name for name in MADE if name not in TRAINED])
def test_an_untrained_algorithm_names_a_rule_that_acts_in_some_tasks(name: str) -> None:
    fits = [settings for task in sorted(TASKS) if (settings := fitting(name, task))]
    assert fits
    for settings in fits:
        assert not settings.plan.modules
        assert settings.algorithm.rule is not None
        acting = acting_by_rule(settings.algorithm.rule, settings.task)
        observation, actuators = settings.plan.observation_size, settings.plan.action_size
        if acting is not None:  # which is at random
            assert (acting.observation_size, acting.output_slot.size) == (observation, actuators)
        with pytest.raises(TypeError, match="trains nothing"):
            settings.algorithm.start(Problem(settings.plan, settings.evolution, 12, 1, "rank", seed=0))
