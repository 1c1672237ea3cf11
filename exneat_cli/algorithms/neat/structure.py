"""Compiled changes to the structure of a genome, and what must be known of a graph before one is made.

Source of the mutations: Stanley and Miikkulainen, "Evolving neural networks through augmenting topologies"
(2002), section 3.1, in neat-python's form.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from exneat_cli.algorithms.neat.genes import CONNECTION, NODE, Connections, Nodes
from exneat_cli.compiling import compiled


@compiled
def row_of(connections: Connections, target: int, source: int) -> int:
    """Row of the first connection that is not before (`target`, `source`): where it is, or belongs."""
    low, high = 0, connections.size
    while low < high:
        middle = (low + high) // 2
        gene = connections[middle]
        if gene.target < target or (gene.target == target and gene.source < source):
            low = middle + 1
        else:
            high = middle
    return low


@compiled
def is_connected(connections: Connections, target: int, source: int) -> bool:
    """Whether there is a connection from `source` to `target`, enabled or not."""
    row = row_of(connections, target, source)
    if row == connections.size:
        return False
    return bool(connections[row].target == target and connections[row].source == source)


@compiled
def node_row(nodes: Nodes, key: int) -> int:
    """Row of the node `key`, or -1 if there is none."""
    low, high = 0, nodes.size
    while low < high:
        middle = (low + high) // 2
        if nodes[middle].key < key:
            low = middle + 1
        else:
            high = middle
    return low if low < nodes.size and nodes[low].key == key else -1


@compiled
def mark_sources(nodes: Nodes, connections: Connections, marked: NDArray[np.bool_], only_enabled: bool) -> None:
    """Mark, beside the nodes in `marked`, every node that leads to one of them.

    Args:
        nodes: (N,).
        connections: (C,).
        marked: (N,), changed.
        only_enabled: follow no disabled connections.
    """
    stack = np.empty(nodes.size, np.int64)
    depth = 0
    for row in range(nodes.size):
        if marked[row]:
            stack[depth] = row
            depth += 1
    while depth > 0:
        depth -= 1
        key = nodes[stack[depth]].key
        edge = row_of(connections, key, np.iinfo(np.int64).min)
        while edge < connections.size and connections[edge].target == key:
            if connections[edge].source >= 0 and (connections[edge].enabled or not only_enabled):
                row = node_row(nodes, connections[edge].source)
                if row >= 0 and not marked[row]:
                    marked[row] = True
                    stack[depth] = row
                    depth += 1
            edge += 1


@compiled
def would_close_a_cycle(nodes: Nodes, connections: Connections, target: int, source: int) -> bool:
    """Whether a connection from `source` to `target` would make a graph without cycles have one."""
    if source < 0:
        return False
    marked = np.zeros(nodes.size, np.bool_)
    marked[node_row(nodes, source)] = True
    mark_sources(nodes, connections, marked, False)
    return bool(marked[node_row(nodes, target)])


@compiled
def _put(rows, into, first):  # type: ignore[no-untyped-def]
    """Copy `rows` to row `first` and on; assigning slices would do the same and take seconds to compile."""
    for i in range(rows.size):
        into[first + i] = rows[i]


@compiled
def with_connection(
    connections: Connections, target: int, source: int, innovation: int, weight: float, enabled: bool
) -> Connections:
    """A copy with one connection more, in its place; it must not be there already."""
    row = row_of(connections, target, source)
    longer = np.empty(connections.size + 1, CONNECTION)
    _put(connections[:row], longer, 0)
    _put(connections[row:], longer, row + 1)
    longer[row].target = target
    longer[row].source = source
    longer[row].innovation = innovation
    longer[row].weight = weight
    longer[row].enabled = enabled
    return longer


@compiled
def without_connection(connections: Connections, row: int) -> Connections:
    """A copy that lacks one row."""
    shorter = np.empty(connections.size - 1, CONNECTION)
    _put(connections[:row], shorter, 0)
    _put(connections[row + 1 :], shorter, row)
    return shorter


@compiled
def with_node(nodes: Nodes, key: int, bias: float, response: float, activation: int) -> Nodes:
    """A copy with one node more; its key must be higher than all others."""
    longer = np.empty(nodes.size + 1, NODE)
    _put(nodes, longer, 0)
    longer[-1].key = key
    longer[-1].bias = bias
    longer[-1].response = response
    longer[-1].activation = activation
    return longer


@compiled
def without_node(nodes: Nodes, connections: Connections, row: int) -> tuple[Nodes, Connections]:
    """Copies that lack one node and all connections to and from it."""
    key = nodes[row].key
    shorter = np.empty(nodes.size - 1, NODE)
    _put(nodes[:row], shorter, 0)
    _put(nodes[row + 1 :], shorter, row)
    left = np.empty(connections.size, CONNECTION)
    count = 0
    for i in range(connections.size):
        if connections[i].target != key and connections[i].source != key:
            left[count] = connections[i]
            count += 1
    return shorter, left[:count].copy()


@compiled
def pruned(nodes: Nodes, connections: Connections, outputs: int) -> tuple[Nodes, Connections]:
    """The nodes that lead to an output, outputs included, and the enabled connections among them and the pins.

    As in neat-python, a disabled connection counts when it is asked which nodes lead to an output.
    """
    needed = nodes["key"] < outputs
    mark_sources(nodes, connections, needed, False)
    kept = np.empty(connections.size, CONNECTION)
    count = 0
    for i in range(connections.size):
        gene = connections[i]
        if gene.enabled and needed[node_row(nodes, gene.target)]:
            kept[count] = gene
            count += 1
    return nodes[needed], kept[:count].copy()
