"""What a genome consists of: two tables, one row per gene; and compiled questions to them and to their graph.

Rows are sorted, nodes by `key` and connections by (`target`, `source`): two genomes are compared and crossed
in one pass, and a network finds the connections into a node side by side.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from exneat_cli.compiling import compiled

ACTIVATIONS = ("tanh", "relu", "sigmoid", "identity")
"""neat-python's names; a node gene holds the index."""

NODE = np.dtype(
    [("key", np.int64), ("bias", np.float64), ("response", np.float64), ("activation", np.int64)], align=True
)
"""Outputs have the keys 0, 1, ...; then come initial hidden nodes, then those that mutations added."""

CONNECTION = np.dtype(
    [
        ("target", np.int64),
        ("source", np.int64),
        ("innovation", np.int64),
        ("weight", np.float64),
        ("enabled", np.bool_),
    ],
    align=True,
)
"""`source` is a node's key, or -1 - k for input pin k. `innovation` numbers the mutation that it began with."""

Nodes = NDArray[np.void]
Connections = NDArray[np.void]
Genes = tuple[Nodes, Connections]
"""All genes of one genome."""


def end_to_end(tables: Iterable[NDArray[np.void]], kind: np.dtype[np.void]) -> NDArray[np.void]:
    """All rows of all tables, which are of this kind; bytes are copied, where NumPy would go field by field."""
    return np.frombuffer(bytearray().join(table.data for table in tables), kind)


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
    stack = np.empty(nodes.size, np.int64)  # rows that are marked, but whose sources are not yet
    depth = 0
    for row in range(nodes.size):
        if marked[row]:
            stack[depth] = row
            depth += 1
    while depth > 0:
        depth -= 1
        key = nodes[stack[depth]].key
        edge = row_of(connections, key, np.iinfo(np.int64).min)  # the first connection into the node
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
