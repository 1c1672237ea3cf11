"""Compiled networks against neat-python's own."""

from __future__ import annotations

import random
from collections.abc import Iterator
from contextlib import contextmanager

import neat
import numpy as np
import pytest
from neat.genes import DefaultConnectionGene, DefaultNodeGene

from exneat_cli.algorithms import ArrayGenome, EvolutionSettings, from_stock, neat_config, to_stock
from exneat_cli.brains import assemble
from exneat_cli.brains.brain import activate, lay_out, memory_size
from exneat_cli.errors import ExneatError
from exneat_cli.wiring import Module, Pin, Plan

INPUTS, HIDDEN, OUTPUTS = 5, 3, 3
STEPS = 50


@contextmanager
def global_random(seed: int) -> Iterator[None]:
    state = random.getstate()
    random.seed(seed)
    try:
        yield
    finally:
        random.setstate(state)


def single_module_plan(inputs: int = INPUTS, hidden: int = HIDDEN, outputs: int = OUTPUTS) -> Plan:
    pins = tuple(Pin("sensor", k) for k in range(inputs))
    module = Module("body", (0.0, 0.0), 0, pins, outputs, hidden, tuple(range(outputs)))
    return Plan((module,), inputs, outputs)


def random_genome(seed: int, config: neat.Config, mutations: int) -> ArrayGenome:
    """A genome after many structural mutations, with a quarter of its connections disabled."""
    with global_random(seed):
        config.genome_config.innovation_tracker = neat.innovation.InnovationTracker()
        genome = config.genome_type(1)
        genome.configure_new(config.genome_config)
        for _ in range(mutations):
            genome.mutate(config.genome_config)
        for gene in genome.connections.values():
            gene.enabled = random.random() > 0.25
        for node in genome.nodes.values():
            node.response = random.uniform(-2.0, 2.0)
    return from_stock(genome)


def wild(settings: EvolutionSettings) -> EvolutionSettings:
    rates = {"node_add_prob": 0.6, "node_delete_prob": 0.4, "conn_add_prob": 0.6, "conn_delete_prob": 0.4}
    changes = {**rates, "genome": "stock", "weight_init_stdev": 1.0, "bias_init_stdev": 1.0}
    return EvolutionSettings(**{**vars(settings), **changes})  # type: ignore[arg-type]


def assert_equal_outputs(genome: ArrayGenome, config: neat.Config, recurrent: bool) -> None:
    kind = neat.nn.RecurrentNetwork if recurrent else neat.nn.FeedForwardNetwork
    network = kind.create(to_stock(genome), config)
    brains = lay_out([assemble(single_module_plan(), [genome], feed_forward=not recurrent)])
    memory, action = np.zeros(memory_size(brains)), np.zeros(OUTPUTS)
    rng = np.random.default_rng(genome.key)
    for _ in range(STEPS):
        memory[:INPUTS] = rng.normal(size=INPUTS)
        expected = network.activate(memory[:INPUTS].copy())
        activate(brains, 0, memory, action)
        np.testing.assert_allclose(action, expected, rtol=1e-12, atol=0.0)


@pytest.mark.parametrize("activation", ["tanh", "relu", "sigmoid", "identity"])
def test_feed_forward_outputs_equal_neat_pythons(ant_settings: EvolutionSettings, activation: str) -> None:
    settings = EvolutionSettings(**{**vars(wild(ant_settings)), "activation": activation})
    config = neat_config(settings, 10, (INPUTS, HIDDEN, OUTPUTS))
    for seed in range(75):
        genome = random_genome(seed, config, mutations=1 + seed % 40)
        assert_equal_outputs(genome, config, recurrent=False)


@pytest.mark.parametrize("activation", ["tanh", "relu", "sigmoid", "identity"])
def test_recurrent_outputs_equal_neat_pythons(ant_settings: EvolutionSettings, activation: str) -> None:
    changes = {"activation_default": activation, "feed_forward": False, "initial_connection": "full_direct"}
    settings = EvolutionSettings(
        **{
            **vars(wild(ant_settings)),
            **changes,
            "weight_init_stdev": 0.3,
            "weight_max_value": 1.0,
            "bias_max_value": 1.0,
        }
    )
    config = neat_config(settings, 10, (INPUTS, HIDDEN, OUTPUTS))
    cyclic = 0
    for seed in range(75):
        genome = random_genome(seed, config, mutations=1 + seed % 40)
        cyclic += bool((genome.connections["source"] == genome.connections["target"]).any())
        assert_equal_outputs(genome, config, recurrent=True)
    assert cyclic > 50


def test_random_genomes_have_lost_nodes_and_disabled_connections(ant_settings: EvolutionSettings) -> None:
    config = neat_config(wild(ant_settings), 10, (INPUTS, HIDDEN, OUTPUTS))
    genomes = [random_genome(seed, config, mutations=20) for seed in range(50)]
    initial_hidden = set(range(OUTPUTS, OUTPUTS + HIDDEN))
    assert any(not initial_hidden <= set(genome.nodes["key"].tolist()) for genome in genomes)
    disabled = [genome for genome in genomes if not genome.connections["enabled"].all()]
    assert len(disabled) > 40


def hand_made(nodes: list[int], edges: list[tuple[int, int, float]], activation: str = "tanh") -> neat.DefaultGenome:
    genome = neat.DefaultGenome(1)
    for key in nodes:
        node = DefaultNodeGene(key)
        node.bias, node.response, node.activation = 0.3, 1.0, activation
        node.aggregation, node.time_constant = "sum", 1.0
        genome.nodes[key] = node
    for innovation, (source, target, weight) in enumerate(edges, start=1):
        gene = DefaultConnectionGene((source, target), innovation=innovation)
        gene.weight, gene.enabled = weight, True
        genome.connections[source, target] = gene
    return genome


@pytest.mark.parametrize(
    "edges",
    [
        [],
        [(-1, 0, 1.0), (3, 4, 1.0), (4, 3, 1.0), (4, 0, 2.0)],
        [(-1, 3, 1.0), (3, 3, 0.5), (3, 1, 1.0), (-2, 2, 1.0)],
        [(5, 1, 0.7), (-1, 5, 0.0), (3, 2, 1.5)],
    ],
    ids=["no connection", "cycle behind an output", "self-loop", "node without inputs"],
)
def test_odd_feed_forward_graphs_equal_neat_pythons(
    ant_settings: EvolutionSettings, edges: list[tuple[int, int, float]]
) -> None:
    config = neat_config(ant_settings, 10, (INPUTS, HIDDEN, OUTPUTS))
    assert_equal_outputs(from_stock(hand_made([0, 1, 2, 3, 4, 5], edges)), config, recurrent=False)


def test_an_unsupported_activation_is_refused_by_name() -> None:
    genome = hand_made([0, 1, 2], [(-1, 0, 1.0)], activation="gauss")
    with pytest.raises(ExneatError, match=r"node \d: expected an activation of tanh, .*got 'gauss'"):
        from_stock(genome)
