"""From one genome to the entries of its network, with module-local indices.

Local index k below the number of pins is a pin; the rest are value slots of nodes: outputs first, then
initial hidden nodes if they are linked, then whatever else is evaluated.
"""

from __future__ import annotations

from typing import NamedTuple

import neat

from exneat_cli.brains.brain import ACTIVATION_CODES
from exneat_cli.errors import ExneatError


class Expression(NamedTuple):
    """A genome's network; entries as in `exneat_cli.brains.brain.Brain`, but with local indices.

    Attributes:
        slots: number of value slots, those that are never evaluated and stay 0 included.
    """

    slots: int
    node_slot: list[int]
    edge_count: list[int]
    edge_source: list[int]
    edge_weight: list[float]
    bias: list[float]
    response: list[float]
    activation: list[int]


def express(
    genome: neat.DefaultGenome, shape: tuple[int, int, int], *, feed_forward: bool, hidden_is_linked: bool
) -> Expression:
    """The network of `genome`, as neat-python's own network classes build it.

    Args:
        genome: nodes and connections.
        shape: numbers of inputs, initial hidden nodes and outputs.
        feed_forward: evaluate nodes in the order of their dependencies, else all at once.
        hidden_is_linked: keep every initial hidden node that exists, also where it leads to no output.

    Raises:
        ExneatError: a node's activation or aggregation is not supported.
    """
    inputs, hidden, outputs = shape
    read_from_outside = list(range(outputs + hidden if hidden_is_linked else outputs))
    incoming: dict[int, list[tuple[int, float]]] = {}
    for (source, target), gene in genome.connections.items():
        if gene.enabled:
            incoming.setdefault(target, []).append((source, gene.weight))
    wanted = _ancestors([key for key in read_from_outside if key in genome.nodes], incoming)
    fed = [key for key in incoming if key in wanted]
    evaluated = _dependency_order(wanted, incoming) if feed_forward else fed
    slot_of = {key: inputs + k for k, key in enumerate(dict.fromkeys(read_from_outside + evaluated))}
    # A source that is never evaluated, such as one on a cycle, stays 0: the last slot is for those.
    silent = inputs + len(slot_of)
    index_of = {-1 - pin: pin for pin in range(inputs)} | slot_of
    edges = [incoming.get(key, []) for key in evaluated]
    genes = [genome.nodes[key] for key in evaluated]
    return Expression(
        slots=len(slot_of) + 1,
        node_slot=[slot_of[key] for key in evaluated],
        edge_count=[len(links) for links in edges],
        edge_source=[index_of.get(source, silent) for links in edges for source, _ in links],
        edge_weight=[weight for links in edges for _, weight in links],
        bias=[gene.bias for gene in genes],
        response=[gene.response for gene in genes],
        activation=[_activation_code(gene) for gene in genes],
    )


def _ancestors(keys: list[int], incoming: dict[int, list[tuple[int, float]]]) -> set[int]:
    found = set(keys)
    queue = list(keys)
    while queue:
        for source, _ in incoming.get(queue.pop(), []):
            if source >= 0 and source not in found:
                found.add(source)
                queue.append(source)
    return found


def _dependency_order(wanted: set[int], incoming: dict[int, list[tuple[int, float]]]) -> list[int]:
    """Nodes after everything that they read; those on or behind a cycle are left out."""
    waiting_for = {key: {s for s, _ in incoming.get(key, []) if s >= 0} for key in sorted(wanted)}
    readers: dict[int, list[int]] = {}
    for key, sources in waiting_for.items():
        for source in sources:
            readers.setdefault(source, []).append(key)
    ready = [key for key, sources in waiting_for.items() if not sources]
    order = []
    while ready:
        key = ready.pop()
        order.append(key)
        for reader in readers.get(key, []):
            waiting_for[reader].discard(key)
            if not waiting_for[reader]:
                ready.append(reader)
    return order


def _activation_code(gene: neat.genes.DefaultNodeGene) -> int:
    if gene.aggregation != "sum":
        raise ExneatError(f"node {gene.key}: expected aggregation sum, got {gene.aggregation!r}")
    if gene.activation not in ACTIVATION_CODES:
        known = ", ".join(ACTIVATION_CODES)
        raise ExneatError(f"node {gene.key}: expected an activation of {known}, got {gene.activation!r}")
    return ACTIVATION_CODES[gene.activation]
