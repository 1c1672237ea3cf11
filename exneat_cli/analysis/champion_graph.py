"""A champion as a graph: its nodes, connections and links, and which of them matter; nothing is built or run."""

from __future__ import annotations

from collections.abc import Collection, Iterable

from exneat_cli.records.champion import Champion

Node = tuple[int, int]
"""A module, and a key in its genome: outputs from 0, then hidden nodes; input k is -1 - k."""
Edge = tuple[Node, Node, float]
"""An enabled connection within a module: source, target and weight."""

MOST_EDGES = 250
"""Connections beyond these, the weakest, are left out of pictures."""


def hidden_of(champion: Champion) -> list[Node]:
    """The hidden nodes of all modules, initial and grown, in order."""
    return [
        (m, key)
        for m, module in enumerate(champion.plan.modules)
        for key in sorted(node.id for node in champion.genomes[module.subpopulation].nodes)
        if key >= module.outputs
    ]


def edges_of(champion: Champion) -> list[Edge]:
    """The enabled connections within modules; modules that share a genome repeat them."""
    return [
        ((m, gene.source), (m, gene.target), gene.weight)
        for m, module in enumerate(champion.plan.modules)
        for gene in champion.genomes[module.subpopulation].connections
        if gene.enabled
    ]


def links_of(champion: Champion) -> list[tuple[Node, Node, bool]]:
    """Source, target (an input) and whether it is delayed, for every link between modules whose source exists."""
    hidden = set(hidden_of(champion))
    return [
        ((pin.module, pin.index), (m, -1 - k), pin.delayed)
        for m, module in enumerate(champion.plan.modules)
        for k, pin in enumerate(module.pins)
        if champion.plan.kind_of(pin) == "output" or (pin.module, pin.index) in hidden
    ]


def used_nodes(champion: Champion) -> set[Node]:
    """The nodes on a path from a sensor to an output that drives an actuator, by way of any module."""
    modules = champion.plan.modules
    steps = [(source, target) for source, target, _ in (*edges_of(champion), *links_of(champion))]
    sensing = {(m, -1 - k) for m, module in enumerate(modules) for k, pin in enumerate(module.pins) if pin.is_sensor}
    driving = {(m, output) for m, module in enumerate(modules) for output in range(len(module.drives))}
    return _reachable(sensing, steps) & _reachable(driving, [(target, source) for source, target in steps])


def _reachable(found: set[Node], steps: Collection[tuple[Node, Node]]) -> set[Node]:
    while new := {target for source, target in steps if source in found} - found:
        found = found | new
    return found


def strongest_edges(champion: Champion) -> list[Edge]:
    """The enabled connections that a picture shows, the strongest last: at most `MOST_EDGES`, to stay readable."""
    return sorted(edges_of(champion), key=lambda edge: abs(edge[2]))[-MOST_EDGES:]


def depths(hidden: Iterable[Node], edges: Collection[Edge]) -> dict[Node, int]:
    """Find the layers of inputs (0) and of hidden nodes (one more than that of their deepest source).

    Connections out of outputs and those that close a cycle do not count. In a cycle, nodes
    that inputs or placed nodes reach come first, then those that wait for the fewest sources, then the lowest.
    """
    found = {source: 0 for source, _, _ in edges if source[1] < 0}
    sources: dict[Node, set[Node]] = {node: set() for node in hidden}
    for source, target, _ in edges:
        if target in sources and source != target and (source in found or source in sources):
            sources[target].add(source)

    def turn(node: Node) -> tuple[bool, bool, int, Node]:
        waits_for = len(sources[node] - found.keys())
        return waits_for > 0, waits_for == len(sources[node]), waits_for, node

    while sources:
        node = min(sources, key=turn)
        found[node] = 1 + max((found[source] for source in sources.pop(node) if source in found), default=0)
    return found
