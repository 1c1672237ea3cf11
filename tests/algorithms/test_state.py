"""A co-evolution that goes on from a state does what it would have done."""

from __future__ import annotations

import copy
import json
from typing import Any

import numpy as np
import pytest

from exneat_cli.algorithms import ACTIVATIONS, Coevolution, EvolutionSettings, ExNEAT, Problem, State
from tests.algorithms.problems import contents, problem_of, tell

POPULATION = 20


def begun(problem: Problem, generations: int) -> tuple[Coevolution, np.random.Generator]:
    """A co-evolution that was told the fitness of so many generations, and what draws the next."""
    evolution, rng = Coevolution(problem), np.random.default_rng(0)
    for _ in range(generations):
        tell(evolution, rng.integers(0, 9, len(evolution.ask()[0])).astype(float).tolist())
    return evolution, rng


def go_on(evolution: Coevolution, rng: np.random.Generator) -> list[object]:
    """Everything that can be seen of three more generations."""
    seen: list[object] = []
    for _ in range(3):
        teams = evolution.ask()[0]
        seen += [[contents(genome) for team in teams for genome in team.genomes], evolution.columns()]
        tell(evolution, rng.normal(size=len(teams)).tolist(), failed=[3])
        seen += [(entry.fitness, entry.generation, entry.team.ids) for entry in evolution.candidates()]
    return seen


def through_json(state: State) -> State:
    plain, arrays = state
    return json.loads(json.dumps(plain)), {name: column.copy() for name, column in arrays.items()}


@pytest.mark.parametrize("genome", ["array", "stock"])
@pytest.mark.parametrize("stagnation", [1, 20], ids=["with extinctions", "without"])
@pytest.mark.parametrize("subpopulations", [1, 3])
def test_going_on_from_a_state_is_going_on(genome: str, stagnation: int, subpopulations: int) -> None:
    settings = EvolutionSettings(
        genome=genome, max_stagnation=stagnation, species_elitism=0, compatibility_threshold=1.0, node_add_prob=0.4
    )
    problem = problem_of(settings, POPULATION, subpopulations, seed=4)
    for generations in (1, 2, 6):
        evolution, rng = begun(problem, generations)
        restored = ExNEAT().restored(problem, through_json(evolution.state()))
        assert isinstance(restored, Coevolution)
        assert go_on(restored, copy.deepcopy(rng)) == go_on(evolution, rng)


@pytest.mark.parametrize("genome", ["array", "stock"])
def test_taking_a_state_changes_nothing_and_it_does_not_change_later(genome: str) -> None:
    problem = problem_of(EvolutionSettings(genome=genome), POPULATION, 2, seed=4)
    undisturbed, watched = begun(problem, 3), begun(problem, 3)
    plain, _ = watched[0].state()
    before = json.dumps(plain)
    assert go_on(*watched) == go_on(*undisturbed)
    assert json.dumps(plain) == before


def test_no_state_is_taken_of_a_generation_without_fitness() -> None:
    evolution, _ = begun(problem_of(EvolutionSettings(), POPULATION), 1)
    evolution.ask()
    with pytest.raises(RuntimeError, match="expected ask"):
        evolution.state()


def species_with(own: dict[str, Any], **changes: Any) -> dict[str, Any]:
    head, *others = own["species"]
    return {"species": [{**head, **changes}, *others]}


WRONG_TEAMS: list[Any] = [
    lambda plain: {"teams": plain["teams"][1:]},
    lambda plain: {"teams": [[0] for _ in plain["teams"]]},
    lambda plain: {"fitness": [*plain["fitness"][1:], float("nan")]},
    lambda plain: {"pairing": {"bit_generator": "MT19937"}},
    lambda plain: {"generation": 0},
    lambda plain: {"hall_of_fame": [[float("nan"), 0] for _ in plain["hall_of_fame"]]},
    lambda plain: {"subpopulations": plain["subpopulations"] * 2},
]
WRONG_SUBPOPULATIONS: list[Any] = [
    lambda own: {"random": [3, [1, 2, 3], None]},
    lambda own: {"generator": None},
    lambda own: {"generation": -1},
    lambda own: {"next_node": None},
    lambda own: {"next_node": 2},
    lambda own: {"next_genome": POPULATION},
    lambda own: {"next_innovation": 1},
    lambda own: {"next_species": 2**62},
    lambda own: {"species": own["species"][1:]},
    lambda own: {"species": own["species"] * 2},
    lambda own: species_with(own, representative=-5),
    lambda own: species_with(own, members=[]),
    lambda own: species_with(own, members=[*own["species"][0]["members"], 10**6]),
    lambda own: species_with(own, fitness_history=[float("inf")]),
]


@pytest.mark.parametrize("index", range(len(WRONG_TEAMS) + len(WRONG_SUBPOPULATIONS)))
def test_a_state_that_does_not_fit_together_is_refused(index: int) -> None:
    problem = problem_of(EvolutionSettings(), POPULATION)
    plain, arrays = through_json(begun(problem, 2)[0].state())
    if index < len(WRONG_TEAMS):
        plain |= WRONG_TEAMS[index](plain)
    else:
        (own,) = plain["subpopulations"]
        own |= WRONG_SUBPOPULATIONS[index - len(WRONG_TEAMS)](own)
    with pytest.raises((ArithmeticError, AttributeError, LookupError, TypeError, ValueError)):
        Coevolution(problem, (plain, arrays))


def test_a_state_of_another_population_is_refused() -> None:
    state = begun(problem_of(EvolutionSettings(), POPULATION), 1)[0].state()
    with pytest.raises(ValueError, match="expected 21 genomes, got 20"):
        Coevolution(problem_of(EvolutionSettings(), 21), state)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("id", lambda column: np.zeros_like(column)),
        ("nodes", lambda column: column - 100),
        ("nodes", lambda column: np.full_like(column, 2**62)),
        ("connections", lambda column: column[1:]),
        ("node.bias", lambda column: np.full_like(column, np.inf)),
        ("node.key", lambda column: column * 0),
        ("node.key", lambda column: column + 1),
        ("node.activation", lambda column: column + len(ACTIVATIONS)),
        ("connection.weight", lambda column: column.astype(np.float32)),
        ("connection.source", lambda column: column + 1000),
        ("connection.source", lambda column: column - 1000),
        ("connection.source", lambda column: np.where(column >= 0, 0, column)),
        ("connection.target", lambda column: column[::-1].copy()),
        ("connection.innovation", lambda column: column.reshape(1, -1)),
    ],
)
def test_columns_that_make_no_genomes_are_refused(name: str, value: Any) -> None:
    problem = problem_of(EvolutionSettings(), POPULATION)
    plain, arrays = begun(problem, 3)[0].state()
    changed = {**arrays, f"current.0.{name}": value(arrays[f"current.0.{name}"])}
    with pytest.raises(ValueError):
        Coevolution(problem, (plain, changed))
    del changed[f"current.0.{name}"]
    with pytest.raises(KeyError, match=name):
        Coevolution(problem, (plain, changed))
