"""neat-python draws from the generator that it is lent, whoever else draws from Python's own."""

from __future__ import annotations

import importlib
import pkgutil
import random
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import neat
import pytest

from exneat_cli.algorithms import EvolutionSettings
from exneat_cli.algorithms.neat.lent_chance import drawing_names, draws, lent_to_neat
from exneat_cli.algorithms.neat.settings import neat_config
from exneat_cli.algorithms.neat.subpopulation import Subpopulation
from exneat_cli.seeding import stream
from tests.algorithms.neat.genomes import genes_of

NOT_USED = {"neat.checkpoint", "neat.parallel", "neat.population"}
"""Parts of neat-python that draw, and that exneat does without."""


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


def test_every_module_of_neat_that_draws_is_known() -> None:
    found = set()
    for module in pkgutil.iter_modules(neat.__path__, "neat."):
        if any(draws(value) for value in vars(importlib.import_module(module.name)).values()):
            found.add(module.name)
    assert found - NOT_USED == {module.__name__ for module, _ in drawing_names()}


def test_neat_draws_from_what_it_is_lent_and_from_pythons_generator_again_afterwards() -> None:
    known = drawing_names()
    before = [getattr(module, name) for module, name in known]
    with lent_to_neat(random.Random(1)):
        assert drawing_names() == []
        assert neat.genome.random() == random.Random(1).random()
    assert drawing_names() == known
    assert [getattr(module, name) for module, name in known] == before


@pytest.mark.parametrize("genome", ["array", "stock"])
def test_threads_that_draw_from_pythons_generator_change_nothing(ant_settings: EvolutionSettings, genome: str) -> None:
    def evolved() -> list[object]:
        settings = replace(ant_settings, genome=genome)
        subpopulation = Subpopulation(neat_config(settings, 30, (4, 3, 2)), stream(0, "evolution", 0))
        for generation in range(6):
            subpopulation.advance({key: float((key * 7 + generation) % 11) for key in subpopulation.genomes})
        return [genes_of(subpopulation.in_arrays(key)) for key in subpopulation.genomes]

    alone = evolved()
    with somebody_who_draws():
        assert evolved() == alone
