"""One NEAT population with its own configuration, counters and random state."""

from __future__ import annotations

import math
import random
from collections.abc import Iterable, Mapping
from typing import Any

import neat
import numpy as np
from neat.reporting import ReporterSet
from neat.species import DefaultSpeciesSet, Species
from numpy.random import PCG64, Generator, SeedSequence

from exneat_cli.algorithms.algorithm import State
from exneat_cli.algorithms.neat.conversion import Columns, from_stock, pack, unpack
from exneat_cli.algorithms.neat.genome import ArrayGenome
from exneat_cli.algorithms.neat.neat_python import (
    LARGEST_ID,
    RankedParents,
    SteadyReproduction,
    counter,
    drawing_from,
    peek,
)
from exneat_cli.algorithms.neat.settings import LEAST_SENSITIVITY
from exneat_cli.seeding import generator_in
from exneat_cli.wiring import Moments


class Subpopulation:
    """A counterpart of `neat.Population` that only evolves; the caller evaluates.

    Subpopulations and threads do not affect one another: each subpopulation draws from its own generators.

    Args:
        config: from `neat_config`, for this subpopulation only.
        seed: seed of its random numbers.

    Attributes:
        genomes: the current generation by id, in neat-python's order; instances of the configuration's class.
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
        self._chance = RankedParents() if config.genome_config.parent_selection == "rank" else random.Random()
        reporters = ReporterSet()
        stagnation = neat.DefaultStagnation(config.stagnation_config, reporters)
        self._reproduction = SteadyReproduction(config.reproduction_config, reporters, stagnation)
        self._species = DefaultSpeciesSet(config.species_set_config, reporters)
        self._species.indexer = counter(1)
        self._generation = 0

    def _create(self) -> dict[int, Any]:
        config = self.config
        return self._reproduction.create_new(config.genome_type, config.genome_config, config.pop_size)

    @property
    def species_count(self) -> int:
        """Number of species in the current generation."""
        return len(self._species.species)

    @property
    def first_parents(self) -> dict[int, int]:
        """Ids of the last generation's offspring -> ids of their first parents."""
        return self._reproduction.first_parents

    def in_arrays(self, key: int) -> ArrayGenome:
        """The genome with this id, converted to arrays if necessary."""
        genome: ArrayGenome = self.genomes[key] if self._in_arrays else from_stock(self.genomes[key])
        return genome

    def advance(self, fitness: Mapping[int, float], sensed: Moments | None = None) -> bool:
        """Replace the generation, based on the fitness of each genome, by id; returns whether all species had died out.

        Safe mutations are scaled by the values `sensed` at the pins, see `EvolutionSettings`; None scales none.
        """
        if sensed is not None:
            root_mean_square = np.sqrt(sensed.means**2 + sensed.squares / np.maximum(sensed.counts, 1.0))
            at_least = np.maximum(root_mean_square, LEAST_SENSITIVITY)
            self.config.genome_config.sensitivity = np.where(sensed.counts > 0.0, at_least, 1.0)
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
        """Everything on which it depends; the names of columns begin with `prefix`. Has no side effects."""
        version, words, next_gauss = self._chance.getstate()
        generator = self.config.genome_config.generator
        plain = {
            "generation": self._generation,
            "random": [version, list(words), next_gauss],
            "generator": None if generator is None else dict(generator.bit_generator.state),
            "next_genome": peek(self._reproduction.genome_indexer),
            "next_species": peek(self._species.indexer),
            "next_node": peek(self.config.genome_config.node_indexer),
            "next_innovation": self._reproduction.innovation_tracker.global_counter + 1,
            "species": [
                {name: getattr(species, name) for name in ("key", "created", "last_improved")}
                | {"representative": species.representative.key, "members": list(species.members)}
                | {"fitness_history": list(species.fitness_history)}
                for species in self._species.species.values()
            ],
        }
        return plain, pack(list(self.genomes.values()), prefix)

    @classmethod
    def restored(cls, config: neat.Config, state: State, prefix: str) -> Subpopulation:
        """The subpopulation in `state`, which may come from an untrusted file; `config` must be a new one.

        Raises:
            AttributeError, KeyError, OverflowError, TypeError, ValueError: the state is invalid or does not fit.
        """
        plain, columns = state
        own, items = cls.__new__(cls), config.genome_config
        own._equip(config)
        shape = items.num_inputs, items.num_hidden, items.num_outputs
        genomes = unpack(columns, prefix, shape, feed_forward=items.feed_forward, stock=not own._in_arrays)
        if (items.mutation == "adaptive") != (f"{prefix}.power" in columns):
            raise ValueError(f"{prefix}.power: expected mutation powers where mutation is adaptive, and only there")
        if len(genomes) != config.pop_size:
            raise ValueError(f"expected {config.pop_size} genomes, got {len(genomes)}")
        own.genomes = {genome.key: genome for genome in genomes}
        version, words, next_gauss = plain["random"]
        own._chance.setstate((int(version), tuple(words), None if next_gauss is None else float(next_gauss)))
        if own._in_arrays:
            items.generator = generator_in(plain["generator"])
        own._restore_species(plain["species"])
        own._restore_counters(plain, columns, prefix)
        return own

    def _restore_species(self, entries: Iterable[Mapping[str, Any]]) -> None:
        there = self._species.species
        for entry in entries:
            species = Species(int(entry["key"]), int(entry["created"]))
            species.last_improved = int(entry["last_improved"])
            species.fitness_history = [float(fitness) for fitness in entry["fitness_history"]]
            if not all(map(math.isfinite, species.fitness_history)):
                raise ValueError(f"species {species.key}: expected finite fitness, got {species.fitness_history}")
            if species.key in there or not entry["members"]:
                raise ValueError(f"species {species.key}: comes twice, or has no members")
            members = {int(key): self.genomes[int(key)] for key in entry["members"]}
            species.update(self.genomes[int(entry["representative"])], members)
            there[species.key] = species
            self._species.genome_to_species |= dict.fromkeys(members, species.key)
        if sorted(key for species in there.values() for key in species.members) != sorted(self.genomes):
            raise ValueError("expected every genome in one species")

    def _restore_counters(self, plain: Mapping[str, Any], columns: Columns, prefix: str) -> None:
        """Restore the counters after genomes and species, which they must be ahead of."""
        given = {
            "generation": -1,
            "next_genome": max(self.genomes),
            "next_species": max(self._species.species),
            "next_node": columns[f"{prefix}.node.key"].max(),
            "next_innovation": columns[f"{prefix}.connection.innovation"].max(initial=0),
        }
        for name, last in given.items():
            if not last < plain[name] < LARGEST_ID:
                raise ValueError(f"{name}: expected more than {last}, got {plain[name]}")
        self._generation = int(plain["generation"])
        self._reproduction.genome_indexer = counter(plain["next_genome"])
        self._reproduction.innovation_tracker.global_counter = plain["next_innovation"] - 1
        self._species.indexer = counter(plain["next_species"])
        self.config.genome_config.node_indexer = counter(plain["next_node"])
