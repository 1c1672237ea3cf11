"""Compiled teams, links and central module included, against a slow reference with dictionaries."""

from __future__ import annotations

import math
from collections.abc import Callable

import neat
import numpy as np
import pytest

from exneat_cli.algorithms import RECURRENT, EvolutionSettings, from_stock, to_stock
from exneat_cli.brains import Brains, assemble, linear_fusion, motionless
from exneat_cli.brains.brain import activate, lay_out, memory_size
from exneat_cli.tasks import AntTask
from exneat_cli.wiring import LINKAGES, Geometry, Module, Plan, Wiring, plan_modules
from tests.brains.teams import STEPS, Cross, actions_of, busy, random_team

ACTIVATIONS: dict[str, Callable[[float], float]] = {"tanh": lambda z: math.tanh(2.5 * z), "relu": lambda z: max(z, 0.0)}
GRID = busy(RECURRENT, activation_default="tanh", bias_init_stdev=0.5, weight_init_stdev=0.5)


class SlowTeam:
    """What the design says of teams, one dictionary of node values per module and step."""

    def __init__(self, plan: Plan, genomes: list[neat.DefaultGenome], feed_forward: bool) -> None:
        self.plan = plan
        self.genomes = [genomes[module.subpopulation] for module in plan.modules]
        self.feed_forward = feed_forward
        self.last: list[dict[int, float]] = [{} for _ in plan.modules]

    def step(self, sensed: np.ndarray) -> list[float]:
        now: list[dict[int, float]] = []
        for index, (module, genome) in enumerate(zip(self.plan.modules, self.genomes, strict=True)):
            pins = self.pin_values(module, sensed, now)
            now.append(
                self.forward(genome, pins) if self.feed_forward else self.advance(genome, pins, self.last[index])
            )
        self.last = now
        action = [0.0] * self.plan.action_size
        for module, values in zip(self.plan.modules, now, strict=True):
            for output, actuator in enumerate(module.drives):
                action[actuator] = values.get(output, 0.0)
        return action

    def pin_values(self, module: Module, sensed: np.ndarray, now: list[dict[int, float]]) -> dict[int, float]:
        values = {}
        for k, pin in enumerate(module.pins):
            if pin.is_sensor:
                values[-1 - k] = float(sensed[pin.index])
            else:
                values[-1 - k] = (self.last if pin.delayed else now)[pin.module].get(pin.index, 0.0)
        return values

    def forward(self, genome: neat.DefaultGenome, pins: dict[int, float]) -> dict[int, float]:
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


def assert_equal_to_reference(plan: Plan, genomes: list[neat.DefaultGenome], feed_forward: bool, seed: int) -> None:
    arrays = [from_stock(genome) for genome in genomes]
    brain = assemble(plan, [arrays], feed_forward=feed_forward)
    slow = SlowTeam(plan, [to_stock(genome) for genome in arrays], feed_forward)
    sensed = np.random.default_rng(seed).normal(size=(STEPS, plan.observation_size))
    for action, row in zip(actions_of(brain, 0, sensed), sensed, strict=True):
        np.testing.assert_allclose(action, slow.step(row), rtol=1e-12, atol=0.0)


@pytest.mark.parametrize("central", [True, False])
@pytest.mark.parametrize("linkage", LINKAGES)
def test_linked_ant_teams_equal_the_reference(linkage: str, central: bool) -> None:
    if linkage in ("feedback", "full") and not central:
        pytest.skip("these links need a central module")
    for seed, geometry in enumerate(["single", "fb", "lr", "cross", "all"]):
        plan = plan_modules(AntTask(), Geometry(geometry), linkage, Wiring(central=central), hidden=4)
        assert_equal_to_reference(plan, random_team(plan, busy(EvolutionSettings()), seed), True, seed)


def cross_plan(geometry: str, linkage: str) -> Plan:
    return plan_modules(Cross(), Geometry(geometry), linkage, Wiring(), hidden=2)  # type: ignore[arg-type]


@pytest.mark.parametrize("linkage", ["none", "output", "hidden"])
def test_linked_recurrent_teams_equal_the_reference(linkage: str) -> None:
    for seed, geometry in enumerate(["single", "all", "all", "single"]):
        plan = cross_plan(geometry, linkage)
        assert_equal_to_reference(plan, random_team(plan, GRID, seed), False, seed)


def test_hidden_nodes_that_were_deleted_are_read_as_zero() -> None:
    plan = plan_modules(AntTask(), Geometry("single"), "hidden", Wiring(), hidden=4)
    genomes = random_team(plan, busy(EvolutionSettings(), node_delete_prob=0.0), 3)
    for key in (2, 3, 4, 5):
        genomes[0].nodes.pop(key)
        genomes[0].connections = {ends: gene for ends, gene in genomes[0].connections.items() if key not in ends}
    assert_equal_to_reference(plan, genomes, True, 0)


def test_the_motionless_brain_holds_every_actuator_at_zero() -> None:
    assert not actions_of(motionless(105, np.zeros(8)), 0, np.full((3, 105), 7.0)).any()


def brains_of_many_sizes() -> list[Brains]:
    """Feed-forward and recurrent teams, linked and not, and rules, all for the same body."""
    brains = [motionless(8, np.arange(4.0)), linear_fusion(8, 4, Cross.parts)]
    for feed_forward in (True, False):
        for seed, (geometry, linkage) in enumerate([("single", "hidden"), ("all", "none"), ("all", "output")]):
            plan = cross_plan(geometry, linkage)
            teams = [[from_stock(g) for g in random_team(plan, GRID, 2 * seed + k)] for k in range(2)]
            brains.append(assemble(plan, teams, feed_forward=feed_forward))
    return brains


def test_a_brain_among_many_of_other_sizes_does_exactly_what_it_does_alone() -> None:
    alone = [some.part(b, b + 1) for some in brains_of_many_sizes() for b in range(len(some.size))]
    assert len({int(brain.size[0]) for brain in alone}) > 4
    sensed = np.random.default_rng(2).normal(size=(STEPS, 8))
    expected = [actions_of(brain, 0, sensed) for brain in alone]
    together = lay_out(brains_of_many_sizes())
    assert set(together.recurrent.tolist()) == {True, False}
    for b, actions in enumerate(expected):
        np.testing.assert_array_equal(actions_of(together, b, sensed), actions)
        np.testing.assert_array_equal(actions_of(together.part(b // 2, b + 1), b - b // 2, sensed), actions)
        np.testing.assert_array_equal(actions_of(lay_out(alone[::-1]), len(alone) - 1 - b, sensed), actions)


def test_brains_of_other_sizes_of_action_are_not_laid_out_together() -> None:
    with pytest.raises(ValueError, match=r"all of one size .*, got \[\(8, 3\), \(8, 4\)\]"):
        lay_out([motionless(8, np.zeros(4)), motionless(8, np.zeros(3))])


def test_a_brain_writes_to_no_more_memory_than_is_asked_for() -> None:
    brains = lay_out(brains_of_many_sizes())
    size = memory_size(brains)
    for b in range(len(brains.size)):
        memory, action = np.zeros(size + 10), np.zeros(4)
        memory[size:] = 7.0
        activate(brains, b, memory, action)
        assert (memory[size:] == 7.0).all()
