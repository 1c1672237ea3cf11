"""From genomes to networks: which nodes are evaluated, in what order, and where their values are kept.

Local index k below the number of pins is a pin; the rest are value slots of nodes: outputs first, then
initial hidden nodes if they are linked, then whatever else is evaluated, then one that stays 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exneat_cli.algorithms import ArrayGenome
from exneat_cli.algorithms.neat.genes import CONNECTION, NODE, Connections, Nodes, end_to_end
from exneat_cli.algorithms.neat.structure import mark_sources, node_row
from exneat_cli.brains.wiring_arrays import WiringArrays
from exneat_cli.compiling import compiled


class Networks(NamedTuple):
    """G genomes end to end, and the networks that they mean.

    Attributes:
        nodes: (N,) of all genomes.
        first_node: (G + 1,) the nodes of genome g are first_node[g] to first_node[g + 1].
        connections: (C,) of all genomes.
        first_connection: (G + 1,) likewise.
        evaluated: (G,) how many nodes of each genome are evaluated.
        slots: (G,) how many value slots each network has.
        order: (N,) from first_node[g] on, the rows of the nodes to evaluate, counted within the genome.
        slot_of: (N,) local index of each node's value.
        source_of: (C,) local index of what each connection reads.
    """

    nodes: Nodes
    first_node: NDArray[np.int64]
    connections: Connections
    first_connection: NDArray[np.int64]
    evaluated: NDArray[np.int64]
    slots: NDArray[np.int64]
    order: NDArray[np.int64]
    slot_of: NDArray[np.int64]
    source_of: NDArray[np.int64]


def express(wiring: WiringArrays, genomes: Sequence[ArrayGenome], *, feed_forward: bool) -> Networks:
    """The networks of `genomes`, as neat-python's own network classes build them.

    Args:
        wiring: the plan; every initial hidden node that other modules read is evaluated if it exists, also where
            it leads to no output.
        genomes: team by team, each in the order of the subpopulations.
        feed_forward: evaluate nodes in the order of their dependencies, else all at once.

    Raises:
        ValueError: a connection has an end that does not exist.
    """
    nodes = end_to_end((genome.nodes for genome in genomes), NODE)
    connections = end_to_end((genome.connections for genome in genomes), CONNECTION)
    networks = Networks(
        nodes=nodes,
        first_node=np.cumsum([0] + [len(genome.nodes) for genome in genomes]),
        connections=connections,
        first_connection=np.cumsum([0] + [len(genome.connections) for genome in genomes]),
        evaluated=np.zeros(len(genomes), np.int64),
        slots=np.zeros(len(genomes), np.int64),
        order=np.zeros(len(nodes), np.int64),
        slot_of=np.zeros(len(nodes), np.int64),
        source_of=np.zeros(len(connections), np.int64),
    )
    _express(wiring.shapes, wiring.hidden_is_linked, networks, feed_forward)
    return networks


@compiled
def _express(shapes, hidden_is_linked, networks, feed_forward):  # type: ignore[no-untyped-def]
    for g in range(networks.evaluated.size):
        a, b = networks.first_node[g], networks.first_node[g + 1]
        c, d = networks.first_connection[g], networks.first_connection[g + 1]
        nodes, connections = networks.nodes[a:b], networks.connections[c:d]
        order, slot_of, source_of = networks.order[a:b], networks.slot_of[a:b], networks.source_of[c:d]
        s = g % hidden_is_linked.size
        inputs, read_outside = shapes[s, 0], shapes[s, 2] + (shapes[s, 1] if hidden_is_linked[s] else 0)
        _find_sources(nodes, connections, inputs, source_of)
        evaluated = _order(nodes, connections, source_of, read_outside, feed_forward, order)
        networks.evaluated[g] = evaluated
        networks.slots[g] = _assign_slots(nodes, order[:evaluated], inputs, read_outside, slot_of)
        for i in range(connections.size):
            source_of[i] = -1 - source_of[i] if source_of[i] < 0 else slot_of[source_of[i]]


@compiled
def _find_sources(nodes, connections, inputs, source_of):  # type: ignore[no-untyped-def]
    """Write the row of the node that each connection reads, or -1 - k for pin k."""
    for i in range(connections.size):
        source = connections[i].source
        source_of[i] = source if source < 0 else node_row(nodes, source)
        missing = source < -inputs or (source >= 0 and source_of[i] < 0)
        if missing or node_row(nodes, connections[i].target) < 0:
            raise ValueError("a connection of a genome has an end that does not exist")


@compiled
def _order(nodes, connections, source_of, read_outside, feed_forward, order):  # type: ignore[no-untyped-def]
    """Write the rows of the nodes to evaluate into the head of `order`; returns how many they are.

    Of a recurrent network, all that are wanted and have an input. Of a feed-forward one, all that are wanted, after
    everything that they read; those on or behind a cycle are left out.
    """
    wanted = np.zeros(nodes.size, np.bool_)
    for row in range(nodes.size):
        wanted[row] = nodes[row].key < read_outside
    mark_sources(nodes, connections, wanted, True)
    placed = np.zeros(nodes.size, np.bool_)
    count, before = 0, -1
    while count > before:
        before = count
        edge = 0
        for row in range(nodes.size):
            fed, ready = False, wanted[row] and not placed[row]
            while edge < connections.size and connections[edge].target == nodes[row].key:
                if connections[edge].enabled:
                    fed = True
                    ready = ready and (not feed_forward or source_of[edge] < 0 or placed[source_of[edge]])
                edge += 1
            if ready and (fed or feed_forward):
                placed[row] = True
                order[count] = row
                count += 1
    return count


@compiled
def _assign_slots(nodes, evaluated, inputs, read_outside, slot_of):  # type: ignore[no-untyped-def]
    """Write the local index of each node; returns how many slots there are."""
    slots = read_outside
    for row in range(nodes.size):
        slot_of[row] = inputs + nodes[row].key if nodes[row].key < read_outside else -1
    for row in evaluated:
        if slot_of[row] < 0:
            slot_of[row] = inputs + slots
            slots += 1
    for row in range(nodes.size):
        if slot_of[row] < 0:
            slot_of[row] = inputs + slots
    return slots + 1
