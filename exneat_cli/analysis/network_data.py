"""A champion as a graph, read from champion.json as plain data: no genome is built and nothing is run."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import NamedTuple

from exneat_cli.errors import ExneatError
from exneat_cli.records import Champion, RunDirectory, read_champion
from exneat_cli.wiring import Plan

Node = tuple[int, int]
"""A module, and a key in its genome: outputs from 0, then hidden nodes; input k is -1 - k."""
SENSORS = -1
"""In place of a module: the observation, whose entries are then the keys."""


class Edge(NamedTuple):
    """An enabled connection within a module, between keys of its genome."""

    source: int
    target: int
    weight: float


class Link(NamedTuple):
    """An input that reads a node of another module, at this step or delayed by one."""

    source: Node
    target: Node
    delayed: bool


@dataclass(frozen=True)
class ChampionGraph:
    """A champion's networks and the links between them.

    Attributes:
        plan: who senses and drives what.
        actuators: names of the entries of the action.
        feed_forward: whether no connection runs back; else each takes a step.
        inputs: of each module, what its inputs read.
        hidden: of each module, its hidden nodes, initial and grown.
        edges: of each module; modules that share a genome repeat it.
        links: between modules; those that would read a deleted node are left out.
        used: nodes on a path from a sensor to an output that drives an actuator, by way of any module.
        test_fitness: mean over the test episodes.
    """

    plan: Plan
    actuators: tuple[str, ...]
    feed_forward: bool
    inputs: tuple[tuple[Node, ...], ...]
    hidden: tuple[tuple[int, ...], ...]
    edges: tuple[tuple[Edge, ...], ...]
    links: tuple[Link, ...]
    used: frozenset[Node]
    test_fitness: float

    def kind_of(self, source: Node) -> str:
        """What an input reads: ``sensors``, or ``outputs`` or ``hidden`` nodes of a module."""
        module, key = source
        if module == SENSORS:
            return "sensors"
        return "outputs" if key < self.plan.modules[module].outputs else "hidden"


def read_champion_graph(run: RunDirectory) -> ChampionGraph:
    """Read the graph of a run's champion.

    Raises:
        ExneatError: the run has no champion, as baselines and unfinished runs have none, or its file is damaged.
    """
    if not run.champion.exists():
        raise ExneatError(f"{run.path}: expected a champion, got none: baselines and unfinished runs have no network")
    return champion_graph(read_champion(run.champion))


def champion_graph(champion: Champion) -> ChampionGraph:
    """Make the graph of what champion.json holds."""
    plan = champion.plan
    genomes = [champion.genomes[module.subpopulation] for module in plan.modules]
    nodes = [sorted(node.id for node in genome.nodes) for genome in genomes]
    inputs = tuple(tuple((pin.module, pin.index) for pin in module.pins) for module in plan.modules)
    edges = tuple(
        tuple(Edge(gene.source, gene.target, gene.weight) for gene in genome.connections if gene.enabled)
        for genome in genomes
    )
    links = tuple(
        Link(source, (m, -1 - k), plan.modules[m].pins[k].delayed)
        for m, own in enumerate(inputs)
        for k, source in enumerate(own)
        if source[0] != SENSORS and source[1] in nodes[source[0]]
    )
    sensing = {(m, -1 - k) for m, own in enumerate(inputs) for k, source in enumerate(own) if source[0] == SENSORS}
    driving = {(m, output) for m, module in enumerate(plan.modules) for output in range(len(module.drives))}
    steps = [((m, edge.source), (m, edge.target)) for m, own in enumerate(edges) for edge in own]
    steps += [(link.source, link.target) for link in links]
    back = [(target, source) for source, target in steps]
    return ChampionGraph(
        plan=plan,
        actuators=champion.actuators,
        feed_forward=champion.feed_forward,
        inputs=inputs,
        hidden=tuple(tuple(keys[module.outputs :]) for keys, module in zip(nodes, plan.modules, strict=True)),
        edges=edges,
        links=links,
        used=frozenset(_reachable(sensing, steps) & _reachable(driving, back)),
        test_fitness=champion.scores.test.fitness_mean,
    )


def _reachable(starts: set[Node], steps: Collection[tuple[Node, Node]]) -> set[Node]:
    found = starts
    while new := {target for source, target in steps if source in found} - found:
        found = found | new
    return found
