"""A champion as a graph, read from champion.json as plain data: no genome is built and nothing is run."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

from exneat_cli.errors import ExneatError
from exneat_cli.records import Champion, Genome, RunDirectory, read_champion
from exneat_cli.wiring import Plan

Node = tuple[int, int]
"""Index of a module, and a node of its genome: outputs from 0, then hidden nodes; pin k is -1 - k."""


class Edge(NamedTuple):
    """An enabled connection within a module."""

    source: Node
    target: Node
    weight: float


class Link(NamedTuple):
    """A pin that reads a node of another module, at this step or delayed by one."""

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
        hidden: hidden nodes of each module, initial and grown.
        edges: connections of all modules; modules that share a genome repeat it.
        links: between modules; those that would read a deleted node are left out.
        used: nodes on a path from a sensor to an output that drives an actuator, by way of any module.
        test_fitness: mean over the test episodes.
    """

    plan: Plan
    actuators: tuple[str, ...]
    feed_forward: bool
    hidden: tuple[tuple[int, ...], ...]
    edges: tuple[Edge, ...]
    links: tuple[Link, ...]
    used: frozenset[Node]
    test_fitness: float


def read_champion_graph(run: RunDirectory) -> ChampionGraph:
    """The graph of a run's champion.

    Raises:
        ExneatError: the run has no champion, as baselines and unfinished runs have none, or its file is damaged.
    """
    if not run.champion.exists():
        raise ExneatError(f"{run.path}: expected a champion, got none: baselines and unfinished runs have no network")
    return champion_graph(read_champion(run.champion))


def champion_graph(champion: Champion) -> ChampionGraph:
    """The graph of what champion.json holds."""
    plan = champion.plan
    genomes = [champion.genomes[module.subpopulation] for module in plan.modules]
    nodes = [sorted(node.id for node in genome.nodes) for genome in genomes]
    known = {(m, n) for m, ids in enumerate(nodes) for n in ids}
    edges = _edges(genomes)
    links = _links(plan, known)
    return ChampionGraph(
        plan=plan,
        actuators=champion.actuators,
        feed_forward=champion.feed_forward,
        hidden=tuple(tuple(ids[module.outputs :]) for ids, module in zip(nodes, plan.modules, strict=True)),
        edges=edges,
        links=links,
        used=_used(plan, edges, links),
        test_fitness=champion.scores.test.fitness_mean,
    )


def _edges(genomes: list[Genome]) -> tuple[Edge, ...]:
    return tuple(
        Edge((m, gene.source), (m, gene.target), gene.weight)
        for m, genome in enumerate(genomes)
        for gene in genome.connections
        if gene.enabled
    )


def _links(plan: Plan, known: set[Node]) -> tuple[Link, ...]:
    links = []
    for m, module in enumerate(plan.modules):
        for k, pin in enumerate(module.pins):
            if pin.is_sensor:
                continue
            links.append(Link((pin.module, pin.index), (m, -1 - k), pin.delayed))
    return tuple(link for link in links if link.source in known)


def _used(plan: Plan, edges: Iterable[Edge], links: Iterable[Link]) -> frozenset[Node]:
    steps = [(edge.source, edge.target) for edge in edges] + [(link.source, link.target) for link in links]
    sensors = [(m, -1 - k) for m, module in enumerate(plan.modules) for k, p in enumerate(module.pins) if p.is_sensor]
    driving = [(m, output) for m, module in enumerate(plan.modules) for output in range(len(module.drives))]
    return frozenset(_reachable(sensors, steps) & _reachable(driving, [(target, source) for source, target in steps]))


def _reachable(starts: Iterable[Node], steps: Iterable[tuple[Node, Node]]) -> set[Node]:
    following: dict[Node, list[Node]] = {}
    for source, target in steps:
        following.setdefault(source, []).append(target)
    found = set(starts)
    queue = list(found)
    while queue:
        for node in following.get(queue.pop(), []):
            if node not in found:
                found.add(node)
                queue.append(node)
    return found
