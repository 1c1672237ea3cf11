"""neat-python's genome with its genes in arrays and its operators compiled.

Same rules, same chances, other random numbers: neat-python's species, stagnation and reproduction stay in
charge and see no difference but speed.
"""

from __future__ import annotations

import random
from collections.abc import Mapping
from operator import attrgetter
from typing import Any, TextIO

import numpy as np
from neat.genes import DefaultConnectionGene, DefaultNodeGene
from neat.genome import DefaultGenomeConfig
from numpy.random import PCG64, Generator

from exneat_cli.algorithms.neat.counter import Counter
from exneat_cli.algorithms.neat.crossover import cross
from exneat_cli.algorithms.neat.distance import genetic_distance
from exneat_cli.algorithms.neat.genes import ACTIVATIONS, CONNECTION, NODE
from exneat_cli.algorithms.neat.initial_connections import INITIAL_CONNECTIONS, initial_connections
from exneat_cli.algorithms.neat.mutation import Number, draw, mutate_attributes
from exneat_cli.algorithms.neat.structure import (
    is_connected,
    pruned,
    with_connection,
    with_node,
    without_connection,
    without_node,
    would_close_a_cycle,
)
from exneat_cli.errors import ConfigError
from exneat_cli.seeding import generator_in

_FIXED = {
    "initial_connection": INITIAL_CONNECTIONS,
    # Left out it is the string "false", which neat-python's own genomes take for true.
    "single_structural_mutation": ("False", "false"),
    "structural_mutation_surer": ("default", "false"),
    "aggregation_default": ("sum",),
    "aggregation_mutate_rate": ("0.0", "0"),
    "activation_mutate_rate": ("0.0", "0"),
    "activation_default": ACTIVATIONS,
    "enabled_default": ("True", "true", "1", "on", "yes"),
    **dict.fromkeys(("bias_init_type", "response_init_type", "weight_init_type"), ("gaussian", "normal")),
    "time_constant_init_mean": ("1.0", "1"),
    **dict.fromkeys(("time_constant_init_stdev", "time_constant_mutate_rate", "time_constant_replace_rate"), ("0.0",)),
}
"""What neat-python's configuration can say and these genomes cannot do otherwise."""


_ITEMS = ("init_mean", "init_stdev", "mutate_rate", "replace_rate", "mutate_power", "min_value", "max_value")
_NUMBERS = {name: attrgetter(*(f"{name}_{item}" for item in _ITEMS)) for name in ("weight", "bias", "response")}


class ArrayGenomeConfig(DefaultGenomeConfig):  # type: ignore[misc]
    """neat-python's configuration of genomes, and the random numbers that compiled operators draw.

    Args:
        params: the genome's section of the INI file.
        section_name: its name.

    Raises:
        ConfigError: an item asks for what array genomes cannot do.
    """

    positive_start = False
    """Whether initial weights are positive."""
    chance: Any = random
    """What the generator's seed is drawn from: Python's global generator, or a `random.Random`."""

    def __init__(self, params: dict[str, object], section_name: str) -> None:
        super().__init__(params, section_name)
        for name, accepted in _FIXED.items():
            if str(getattr(self, name)) not in accepted:
                fix = "neat.DefaultGenome can do otherwise"
                raise ConfigError(f"[{section_name}] {name}", " or ".join(accepted), getattr(self, name), fix)
        self._generator: Generator | None = None

    @property
    def generator(self) -> Generator:
        """Seeded by `chance` when it is first asked for, so one seed rules both."""
        if self._generator is None:
            self._generator = Generator(PCG64(self.chance.getrandbits(128)))
        return self._generator

    @property
    def generator_state(self) -> dict[str, Any] | None:
        """Of the generator; None before its first use."""
        return None if self._generator is None else dict(self._generator.bit_generator.state)

    def go_on_from(self, generator_state: Mapping[str, Any]) -> None:
        """Draw what a generator in this state would draw next."""
        self._generator = generator_in(generator_state)

    def number(self, name: str) -> Number:
        """How the attribute ``weight``, ``bias`` or ``response`` begins and changes."""
        return Number(*_NUMBERS[name](self))


