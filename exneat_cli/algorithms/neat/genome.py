"""neat-python's genome with its genes in two tables and with compiled operators.

Rules and probabilities are the same, random numbers are not: neat-python's species, stagnation and reproduction remain
in charge and see no difference except in speed. Every `config` in a method is the `genome_config` of `neat_config`.
"""

from __future__ import annotations

import math
from operator import attrgetter
from typing import Any

import numpy as np
from neat.genome import DefaultGenomeConfig
from numpy.random import Generator
from numpy.typing import NDArray

from exneat_cli.algorithms.neat.genes import (
    ACTIVATIONS,
    CONNECTION,
    NODE,
    Connections,
    Genes,
    Nodes,
    Number,
    cross,
    draw,
    end_to_end,
    genetic_distance,
    mutate_attributes,
    row_of,
    would_close_a_cycle,
)

_ITEMS = ("init_mean", "init_stdev", "mutate_rate", "replace_rate", "mutate_power", "min_value", "max_value")
_NUMBERS = {name: attrgetter(*(f"{name}_{item}" for item in _ITEMS)) for name in ("weight", "bias", "response")}


def number(config: DefaultGenomeConfig, name: str) -> Number:
    """How the attribute ``weight``, ``bias`` or ``response`` starts and changes."""
    values: Number = _NUMBERS[name](config)
    return values


class ArrayGenome:
    """A genome that neat-python's reproduction and species accept in place of `neat.DefaultGenome`.

    Attributes:
        key: its id.
        fitness: None until it is known.
        nodes: (N,) of type `NODE`, sorted; not changed in place after reproduction.
        connections: (C,) of type `CONNECTION`, likewise.
        power: its own `weight_mutate_power` if mutation is adaptive, else None.
    """

    __slots__ = ("connections", "fitness", "key", "nodes", "power")

    def __init__(self, key: int, nodes: Nodes | None = None, connections: Connections | None = None) -> None:
        self.key = key
        self.fitness: Any = None
        self.nodes = np.zeros(0, NODE) if nodes is None else nodes
        self.connections = np.zeros(0, CONNECTION) if connections is None else connections
        self.power: float | None = None

    @property
    def genes(self) -> Genes:
        """Nodes and connections."""
        return self.nodes, self.connections

    def configure_new(self, config: DefaultGenomeConfig) -> None:
        """Make an initial genome."""
        rng = config.generator
        self.nodes = np.zeros(config.num_outputs + config.num_hidden, NODE)
        self.nodes["key"] = np.arange(self.nodes.size)
        self.nodes["bias"] = _initial(number(config, "bias"), self.nodes.size, rng)
        self.nodes["response"] = _initial(number(config, "response"), self.nodes.size, rng)
        self.nodes["activation"] = ACTIVATIONS.index(config.activation_default)
        self.nodes["activation"][: config.num_outputs] = ACTIVATIONS.index(config.output_activation)
        self.connections = _initial_connections(config)
        weights = _initial(number(config, "weight"), self.connections.size, rng)
        self.connections["weight"] = np.abs(weights) if config.positive_start else weights
        if config.mutation == "adaptive":
            self.power = config.weight_mutate_power

    def configure_crossover(self, genome1: ArrayGenome, genome2: ArrayGenome, config: DefaultGenomeConfig) -> None:
        """Make a child; of equally fit parents, the second one counts as fitter, as in neat-python.

        With probability 1 - `crossover_prob` it is a copy of the first parent, regardless of fitness. A child of two
        parents has the geometric mean of their mutation powers.
        """
        if config.crossover_prob < 1.0 and config.generator.random() >= config.crossover_prob:
            self.nodes, self.connections, self.power = genome1.nodes.copy(), genome1.connections.copy(), genome1.power
            return
        if genome1.power is not None and genome2.power is not None:
            self.power = math.sqrt(genome1.power * genome2.power)
        fitter, other = (genome1, genome2) if genome1.fitness > genome2.fitness else (genome2, genome1)
        self.nodes, self.connections = cross(fitter.genes, other.genes, config.crossover == "average", config.generator)

    def mutate(self, config: DefaultGenomeConfig) -> None:
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
            self.connections = _without(self.connections, int(rng.integers(self.connections.size)))
        disable_rate = config.enabled_mutate_rate + config.enabled_rate_to_false_add
        enable_rate = config.enabled_mutate_rate + config.enabled_rate_to_true_add
        scale = self._vary_power(config) if self.power is not None else 1.0
        weight, bias = (_scaled(number(config, name), scale) for name in ("weight", "bias"))
        numbers = weight, bias, number(config, "response")
        mutate_attributes(self.genes, numbers, disable_rate, enable_rate, config.sensitivity, rng)

    def _vary_power(self, config: DefaultGenomeConfig) -> float:
        """Vary the genome's own mutation power; returns its ratio to the initial power of all genomes.

        Log-normal self-adaptation of one step size, with the learning rate 1 / sqrt(n) of n weights and biases
        (Schwefel, "Numerical optimization of computer models", 1981; Beyer and Schwefel, "Evolution strategies",
        Natural Computing 1, 2002, section 4.2). Without a lower bound it would collapse, since small changes do the
        least harm.
        """
        assert self.power is not None
        rate = 1.0 / math.sqrt(self.nodes.size + self.connections.size)
        varied = self.power * math.exp(rate * config.generator.standard_normal())
        self.power = min(max(varied, config.weight_mutate_power_min), config.weight_mutate_power_max)
        return self.power / float(config.weight_mutate_power)

    def _add_node(self, config: DefaultGenomeConfig) -> None:
        """Split a random connection, enabled or not."""
        if not self.connections.size:
            return
        rng, tracker = config.generator, config.innovation_tracker
        row = int(rng.integers(self.connections.size))
        target, source, _, weight, _ = self.connections[row].item()
        key = next(config.node_indexer)
        response, activation = draw(number(config, "response"), rng), ACTIVATIONS.index(config.activation_default)
        self.nodes = _with(self.nodes, self.nodes.size, (key, 0.0, response, activation))
        self.connections["enabled"][row] = False
        into = tracker.get_innovation_number(source, key, "add_node_in")
        out = tracker.get_innovation_number(key, target, "add_node_out")
        self._insert(key, source, into, 1.0)
        self._insert(target, key, out, weight)

    def _delete_node(self, config: DefaultGenomeConfig) -> None:
        hidden = self.nodes.size - config.num_outputs
        if hidden > 0:
            row = config.num_outputs + int(config.generator.integers(hidden))
            key, table = self.nodes["key"][row], self.connections
            self.nodes = _without(self.nodes, row)
            self.connections = table[(table["target"] != key) & (table["source"] != key)]

    def _add_connection(self, config: DefaultGenomeConfig) -> None:
        """Try to connect one random pair of nodes; does nothing if it is connected already or must not be."""
        rng, pins, outputs = config.generator, config.num_inputs, config.num_outputs
        target = int(self.nodes["key"][rng.integers(self.nodes.size)])
        # As in neat-python, new connections lead from pins and hidden nodes, not from outputs.
        chosen = int(rng.integers(pins + self.nodes.size - outputs))
        source = -1 - chosen if chosen < pins else int(self.nodes["key"][outputs + chosen - pins])
        row = row_of(self.connections, target, source)
        if row < self.connections.size and self.connections[row].item()[:2] == (target, source):
            return  # they are connected already
        if config.feed_forward and would_close_a_cycle(self.nodes, self.connections, target, source):
            return
        innovation = config.innovation_tracker.get_innovation_number(source, target, "add_connection")
        self._insert(target, source, innovation, draw(number(config, "weight"), rng))

    def _insert(self, target: int, source: int, innovation: int, weight: float) -> None:
        """Insert a new, enabled connection in its sorted place."""
        row = row_of(self.connections, target, source)
        self.connections = _with(self.connections, row, (target, source, innovation, weight, True))

    def distance(self, other: ArrayGenome, config: DefaultGenomeConfig) -> float:
        """Genetic distance to `other`."""
        disjoint, weight = config.compatibility_disjoint_coefficient, config.compatibility_weight_coefficient
        return float(genetic_distance(self.genes, other.genes, disjoint, weight))

    def size(self) -> tuple[int, int]:
        """Numbers of nodes and of enabled connections."""
        return self.nodes.size, int(np.count_nonzero(self.connections["enabled"]))


