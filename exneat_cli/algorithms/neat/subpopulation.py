"""One NEAT population with configuration, counters and random state of its own."""

from __future__ import annotations

import math
import random
from collections.abc import Mapping, Sequence
from typing import Any

import neat
from neat.reporting import ReporterSet
from neat.species import Species
from numpy.random import SeedSequence

from exneat_cli.algorithms.neat.conversion import from_stock
from exneat_cli.algorithms.neat.counter import Counter
from exneat_cli.algorithms.neat.genome import ArrayGenome, ArrayGenomeConfig
from exneat_cli.algorithms.neat.lent_chance import lent_to_neat
from exneat_cli.algorithms.neat.soundness import check_genome

_LARGEST_ID = 2**62


class Subpopulation:
    """What `neat.Population` is, turned inside out: the caller evaluates, this class only evolves.

    neat-python draws from Python's global generator. Each subpopulation has a generator of its own and
    lends it to neat-python while it works, so neither subpopulations nor threads disturb one another.

    Args:
        config: for this subpopulation alone; two of them must not share one.
        seed: of its random numbers.

    Attributes:
        genomes: the current generation by id, in neat-python's order; of the configuration's class.
    """

    def __init__(self, config: neat.Config, seed: SeedSequence) -> None:
        self._equip(config)
        self._chance.seed(int.from_bytes(seed.generate_state(8).tobytes(), "little"))
        self._generation = 0
        with lent_to_neat(self._chance):
            self.genomes: dict[int, Any] = self._create()
            self._species.speciate(config, self.genomes, self._generation)

    def _equip(self, config: neat.Config) -> None:
        self.config = config
        self._chance = random.Random()
        if isinstance(config.genome_config, ArrayGenomeConfig):
            config.genome_config.chance = self._chance
        reporters = ReporterSet()
        stagnation = config.stagnation_type(config.stagnation_config, reporters)
        self._reproduction = config.reproduction_type(config.reproduction_config, reporters, stagnation)
        self._reproduction.genome_indexer = Counter(1)
        self._species = config.species_set_type(config.species_set_config, reporters)
        self._species.indexer = Counter(1)

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
        with lent_to_neat(self._chance):
            self.genomes = self._reproduction.reproduce(
                self.config, self._species, self.config.pop_size, self._generation
            )
            extinct = not self._species.species
            if extinct:
                self.genomes = self._create()
            self._species.speciate(self.config, self.genomes, self._generation)
        # neat-python keeps every genome's parents for ever, and asks for none of them.
        self._reproduction.ancestors.clear()
        self._generation += 1
        return extinct

    def state(self) -> dict[str, Any]:
        """All but the genomes, as numbers, strings, lists and dicts; changes nothing."""
        version, words, next_gauss = self._chance.getstate()
        return {
            "generation": self._generation,
            "random": [version, list(words), next_gauss],
            "generator": getattr(self.config.genome_config, "generator_state", None),
            "next_genome": self._reproduction.genome_indexer.following,
            "next_species": self._species.indexer.following,
            "next_node": self.config.genome_config.node_indexer.following,
            "last_innovation": self._reproduction.innovation_tracker.global_counter,
            "species": [
                {
                    "id": species.key,
                    "created": species.created,
                    "last_improved": species.last_improved,
                    "fitness_history": list(species.fitness_history),
                    "representative": species.representative.key,
                    "members": list(species.members),
                }
                for species in self._species.species.values()
            ],
        }

    @classmethod
    def restored(cls, config: neat.Config, state: Mapping[str, Any], genomes: Sequence[Any]) -> Subpopulation:
        """The subpopulation whose `state` this was, with these genomes in this order.

        Args:
            config: as new.
            state: from `state`, or from a file of anyone's.
            genomes: of the configuration's class.

        Raises:
            AttributeError, KeyError, OverflowError, TypeError, ValueError: the state is none, or does not fit.
        """
        subpopulation = cls.__new__(cls)
        subpopulation._equip(config)
        if len(genomes) != config.pop_size:
            raise ValueError(f"expected {config.pop_size} genomes, got {len(genomes)}")
        subpopulation.genomes = {genome.key: genome for genome in genomes}
        subpopulation._generation = int(state["generation"])
        version, words, next_gauss = state["random"]
        gauss = None if next_gauss is None else float(next_gauss)
        subpopulation._chance.setstate((int(version), tuple(words), gauss))
        genome_config = config.genome_config
        genome_config.innovation_tracker = subpopulation._reproduction.innovation_tracker
        genome_config.innovation_tracker.global_counter = int(state["last_innovation"])
        genome_config.node_indexer = Counter(int(state["next_node"]))
        if state["generator"] is not None:
            genome_config.go_on_from(state["generator"])
        subpopulation._reproduction.genome_indexer = Counter(int(state["next_genome"]))
        subpopulation._species.indexer = Counter(int(state["next_species"]))
        subpopulation._restore_species(state["species"])
        subpopulation._check(state)
        return subpopulation

    def _check(self, state: Mapping[str, Any]) -> None:
        """Refuse genomes that make no network here, and ids that are about to be given a second time."""
        genome_config = self.config.genome_config
        arrays = [self.in_arrays(key) for key in self.genomes]
        for genome in arrays:
            check_genome(
                genome,
                genome_config.num_inputs,
                genome_config.num_outputs,
                feed_forward=genome_config.feed_forward,
            )
        highest = {
            "next_genome": max(self.genomes),
            "next_species": max(self._species.species),
            "next_node": max(int(genome.nodes["key"].max()) for genome in arrays),
            "last_innovation": max(int(genome.connections["innovation"].max(initial=0)) for genome in arrays) - 1,
        }
        for name, key in highest.items():
            if not key < state[name] < _LARGEST_ID:
                raise ValueError(f"{name}: expected more than {key}, got {state[name]}")
        if not 0 <= self._generation < _LARGEST_ID:
            raise ValueError(f"generation: expected at least 0, got {self._generation}")

    def _restore_species(self, entries: Sequence[Mapping[str, Any]]) -> None:
        for entry in entries:
            species = Species(int(entry["id"]), int(entry["created"]))
            species.last_improved = int(entry["last_improved"])
            species.fitness_history = [float(fitness) for fitness in entry["fitness_history"]]
            if not all(map(math.isfinite, species.fitness_history)) or species.key in self._species.species:
                raise ValueError(f"species {species.key}: comes twice, or its fitness is not finite")
            if not entry["members"]:
                raise ValueError(f"species {species.key}: expected members")
            members = {int(key): self.genomes[int(key)] for key in entry["members"]}
            species.update(self.genomes[int(entry["representative"])], members)
            self._species.species[species.key] = species
        placed = sorted(key for species in self._species.species.values() for key in species.members)
        if placed != sorted(self.genomes):
            raise ValueError("expected every genome in one species")
        self._species.genome_to_species = {
            key: species.key for species in self._species.species.values() for key in species.members
        }

    def _create(self) -> dict[int, Any]:
        genomes: dict[int, Any] = self._reproduction.create_new(
            self.config.genome_type, self.config.genome_config, self.config.pop_size
        )
        return genomes
