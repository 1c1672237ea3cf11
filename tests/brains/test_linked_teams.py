"""Compiled teams, links and central module included, against a slow reference with dictionaries."""

from __future__ import annotations

import math
import random
from collections.abc import Callable

import neat
import numpy as np
import pytest

from exneat_cli.algorithms import EvolutionSettings, from_stock, neat_config, to_stock
from exneat_cli.algorithms.neat.stock_genome import HomologousGenome
from exneat_cli.brains import Brain, assemble, linear_fusion, motionless
from exneat_cli.brains.brain import Brains, activate, lay_out, memory_size
from exneat_cli.tasks import AntTask, Part
from exneat_cli.wiring import LINKAGES, Geometry, Module, Plan, Wiring, plan_wiring

STEPS = 50
ACTIVATIONS: dict[str, Callable[[float], float]] = {
    "tanh": lambda z: math.tanh(2.5 * z),
    "relu": lambda z: max(z, 0.0),
}


class SlowTeam:
    """What the design says of teams, one dictionary of node values per module and step."""

    def __init__(self, plan: Plan, genomes: list[neat.DefaultGenome], feed_forward: bool) -> None:
        self.plan = plan
        self.genomes = [genomes[module.subpopulation] for module in plan.modules]
        self.feed_forward = feed_forward
        self.last: list[dict[int, float]] = [{} for _ in plan.modules]

    def step(self, observation: np.ndarray) -> list[float]:
        now: list[dict[int, float]] = []
        for index, (module, genome) in enumerate(zip(self.plan.modules, self.genomes, strict=True)):
            pins = self.pin_values(module, observation, now)
            evaluate = self.forward if self.feed_forward else self.advance
            now.append(evaluate(genome, pins, self.last[index]))
        self.last = now
        action = [0.0] * self.plan.action_size
        for module, values in zip(self.plan.modules, now, strict=True):
            for output, actuator in enumerate(module.drives):
                action[actuator] = values.get(output, 0.0)
        return action

    def pin_values(self, module: Module, observation: np.ndarray, now: list[dict[int, float]]) -> dict[int, float]:
        values = {}
        for k, pin in enumerate(module.pins):
            if pin.kind == "sensor":
                values[-1 - k] = float(observation[pin.index])
                continue
            node = pin.index + (self.plan.modules[pin.module].outputs if pin.kind == "hidden" else 0)
            step = self.last if pin.delayed else now
            values[-1 - k] = step[pin.module].get(node, 0.0)
        return values

    def forward(self, genome: neat.DefaultGenome, pins: dict[int, float], _: dict[int, float]) -> dict[int, float]:
        values: dict[int, float] = {}

        def value(key: int) -> float:
            if key < 0:
                return pins[key]
            if key not in values:
                total = 0.0
                for (source, target), gene in genome.connections.items():
                    if target == key and gene.enabled:
                        total += value(source) * gene.weight
                node = genome.nodes[key]
                values[key] = ACTIVATIONS[node.activation](node.bias + node.response * total)
            return values[key]

        for key in genome.nodes:
            value(key)
        return values

    def advance(self, genome: neat.DefaultGenome, pins: dict[int, float], last: dict[int, float]) -> dict[int, float]:
        values = {}
        for key, node in genome.nodes.items():
            incoming = [(s, g.weight) for (s, t), g in genome.connections.items() if t == key and g.enabled]
            total = 0.0
            for source, weight in incoming:
                total += (pins[source] if source < 0 else last.get(source, 0.0)) * weight
            if incoming:
                values[key] = ACTIVATIONS[node.activation](node.bias + node.response * total)
        return values


def random_team(plan: Plan, settings: EvolutionSettings, seed: int) -> list[neat.DefaultGenome]:
    state = random.getstate()
    random.seed(seed)
    genomes = []
    for shape in plan.subpopulation_shapes:
        config = neat_config(settings, 10, shape, HomologousGenome)
        config.genome_config.innovation_tracker = neat.innovation.InnovationTracker()
        genome = config.genome_type(1)
        genome.configure_new(config.genome_config)
        for _ in range(random.randrange(30)):
            genome.mutate(config.genome_config)
        for gene in genome.connections.values():
            gene.enabled = random.random() > 0.2
        genomes.append(genome)
    random.setstate(state)
    return genomes


def assert_equal_to_reference(plan: Plan, genomes: list[neat.DefaultGenome], feed_forward: bool, seed: int) -> None:
    converted = [from_stock(genome) for genome in genomes]
    brains = lay_out([assemble(plan, converted, feed_forward=feed_forward)])
    slow = SlowTeam(plan, [to_stock(genome) for genome in converted], feed_forward)
    observations = np.random.default_rng(seed).normal(size=(STEPS, plan.observation_size))
    actions = actions_of(brains, 0, observations)
    for action, observation in zip(actions, observations, strict=True):
        np.testing.assert_allclose(action, slow.step(observation), rtol=1e-12, atol=0.0)


