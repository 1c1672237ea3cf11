"""What reaches into neat-python: its configuration, its random numbers, and that no run aborts."""

from __future__ import annotations

import importlib
import pkgutil
import random
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import neat
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from exneat_cli.algorithms import RECURRENT, Coevolution, EvolutionSettings, neat_config
from exneat_cli.algorithms.neat.neat_python import _DRAWN, _OURS, SteadyReproduction, counter, drawing_from, peek
from tests.algorithms.neat.genomes import COLUMNS
from tests.algorithms.problems import contents, problem_of, synthetic, tell

UNUSED = {"neat.checkpoint", "neat.parallel", "neat.population"}
"""Modules of neat-python that draw, and that exneat does without."""


def items_of(config: Any) -> dict[str, Any]:
    """Every attribute of a configuration that can be compared, those of its parts included."""
    parts = {name: vars(part) for name, part in vars(config).items() if name.endswith("_config")}
    items = {f"{part}.{name}": value for part, values in parts.items() for name, value in values.items()}
    items |= {name: value for name, value in vars(config).items() if name not in parts}
    ours = (*_OURS, "output_activation", "generator", "sensitivity", "survivors")
    objects = ("_params", "activation_defs", "aggregation_defs", "aggregation_function_defs", "config_information")
    return {name: value for name, value in items.items() if name.split(".")[-1] not in (*ours, *objects)}


@pytest.mark.parametrize("column", COLUMNS)
def test_a_configuration_is_what_neat_python_reads_from_the_file_that_it_saves(tmp_path: Path, column: str) -> None:
    changes = {"weight_init_stdev": 0.1 + 0.2, "enabled_mutate_rate": 1e-17, "neat_hidden": 3}
    config = neat_config(replace(COLUMNS[column], genome="stock", **changes), 50, (105, 6, 8))  # type: ignore[arg-type]
    config.save(tmp_path / "neat.ini")
    kinds = (config.genome_type, config.reproduction_type, config.species_set_type, config.stagnation_type)
    read = neat.Config(*kinds, tmp_path / "neat.ini")
    assert items_of(config) == items_of(read)
    assert len(items_of(read)) > 60


def test_every_setting_reaches_neat_python_under_its_own_name() -> None:
    ours = ("genome", "neat_hidden", "module_hidden", "output_activation", "safe_mutation")
    for settings in COLUMNS.values():
        config = neat_config(settings, 50, (105, 6, 8))
        there = {**vars(config.genome_config), **vars(config.species_set_config)}
        there |= {**vars(config.stagnation_config), **vars(config.reproduction_config)}
        assert {name: there[name] for name in vars(settings) if name not in ours} == {
            name: value for name, value in vars(settings).items() if name not in ours
        }
        assert (there["num_inputs"], there["num_hidden"], there["num_outputs"], config.pop_size) == (105, 6, 8, 50)
        assert (there["weight_min_value"], there["bias_min_value"]) == (-settings.weight_max_value,) * 2
        assert there["single_structural_mutation"] is False


def test_a_counter_can_be_read_without_counting_on() -> None:
    numbers = counter(7)
    assert [peek(numbers), peek(numbers), next(numbers), peek(numbers), next(numbers)] == [7, 7, 7, 8, 8]


def draws(value: object) -> bool:
    return value is random or getattr(value, "__self__", None) is random.random.__self__  # type: ignore[attr-defined]


def test_every_module_of_neat_that_draws_is_known() -> None:
    modules = [importlib.import_module(module.name) for module in pkgutil.iter_modules(neat.__path__, "neat.")]
    found = {module.__name__ for module in modules if any(draws(value) for value in vars(module).values())}
    assert found - UNUSED == {module.__name__ for module, _, _ in _DRAWN}


def test_neat_draws_from_what_it_is_lent_and_from_pythons_generator_again_afterwards() -> None:
    with drawing_from(random.Random(1)):
        assert not any(draws(getattr(module, name)) for module, name, _ in _DRAWN)
        assert neat.genome.random() == random.Random(1).random()
    assert all(getattr(module, name) is drawn and draws(drawn) for module, name, drawn in _DRAWN)


@contextmanager
def somebody_who_draws() -> Iterator[None]:
    done = threading.Event()

    def draw() -> None:
        while not done.is_set():
            random.random()

    thread = threading.Thread(target=draw)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()


@pytest.mark.parametrize("genome", ["array", "stock"])
def test_threads_that_draw_from_pythons_generator_change_nothing(genome: str) -> None:
    def evolved() -> list[object]:
        evolution = Coevolution(problem_of(EvolutionSettings(genome=genome), 30))
        for _ in range(6):
            tell(evolution, [synthetic(team) for team in evolution.ask()[0]])
        return [contents(team.genomes[0]) for team in evolution.ask()[0]]

    alone = evolved()
    with somebody_who_draws():
        assert evolved() == alone


@pytest.mark.parametrize(("column", "shape"), [("recurrent", (2, 0, 1)), ("feed-forward", (4, 4, 2))])
@pytest.mark.parametrize("population", [8, 13, 31, 100])
def test_no_run_aborts_in_fifty_generations(column: str, shape: tuple[int, int, int], population: int) -> None:
    evolution = Coevolution(problem_of(COLUMNS[column], population, 2, shape=shape, seed=population))
    rng = np.random.default_rng(population)
    for generation in range(50):
        teams = evolution.ask()[0]
        assert len(teams) == population
        # Alternating smooth, tied and wild fitness drives the number of species up and down.
        kind = generation % 3
        values = [sum(len(g.connections) for g in team.genomes) for team in teams]
        tell(evolution, [float(v) if kind == 0 else float(kind == 1) * v // 4 + rng.normal() * kind for v in values])


def test_many_species_share_what_the_population_can_give_and_settings_stay() -> None:
    settings = replace(RECURRENT, compatibility_threshold=0.0)
    evolution = Coevolution(problem_of(settings, 30, shape=(2, 0, 1)))
    for generation in range(5):
        teams = evolution.ask()[0]
        assert evolution.columns()["species"] == 30
        tell(evolution, [float(index + generation) for index in range(len(teams))])
    configured = evolution._subpopulations[0].config.reproduction_config
    assert (configured.elitism, configured.min_species_size) == (10, 20)


@given(st.lists(st.integers(1, 60), min_size=1, max_size=20), st.integers(1, 5), st.integers(0, 40))
def test_spawn_amounts_always_add_up_and_respect_the_minimum(amounts: list[int], minimum: int, extra: int) -> None:
    amounts = [max(amount, minimum) for amount in amounts]
    population = minimum * len(amounts) + extra
    adjusted = SteadyReproduction.__new__(SteadyReproduction)._adjust_spawn_exact(amounts, population, minimum)
    assert sum(adjusted) == population
    assert min(adjusted) >= minimum
    assert len(adjusted) == len(amounts)
