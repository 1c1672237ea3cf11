"""All code that depends on internals of neat-python 2.0.0, except for the restoring of species in `Subpopulation`.

neat-python's species, stagnation and reproduction stay in charge. What is changed, and why:

* its random numbers come from Python's global generator, from which any thread may draw: `drawing_from`;
* its reproduction aborts with many species, and gives every genome hidden nodes of its own: `SteadyReproduction`;
* its counters cannot be read: `counter` and `peek`;
* its configuration can only be read from an INI file: `neat_config`, and `config_text`, which writes such a file.
"""

from __future__ import annotations

import copy
import dataclasses
import itertools
import random
import tempfile
import threading
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import neat
import neat.attributes
import neat.genes
import neat.genome
import neat.reproduction
import numpy as np
from neat.reporting import ReporterSet
from neat.species import DefaultSpeciesSet

from exneat_cli.algorithms.neat.genome import ArrayGenome
from exneat_cli.algorithms.neat.settings import STOCK, EvolutionSettings
from exneat_cli.interruption import uninterrupted

LARGEST_ID = 2**62
"""Upper bound, never reached, of all ids, keys and innovation numbers."""

_GENOMES = {"array": ArrayGenome, "stock": neat.DefaultGenome}
_DRAWN = [
    (module, name, value)
    for module in (neat.attributes, neat.genes, neat.genome, neat.reproduction)
    for name, value in vars(module).items()
    if value is random or getattr(value, "__self__", None) is random.random.__self__  # type: ignore[attr-defined]
]
"""The names in neat-python's modules that refer to `random` or to a method of its global generator."""
_DRAWING = threading.Lock()
_FIXED = """
weight_init_mean=0 bias_init_mean=0 enabled_default=True single_structural_mutation=False
response_init_mean=1 response_init_stdev=0 response_min_value=-1 response_max_value=1
response_mutate_rate=0 response_replace_rate=0 response_mutate_power=0
activation_mutate_rate=0 aggregation_default=sum aggregation_options=sum aggregation_mutate_rate=0
"""
"""Items of a genome that no setting changes. By default, `single_structural_mutation` is the text "false", which
neat-python treats as true."""


_OURS = (
    *("positive_start", "mutation", "weight_mutate_power_min", "weight_mutate_power_max"),
    *("crossover", "crossover_prob", "parent_selection"),
)
"""Settings of genomes that neat-python does not have."""


class RankedParents(random.Random):
    """Python's generator, but `choice` favours early items: the first of n has a chance of about 2 / n.

    With it neat-python chooses parents, from a list with the best first, and nothing else if genomes are in arrays. To
    take the better of two uniform draws is linear ranking (Blickle and Thiele, "A comparison of selection schemes used
    in evolutionary algorithms", Evolutionary Computation 4(4), 1996).
    """

    def choice(self, seq: Any) -> Any:
        """One item of `seq`."""
        return seq[min(self.randrange(len(seq)), self.randrange(len(seq)))]


@contextmanager
def drawing_from(chance: random.Random) -> Iterator[None]:
    """Within the block, neat-python draws from `chance` instead of Python's global generator.

    Other threads (such as dask's) may draw from the global one at any time, even while genomes reproduce. Only one
    training at a time may enter. Signals are deferred, see `uninterrupted`.
    """
    with uninterrupted(), _DRAWING:
        try:
            for module, name, drawn in _DRAWN:
                setattr(module, name, chance if drawn is random else getattr(chance, drawn.__name__))
            yield
        finally:
            for module, name, drawn in _DRAWN:
                setattr(module, name, drawn)


def counter(following: int) -> Iterator[int]:
    """Whole numbers from `following` on, like `itertools.count`, but readable by `peek`."""
    return iter(range(following, LARGEST_ID))


def peek(numbers: Iterator[int]) -> int:
    """The next number of a `counter`, without taking it."""
    return next(copy.copy(numbers))