def actions_of(brains: Brains, b: int, observations: np.ndarray) -> np.ndarray:
    """(steps, A) what brain `b` does from its start on, given (steps, observation size)."""
    memory = np.zeros(memory_size(brains))
    actions = np.full((len(observations), brains.output_slot.shape[1]), np.nan)
    for observation, action in zip(observations, actions, strict=True):
        memory[: observation.size] = observation
        activate(brains, b, memory, action)
    return actions


def busy(settings: EvolutionSettings, **changes: object) -> EvolutionSettings:
    rates = dict.fromkeys(("node_add_prob", "node_delete_prob", "conn_add_prob", "conn_delete_prob"), 0.5)
    return EvolutionSettings(**{**vars(settings), **rates, **changes})


@pytest.mark.parametrize("central", [True, False])
@pytest.mark.parametrize("linkage", LINKAGES)
def test_linked_ant_teams_equal_the_reference(ant_settings: EvolutionSettings, linkage: str, central: bool) -> None:
    if linkage in ("feedback", "full") and not central:
        pytest.skip("these links need a central module")
    for seed, geometry in enumerate(["single", "fb", "lr", "cross", "all"]):
        plan = plan_wiring(AntTask(), "exneat", Geometry(geometry), linkage, Wiring(central=central), hidden=4)
        genomes = random_team(plan, busy(ant_settings), seed)
        assert_equal_to_reference(plan, genomes, feed_forward=True, seed=seed)


class Cross:
    """Four parts with two sensors and one actuator each, like the grid worlds'."""

    name = "cross"
    parts = tuple(
        Part(name, (2 * k, 2 * k + 1), (k,), position)
        for k, (name, position) in enumerate(
            {"left": (-1.0, 0.0), "right": (1.0, 0.0), "up": (0.0, 1.0), "down": (0.0, -1.0)}.items()
        )
    )
    trunk = None
    observation_size = 8
    actuator_names = ("left", "right", "up", "down")


@pytest.mark.parametrize("linkage", ["none", "output", "hidden"])
def test_linked_recurrent_teams_equal_the_reference(grid_settings: EvolutionSettings, linkage: str) -> None:
    settings = busy(grid_settings, activation_default="tanh", bias_init_stdev=0.5, weight_init_stdev=0.5)
    for seed, geometry in enumerate(["single", "all", "all", "single"]):
        plan = plan_wiring(Cross(), "exneat", Geometry(geometry), linkage, Wiring(), hidden=2)  # type: ignore[arg-type]
        assert_equal_to_reference(plan, random_team(plan, settings, seed), feed_forward=False, seed=seed)


def test_hidden_nodes_that_were_deleted_are_read_as_zero(ant_settings: EvolutionSettings) -> None:
    plan = plan_wiring(AntTask(), "exneat", Geometry("single"), "hidden", Wiring(), hidden=4)
    genomes = random_team(plan, ant_settings, 3)
    part_genome = genomes[0]
    for key in (2, 3, 4, 5):
        part_genome.nodes.pop(key, None)
        part_genome.connections = {ends: gene for ends, gene in part_genome.connections.items() if key not in ends}
    assert_equal_to_reference(plan, genomes, feed_forward=True, seed=0)


def test_the_motionless_brain_holds_every_actuator_at_zero() -> None:
    actions = actions_of(lay_out([motionless(105, np.zeros(8))]), 0, np.full((3, 105), 7.0))
    assert not actions.any()


def brains_of_many_sizes(settings: EvolutionSettings) -> list[Brain]:
    """Feed-forward and recurrent teams, linked and not, and rules, all for the same body."""
    brains = [motionless(8, np.arange(4.0)), linear_fusion(8, 4, Cross.parts)]
    for feed_forward in (True, False):
        for seed, (geometry, linkage) in enumerate([("single", "hidden"), ("all", "none"), ("all", "output")]):
            plan = plan_wiring(Cross(), "exneat", Geometry(geometry), linkage, Wiring(), hidden=2)  # type: ignore[arg-type]
            genomes = [from_stock(genome) for genome in random_team(plan, settings, seed)]
            brains.append(assemble(plan, genomes, feed_forward=feed_forward))
    return brains


def test_a_brain_among_many_of_other_sizes_does_exactly_what_it_does_alone(grid_settings: EvolutionSettings) -> None:
    settings = busy(grid_settings, activation_default="tanh", bias_init_stdev=0.5, weight_init_stdev=0.5)
    brains = brains_of_many_sizes(settings)
    assert len({brain.size for brain in brains}) > 4
    assert {brain.recurrent for brain in brains} == {True, False}
    observations = np.random.default_rng(2).normal(size=(STEPS, 8))
    for order in (brains, brains[::-1]):
        together = lay_out(order)
        for b, brain in enumerate(order):
            alone = actions_of(lay_out([brain]), 0, observations)
            np.testing.assert_array_equal(actions_of(together, b, observations), alone)


def test_a_brain_writes_to_no_more_memory_than_is_asked_for(grid_settings: EvolutionSettings) -> None:
    brains = lay_out(brains_of_many_sizes(busy(grid_settings)))
    size = memory_size(brains)
    for b in range(len(brains.size)):
        memory, action = np.zeros(size + 10), np.zeros(4)
        memory[size:] = 7.0
        activate(brains, b, memory, action)
        assert (memory[size:] == 7.0).all()