class ArrayGenome:
    """A genome that `neat.Config` takes in place of `neat.DefaultGenome`.

    Initial hidden nodes have the same keys in every genome, see `HomologousGenome`.

    Args:
        key: its id.

    Attributes:
        fitness: None until it is known.
        nodes: (N,) of kind `NODE`, sorted; never changed in place once the genome is made.
        connections: (C,) of kind `CONNECTION`, likewise.
    """

    __slots__ = ("connections", "fitness", "key", "nodes")

    @classmethod
    def parse_config(cls, param_dict: Mapping[str, object]) -> ArrayGenomeConfig:
        """The configuration from the items of the section that bears the class's name."""
        genes = {"node_gene_type": DefaultNodeGene, "connection_gene_type": DefaultConnectionGene}
        return ArrayGenomeConfig({**param_dict, **genes}, cls.__name__)

    @classmethod
    def write_config(cls, f: TextIO, config: ArrayGenomeConfig) -> None:
        """Write what `parse_config` reads; `neat.Config.save` asks for it."""
        config.save(f)

    def __init__(self, key: int) -> None:
        self.key = key
        self.fitness: float | None = None
        self.nodes = np.zeros(0, NODE)
        self.connections = np.zeros(0, CONNECTION)

    def configure_new(self, config: ArrayGenomeConfig) -> None:
        """Make an initial genome."""
        rng = config.generator
        count_of_nodes = config.num_outputs + config.num_hidden
        config.node_indexer = config.node_indexer or Counter(count_of_nodes)
        self.nodes = np.zeros(count_of_nodes, NODE)
        self.nodes["key"] = np.arange(count_of_nodes)
        self.nodes["bias"] = _initial(config.number("bias"), count_of_nodes, rng)
        self.nodes["response"] = _initial(config.number("response"), count_of_nodes, rng)
        self.nodes["activation"] = ACTIVATIONS.index(config.activation_default)
        self.connections = initial_connections(config, rng)
        weights = _initial(config.number("weight"), len(self.connections), rng)
        self.connections["weight"] = np.abs(weights) if config.positive_start else weights

    def configure_crossover(self, genome1: ArrayGenome, genome2: ArrayGenome, config: ArrayGenomeConfig) -> None:
        """Make a child; of equally fit parents the second one counts as fitter, as in neat-python."""
        assert genome1.fitness is not None
        assert genome2.fitness is not None
        fitter, other = (genome1, genome2) if genome1.fitness > genome2.fitness else (genome2, genome1)
        self.nodes, self.connections = cross(
            fitter.nodes, fitter.connections, other.nodes, other.connections, config.generator
        )

    def mutate(self, config: ArrayGenomeConfig) -> None:
        """Change structure, then attributes."""
        rng = config.generator
        add_node, delete_node, add_connection, delete_connection = rng.random(4)
        if add_node < config.node_add_prob:
            self._add_node(config)
        if delete_node < config.node_delete_prob:
            self._delete_node(config)
        if add_connection < config.conn_add_prob:
            self._add_connection(config)
        if delete_connection < config.conn_delete_prob and self.connections.size:
            self.connections = without_connection(self.connections, int(rng.integers(self.connections.size)))
        disable_rate = config.enabled_mutate_rate + config.enabled_rate_to_false_add
        enabled_mutate_rate = config.enabled_mutate_rate + config.enabled_rate_to_true_add
        numbers = config.number("weight"), config.number("bias"), config.number("response")
        mutate_attributes(self.nodes, self.connections, numbers, disable_rate, enabled_mutate_rate, rng)

    def _add_node(self, config: ArrayGenomeConfig) -> None:
        """Split a random connection, enabled or not."""
        if not self.connections.size:
            return
        rng, tracker = config.generator, config.innovation_tracker
        row = int(rng.integers(self.connections.size))
        target, source, _, weight, _ = self.connections[row].item()
        key = next(config.node_indexer)
        self.nodes = with_node(
            self.nodes, key, 0.0, draw(config.number("response"), rng), ACTIVATIONS.index(config.activation_default)
        )
        self.connections["enabled"][row] = False
        into = tracker.get_innovation_number(source, key, "add_node_in")
        out = tracker.get_innovation_number(key, target, "add_node_out")
        self.connections = with_connection(self.connections, key, source, into, 1.0, True)
        self.connections = with_connection(self.connections, target, key, out, weight, True)

    def _delete_node(self, config: ArrayGenomeConfig) -> None:
        hidden = self.nodes.size - config.num_outputs
        if hidden > 0:
            row = config.num_outputs + int(config.generator.integers(hidden))
            self.nodes, self.connections = without_node(self.nodes, self.connections, row)

    def _add_connection(self, config: ArrayGenomeConfig) -> None:
        """Try one random pair of nodes; nothing happens if it is connected or must not be."""
        rng, outputs = config.generator, config.num_outputs
        target = int(self.nodes["key"][rng.integers(self.nodes.size)])
        chosen = int(rng.integers(config.num_inputs + self.nodes.size - outputs))
        pins = config.num_inputs
        source = -1 - chosen if chosen < pins else int(self.nodes["key"][outputs + chosen - pins])
        if is_connected(self.connections, target, source):
            return
        if config.feed_forward and would_close_a_cycle(self.nodes, self.connections, target, source):
            return
        innovation = config.innovation_tracker.get_innovation_number(source, target, "add_connection")
        weight = draw(config.number("weight"), rng)
        self.connections = with_connection(self.connections, target, source, innovation, weight, True)

    def distance(self, other: ArrayGenome, config: DefaultGenomeConfig) -> float:
        """Genetic distance to `other`."""
        distance: float = genetic_distance(
            self.nodes,
            self.connections,
            other.nodes,
            other.connections,
            config.compatibility_disjoint_coefficient,
            config.compatibility_weight_coefficient,
        )
        return distance

    def size(self) -> tuple[int, int]:
        """Numbers of nodes and of enabled connections."""
        return self.nodes.size, int(np.count_nonzero(self.connections["enabled"]))

    def get_pruned_copy(self, genome_config: DefaultGenomeConfig) -> ArrayGenome:
        """A genome without a key that has only what leads to an output, as neat-python counts it."""
        copy = ArrayGenome(None)  # type: ignore[arg-type]
        copy.nodes, copy.connections = pruned(self.nodes, self.connections, genome_config.num_outputs)
        return copy


def _initial(number: Number, size: int, rng: Generator) -> np.ndarray:
    return np.clip(number.mean + number.sd * rng.standard_normal(size), number.low, number.high)