class SteadyReproduction(neat.DefaultReproduction):  # type: ignore[misc]
    """neat-python's reproduction, for any number of species, from homologous first genomes."""

    def __init__(self, config: Any, reporters: ReporterSet, stagnation: Any) -> None:
        super().__init__(config, reporters, stagnation)
        self.genome_indexer = counter(1)
        self.first_parents: dict[int, int] = {}  # of the last generation's offspring

    def create_new(self, genome_type: Any, genome_config: Any, num_genomes: int) -> dict[int, Any]:
        """Initial genomes by id, whose initial hidden nodes have the same keys.

        neat-python continues to count from genome to genome. For crossover and distance, genomes would then have no
        hidden nodes in common, and every genome would found a species of its own.
        """
        first, hidden = genome_config.num_outputs, genome_config.num_hidden
        later_nodes = genome_config.node_indexer or counter(first + hidden)
        genome_config.node_indexer = itertools.cycle(range(first, first + hidden))
        genomes: dict[int, Any] = super().create_new(genome_type, genome_config, num_genomes)
        genome_config.node_indexer = later_nodes
        if issubclass(genome_type, neat.DefaultGenome):
            for genome in genomes.values():
                for key in genome_config.output_keys:
                    genome.nodes[key].activation = genome_config.output_activation
                for gene in genome.connections.values() if genome_config.positive_start else ():
                    gene.weight = abs(gene.weight)
        return genomes

    def reproduce(
        self, config: neat.Config, species: DefaultSpeciesSet, pop_size: int, generation: int
    ) -> dict[int, Any]:
        """The next generation by id, after elitism and minimum species size have been adjusted.

        neat-python aborts a run when its species may together claim more than the population, so both are reduced if
        necessary. Elitism is also raised until all species together keep `survivors` genomes.
        """
        configured = self.reproduction_config
        elitism, min_species_size = configured.elitism, configured.min_species_size
        share = pop_size // len(species.species)
        sizes = [len(each.members) for each in species.species.values()]
        least = next(k for k in range(pop_size + 1) if sum(min(k, size) for size in sizes) >= configured.survivors)
        configured.elitism = min(max(elitism, least), share)
        configured.min_species_size = min(min_species_size, share)
        try:
            genomes: dict[int, Any] = super().reproduce(config, species, pop_size, generation)
        finally:
            configured.elitism, configured.min_species_size = elitism, min_species_size
        self.first_parents = {key: parents[0] for key, parents in self.ancestors.items() if parents}
        # neat-python would keep every genome's parents for ever, without using them.
        self.ancestors.clear()
        return genomes

    def _adjust_spawn_exact(self, spawn_amounts: list[int], pop_size: int, min_species_size: int) -> list[int]:
        # neat-python removes one genome from each species, and aborts the run if that is not enough.
        amounts = list(spawn_amounts)
        while sum(amounts) > pop_size:
            for index in sorted(range(len(amounts)), key=lambda index: -amounts[index]):
                if sum(amounts) > pop_size and amounts[index] > min_species_size:
                    amounts[index] -= 1
        adjusted: list[int] = super()._adjust_spawn_exact(amounts, pop_size, min_species_size)
        return adjusted


def neat_config(
    settings: EvolutionSettings, population: int, shape: tuple[int, int, int], survivors: int = 0
) -> neat.Config:
    """A neat-python configuration for one subpopulation, as `neat.Config` would read it from a file.

    `shape` is inputs, initial hidden nodes and outputs; at least `survivors` genomes survive each generation. Its
    `genome_config` has further attributes: our own settings; `generator`, from which array genomes draw, and which must
    be set before they are made; and `sensitivity`, (inputs,), by which shifts of weights are divided.
    """
    inputs, hidden, outputs = shape
    config = neat.Config.__new__(neat.Config)
    config.pop_size, config.genome_type = population, _GENOMES[settings.genome]
    config.species_set_type, config.stagnation_type = DefaultSpeciesSet, neat.DefaultStagnation
    config.reproduction_type = SteadyReproduction
    # Only neat-python's own `Population` asks for these.
    config.fitness_criterion, config.fitness_threshold, config.no_fitness_termination = "max", 0.0, True
    config.reset_on_extinction, config.seed, config.config_information = True, None, None
    config.species_set_config = _parsed(DefaultSpeciesSet, settings, ["compatibility_threshold"])
    config.stagnation_config = _parsed(
        neat.DefaultStagnation, settings, ["max_stagnation", "species_elitism"], species_fitness_func="max"
    )
    config.reproduction_config = _parsed(
        SteadyReproduction, settings, ["elitism", "survival_threshold", "min_species_size"]
    )
    config.reproduction_config.survivors = survivors
    config.genome_config = _parsed(
        neat.DefaultGenome,
        settings,
        vars(settings),  # it ignores those that it does not know
        **dict(item.split("=") for item in _FIXED.split()),
        num_inputs=inputs,
        num_hidden=hidden,
        num_outputs=outputs,
        activation_options=settings.activation_default,
        weight_min_value=-settings.weight_max_value,
        bias_min_value=-settings.bias_max_value,
    )
    config.genome_config.generator, config.genome_config.sensitivity = None, np.ones(inputs)
    for name in _OURS:
        setattr(config.genome_config, name, getattr(settings, name))
    config.genome_config.output_activation = settings.output_activation or settings.activation_default
    return config


def config_text(settings: EvolutionSettings, shape: tuple[int, int, int]) -> str:
    """The configuration as the text of a neat-python file, without the settings that neat-python does not have.

    `shape` is inputs, initial hidden nodes and outputs. The population, which neat-python also requires, is 100.
    """
    config = neat_config(dataclasses.replace(settings, genome="stock", **STOCK), 100, shape)
    config.reproduction_type = neat.DefaultReproduction
    config.genome_config.activation_options = sorted(
        {settings.activation_default, config.genome_config.output_activation}
    )
    with tempfile.TemporaryDirectory() as directory:
        path = Path(directory) / "config.ini"
        config.save(str(path))
        return path.read_text("utf-8")


def _parsed(kind: Any, settings: EvolutionSettings, names: Iterable[str], **others: object) -> Any:
    """The configuration that `kind` parses from some settings and others, all passed as text, as from a file."""
    items = {name: getattr(settings, name) for name in names} | others
    return kind.parse_config({name: str(value) for name, value in items.items()})
