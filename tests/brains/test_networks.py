"""Compiled networks against neat-python's own."""

from __future__ import annotations

from dataclasses import replace

import neat
import numpy as np
import pytest

from exneat_cli.algorithms import ACTIVATIONS, EvolutionSettings, from_stock, neat_config, to_stock
from exneat_cli.brains import assemble
from exneat_cli.wiring import Module, Pin, Plan
from tests.algorithms.neat.genomes import genome_of
from tests.brains.teams import STEPS, actions_of, busy, random_team

SHAPE = INPUTS, HIDDEN, OUTPUTS = 5, 3, 3
BODY = Module("body", (0.0, 0.0), 0, tuple(Pin(k) for k in range(INPUTS)), OUTPUTS, HIDDEN, tuple(range(OUTPUTS)))
PLAN = Plan((BODY,), INPUTS, OUTPUTS)
WILD = busy(EvolutionSettings(), weight_init_stdev=1.0, bias_init_stdev=1.0)


def assert_equal_outputs(genome: neat.DefaultGenome, settings: EvolutionSettings, seed: int = 0) -> None:
    kind = neat.nn.FeedForwardNetwork if settings.feed_forward else neat.nn.RecurrentNetwork
    # Sorted genes: neat-python sums in the order of the connections.
    network = kind.create(to_stock(from_stock(genome)), neat_config(settings, 10, SHAPE))
    sensed = np.random.default_rng(seed).normal(size=(STEPS, INPUTS))
    actions = actions_of(assemble(PLAN, [[from_stock(genome)]], feed_forward=settings.feed_forward), 0, sensed)
    for action, row in zip(actions, sensed, strict=True):
        np.testing.assert_allclose(action, network.activate(row), rtol=1e-12, atol=0.0)


@pytest.mark.parametrize("feed_forward", [True, False], ids=["feed-forward", "recurrent"])
@pytest.mark.parametrize("activation", ACTIVATIONS)
def test_outputs_equal_neat_pythons(activation: str, feed_forward: bool) -> None:
    settings = replace(WILD, activation_default=activation, feed_forward=feed_forward)
    if not feed_forward:  # without growing beyond all bounds
        bounds = {"weight_init_stdev": 0.3, "weight_max_value": 1.0, "bias_max_value": 1.0}
        settings = replace(settings, initial_connection="full_direct", **bounds)  # type: ignore[arg-type]
    cyclic = deleted = disabled = 0
    for seed in range(75):
        (genome,) = random_team(PLAN, settings, seed)
        cyclic += any(source == target for source, target in genome.connections)
        deleted += not {3, 4, 5} <= genome.nodes.keys()
        disabled += not all(gene.enabled for gene in genome.connections.values())
        assert_equal_outputs(genome, settings, seed)
    assert (cyclic > 50) == (not feed_forward)
    assert min(deleted, disabled) > 10


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
def test_odd_feed_forward_graphs_equal_neat_pythons(edges: list[tuple[int, int, float]]) -> None:
    rows = [(target, source, number, weight, True) for number, (source, target, weight) in enumerate(edges)]
    genome = genome_of([(key, 0.3, 1.0, 0) for key in range(INPUTS + 1)], sorted(rows))
    assert_equal_outputs(to_stock(genome), EvolutionSettings())


@pytest.mark.parametrize(("target", "source"), [(9, -1), (0, 9), (0, -1 - INPUTS)])
def test_a_connection_with_an_end_that_does_not_exist_is_refused(target: int, source: int) -> None:
    genome = genome_of([(key, 0.0, 1.0, 0) for key in range(OUTPUTS)], [(target, source, 1, 1.0, True)])
    with pytest.raises(ValueError, match="an end that does not exist"):
        assemble(PLAN, [[genome]], feed_forward=True)
    with pytest.raises(ValueError, match=r"expected 1 genomes per team, got \[2\]"):
        assemble(PLAN, [[genome, genome]], feed_forward=True)
