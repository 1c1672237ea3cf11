"""One NEAT population with configuration, counters and random state of its own."""

from __future__ import annotations

import random
from collections.abc import Mapping
from typing import Any

import neat
from numpy.random import PCG64, Generator, SeedSequence

from exneat_cli.algorithms.algorithm import State
from exneat_cli.algorithms.neat.conversion import from_stock
from exneat_cli.algorithms.neat.genome import ArrayGenome
from exneat_cli.algorithms.neat.neat_python import LARGEST_ID, drawing_from, machinery, restore, state_of
from exneat_cli.algorithms.neat.packing import pack, unpack
from exneat_cli.seeding import generator_in


class Subpopulation:
    """What `neat.Population` is, turned inside out: the caller evaluates, this class only evolves.

    Neither subpopulations nor threads disturb one another: each subpopulation draws from generators of its own.

    Args:
        config: from `neat_config`, for this subpopulation alone.
        seed: of its random numbers.

    Attributes:
        genomes: the current generation by id, in neat-python's order; of the configuration's class.
    """

    def __init__(self, config: neat.Config, seed: SeedSequence) -> None:
        self._equip(config)
        self._chance.seed(int.from_bytes(seed.generate_state(8).tobytes(), "little"))
        if self._in_arrays:
            config.genome_config.generator = Generator(PCG64(self._chance.getrandbits(128)))
        with drawing_from(self._chance):
            self.genomes = self._create()
            self._species.speciate(config, self.genomes, self._generation)

    def _equip(self, config: neat.Config) -> None:
        self.config = config
        self._in_arrays = config.genome_type is ArrayGenome
        self._chance = random.Random()
        self._reproduction, self._species = machinery(config)
        self._generation = 0

    def _create(self) -> dict[int, Any]:
        config = self.config
        return self._reproduction.create_new(config.genome_type, config.genome_config, config.pop_size)

    @property
    def species_count(self) -> int:
        """Number of species in the current generation."""
        return len(self._species.species)

    def in_arrays(self, key: int) -> ArrayGenome:
        """The genome with this id, whatever the configuration's class is."""
        genome: ArrayGenome = self.genomes[key] if self._in_arrays else from_stock(self.genomes[key])
        return genome

    def advance(self, fitness: Mapping[int, float]) -> bool:
        """Replace the generation by the next one; returns whether all species had died out.

        Args:
            fitness: of every current genome, by id.
        """
        for key, genome in self.genomes.items():
            genome.fitness = fitness[key]
        with drawing_from(self._chance):
            self.genomes = self._reproduction.reproduce(
                self.config, self._species, self.config.pop_size, self._generation
            )
            extinct = not self.genomes
            if extinct:
                self.genomes = self._create()
            self._species.speciate(self.config, self.genomes, self._generation)
        self._generation += 1
        return extinct

    def state(self, prefix: str) -> State:
        """All that it depends on; the names of columns begin with `prefix`. Taking it changes nothing."""
        version, words, next_gauss = self._chance.getstate()
        generator = self.config.genome_config.generator
        plain = {
            "generation": self._generation,
            "random": [version, list(words), next_gauss],
            "generator": None if generator is None else dict(generator.bit_generator.state),
            **state_of(self.config, self._reproduction, self._species),
        }
        return State(plain, pack(list(self.genomes.values()), prefix))

    @classmethod
    def restored(cls, config: neat.Config, state: State, prefix: str) -> Subpopulation:
        """The subpopulation that `state` was taken of, or a file of anyone's, with `config` as new.

        Raises:
            AttributeError, KeyError, OverflowError, TypeError, ValueError: the state is none, or does not fit.
        """
        plain, columns = state
        subpopulation = cls.__new__(cls)
        subpopulation._equip(config)
        items, stock = config.genome_config, not subpopulation._in_arrays
        shape = items.num_inputs, items.num_hidden, items.num_outputs
        genomes = unpack(columns, prefix, shape, feed_forward=items.feed_forward, stock=stock)
        if len(genomes) != config.pop_size:
            raise ValueError(f"expected {config.pop_size} genomes, got {len(genomes)}")
        subpopulation.genomes = {genome.key: genome for genome in genomes}
        subpopulation._generation = int(plain["generation"])
        version, words, next_gauss = plain["random"]
        gauss = None if next_gauss is None else float(next_gauss)
        subpopulation._chance.setstate((int(version), tuple(words), gauss))
        if not stock:
            items.generator = generator_in(plain["generator"])
        restore(config, subpopulation._reproduction, subpopulation._species, plain, subpopulation.genomes)
        given = {
            "generation": -1,
            "next_genome": max(subpopulation.genomes),
            "next_species": max(subpopulation._species.species),
            "next_node": columns[f"{prefix}.node.key"].max(),
            "next_innovation": columns[f"{prefix}.connection.innovation"].max(initial=0),
        }
        for name, last in given.items():
            if not last < plain[name] < LARGEST_ID:
                raise ValueError(f"{name}: expected more than {last}, got {plain[name]}")
        return subpopulation
