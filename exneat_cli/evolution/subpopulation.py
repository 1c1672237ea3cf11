"""One NEAT population with configuration, counters and random state of its own."""

from __future__ import annotations

import random
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import neat
from neat.reporting import ReporterSet
from numpy.random import SeedSequence

from exneat_cli.evolution.array_genome import ArrayGenome
from exneat_cli.evolution.conversion import from_stock

_GLOBAL_RANDOM_STATE = threading.Lock()
"""Held while a subpopulation lends its state, so that two trainings in one process keep apart."""


class Subpopulation:
    """What `neat.Population` is, turned inside out: the caller evaluates, this class only evolves.

    neat-python draws from Python's global random state. Each subpopulation keeps a state of its own and
    lends it to neat-python only while it works, so subpopulations do not disturb one another, and the
    caller's random numbers stay as they were.

    Args:
        config: for this subpopulation alone; two of them must not share one.
        seed: of its random state.

    Attributes:
        genomes: the current generation by id, in neat-python's order; of the configuration's class.
    """

    def __init__(self, config: neat.Config, seed: SeedSequence) -> None:
        self.config = config
        self._random_state = random.Random(int.from_bytes(seed.generate_state(8).tobytes(), "little")).getstate()
        reporters = ReporterSet()
        stagnation = config.stagnation_type(config.stagnation_config, reporters)
        self._reproduction = config.reproduction_type(config.reproduction_config, reporters, stagnation)
        self._species = config.species_set_type(config.species_set_config, reporters)
        self._generation = 0
        with self._own_random_state():
            self.genomes: dict[int, Any] = self._create()
            self._species.speciate(config, self.genomes, self._generation)

    @property
    def species_count(self) -> int:
        """Number of species in the current generation."""
        return len(self._species.species)

    def in_arrays(self, key: int) -> ArrayGenome:
        """The genome with this id, whatever the configuration's class is."""
        genome = self.genomes[key]
        return genome if isinstance(genome, ArrayGenome) else from_stock(genome)

    def advance(self, fitness: Mapping[int, float]) -> bool:
        """Replace the generation by the next one; returns whether all species had died out.

        Args:
            fitness: of every current genome, by id.
        """
        for key, genome in self.genomes.items():
            genome.fitness = fitness[key]
        with self._own_random_state():
            self.genomes = self._reproduction.reproduce(
                self.config, self._species, self.config.pop_size, self._generation
            )
            extinct = not self._species.species
            if extinct:
                self.genomes = self._create()
            self._species.speciate(self.config, self.genomes, self._generation)
        self._generation += 1
        return extinct

    def _create(self) -> dict[int, Any]:
        genomes: dict[int, Any] = self._reproduction.create_new(
            self.config.genome_type, self.config.genome_config, self.config.pop_size
        )
        return genomes

    @contextmanager
    def _own_random_state(self) -> Iterator[None]:
        with _GLOBAL_RANDOM_STATE:
            callers = random.getstate()
            random.setstate(self._random_state)
            try:
                yield
            finally:
                self._random_state = random.getstate()
                random.setstate(callers)
