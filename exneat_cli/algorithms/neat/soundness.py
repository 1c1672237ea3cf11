"""Whether a genome from a file could have come from a run."""

from __future__ import annotations

from exneat_cli.algorithms.neat.genes import Connections, Nodes
from exneat_cli.algorithms.neat.genome import ArrayGenome


def check_genes(key: int, nodes: Nodes, connections: Connections) -> None:
    """Refuse genes, in any order, that make no graph.

    Args:
        key: of their genome.
        nodes: (N,).
        connections: (C,).

    Raises:
        ValueError: a node or connection comes twice, a node's key is below 0, or a connection has an end that does not
            exist.
    """
    keys = nodes["key"].tolist()
    ends = list(zip(connections["target"].tolist(), connections["source"].tolist(), strict=True))
    known = set(keys)
    if len(known) < len(keys) or min(keys, default=0) < 0:
        raise ValueError(f"genome {key}: expected nodes with different ids of at least 0")
    if len(set(ends)) < len(ends):
        raise ValueError(f"genome {key}: expected at most one connection between two nodes")
    for target, source in ends:
        if target not in known or (source >= 0 and source not in known):
            raise ValueError(f"genome {key}: the connection from {source} to {target} has an end that does not exist")


def check_genome(genome: ArrayGenome, inputs: int, outputs: int, *, feed_forward: bool) -> None:
    """Refuse a genome that would not make a network of this shape.

    Args:
        genome: its genes are in order, and both ends of every connection are nodes, or one is a pin.
        inputs: pins are -1, -2, ... to -inputs.
        outputs: nodes 0 to outputs - 1 must be there.
        feed_forward: whether connections, enabled or not, must not close a cycle.

    Raises:
        ValueError: it does not fit.
    """
    keys, sources = genome.nodes["key"], genome.connections["source"]
    if keys[:outputs].tolist() != list(range(outputs)):
        raise ValueError(f"genome {genome.key}: expected outputs 0 to {outputs - 1}")
    if sources.min(initial=0) < -inputs:
        raise ValueError(f"genome {genome.key}: expected connections from at most {inputs} inputs")
    if feed_forward and _feeds_itself(genome):
        raise ValueError(f"genome {genome.key}: expected a feed-forward network, got one that feeds itself")


def _feeds_itself(genome: ArrayGenome) -> bool:
    """Whether connections between nodes close a cycle: taking away nodes that nothing leads to never ends with none."""
    between = genome.connections[genome.connections["source"] >= 0]
    readers: dict[int, list[int]] = {}
    unread = dict.fromkeys(genome.nodes["key"].tolist(), 0)
    for target, source in zip(between["target"].tolist(), between["source"].tolist(), strict=True):
        readers.setdefault(source, []).append(target)
        unread[target] += 1
    free = [key for key, waiting in unread.items() if waiting == 0]
    taken = 0
    while free:
        taken += 1
        for target in readers.get(free.pop(), ()):
            unread[target] -= 1
            if unread[target] == 0:
                free.append(target)
    return taken < len(unread)
