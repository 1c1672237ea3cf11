"""No run aborts, however many species there are."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from exneat_cli.algorithms import Coevolution, EvolutionSettings, neat_config
from exneat_cli.algorithms.neat.reproduction import SteadyReproduction
from exneat_cli.seeding import stream

POPULATIONS = (8, 10, 13, 20, 31, 50, 64, 90, 100, 200)


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize(("column", "shape"), [("grid", (2, 0, 1)), ("ant", (4, 4, 2))])
def test_no_run_aborts_in_fifty_generations(
    request: pytest.FixtureRequest, column: str, shape: tuple[int, int, int], seed: int
) -> None:
    settings: EvolutionSettings = request.getfixturevalue(f"{column}_settings")
    population = POPULATIONS[seed % len(POPULATIONS)]
    configs = [neat_config(settings, population, shape) for _ in range(2)]
    seeds = [stream(seed, "evolution", index) for index in range(2)]
    evolution = Coevolution(configs, seeds, stream(seed, "pairing"))
    rng = np.random.default_rng(seed)
    for generation in range(50):
        teams = evolution.ask()
        assert len(teams) == population
        # Alternating smooth, tied and wild fitness drives the number of species up and down.
        kind = generation % 3
        values = [sum(len(g.connections) for g in team.genomes) for team in teams]
        evolution.tell([float(v) if kind == 0 else float(kind == 1) * v // 4 + rng.normal() * kind for v in values])


def test_many_species_share_what_the_population_can_give(grid_settings: EvolutionSettings) -> None:
    settings = EvolutionSettings(**{**vars(grid_settings), "compatibility_threshold": 0.0})
    evolution = Coevolution([neat_config(settings, 30, (2, 0, 1))], [stream(0, "evolution", 0)], stream(0, "pairing"))
    for generation in range(5):
        teams = evolution.ask()
        assert evolution.species_count == 30
        evolution.tell([float(index + generation) for index in range(len(teams))])


@given(
    st.lists(st.integers(1, 60), min_size=1, max_size=20),
    st.integers(1, 5),
    st.integers(0, 40),
)
def test_spawn_amounts_always_add_up_and_respect_the_minimum(amounts: list[int], minimum: int, extra: int) -> None:
    amounts = [max(amount, minimum) for amount in amounts]
    population = minimum * len(amounts) + extra
    reproduction = SteadyReproduction.__new__(SteadyReproduction)
    adjusted = reproduction._adjust_spawn_exact(amounts, population, minimum)
    assert sum(adjusted) == population
    assert min(adjusted) >= minimum
    assert len(adjusted) == len(amounts)


def test_the_configured_elitism_is_back_after_reproduction(grid_settings: EvolutionSettings) -> None:
    config = neat_config(grid_settings, 12, (2, 0, 1))
    evolution = Coevolution([config], [stream(0, "evolution", 0)], stream(0, "pairing"))
    for _ in range(3):
        evolution.tell([0.0] * len(evolution.ask()))
    assert config.reproduction_config.elitism == 10
    assert config.reproduction_config.min_species_size == 20