def _scaled(number: Number, scale: float) -> Number:
    """The same, with shifts of N(0, power * scale)."""
    mean, sd, shift_rate, replace_rate, power, low, high = number
    return mean, sd, shift_rate, replace_rate, power * scale, low, high


def _with(table: NDArray[np.void], row: int, gene: tuple[float, ...]) -> NDArray[np.void]:
    """A copy with one more gene, in this row."""
    return end_to_end((table[:row], np.array([gene], table.dtype), table[row:]), table.dtype)


def _without(table: NDArray[np.void], row: int) -> NDArray[np.void]:
    """A copy without this row."""
    return end_to_end((table[:row], table[row + 1 :]), table.dtype)


def _initial(number: Number, size: int, rng: Generator) -> NDArray[np.float64]:
    mean, sd, _, _, _, low, high = number
    return np.clip(mean + sd * rng.standard_normal(size), low, high)


def _initial_connections(config: DefaultGenomeConfig) -> Connections:
    """Sorted, enabled connections, numbered and without weights, see `EvolutionSettings.initial_connection`."""
    innovation = config.innovation_tracker.get_innovation_number
    rows = [
        (target, source, innovation(source, target, "initial_connection"), 0.0, True)
        for target, source in sorted(_initial_ends(config))
    ]
    return np.array(rows, CONNECTION)


def _initial_ends(config: DefaultGenomeConfig) -> list[tuple[int, int]]:
    """Target and source of every initial connection."""
    kind, outputs, pins = config.initial_connection, config.output_keys, config.input_keys
    nodes = range(config.num_outputs + config.num_hidden)
    hidden = nodes[config.num_outputs :]
    if kind == "unconnected":
        return []
    if kind.startswith("fs_neat"):
        pin = pins[config.generator.integers(len(pins))]
        return [(node, pin) for node in (nodes if kind == "fs_neat_hidden" else outputs)]
    ends = [(node, pin) for node in hidden for pin in pins]
    ends += [(output, node) for output in outputs for node in hidden]
    if kind == "full_direct" or not hidden:
        ends += [(output, pin) for output in outputs for pin in pins]
    if not config.feed_forward:
        ends += [(node, node) for node in nodes]
    return ends
