"""Whether a genome from a file could have come from a run."""

from __future__ import annotations

from graphlib import CycleError, TopologicalSorter

from exneat_cli.algorithms.neat.genes import ACTIVATIONS, Connections, Nodes
from exneat_cli.algorithms.neat.genome import ArrayGenome


def check_genes(key: int, nodes: Nodes, connections: Connections) -> None:
    """Refuse genes of the genome `key`, in any order, that make no graph.

    Raises:
        ValueError: a node or connection comes twice, a node's key is below 0, an activation does not exist, or a
            connection has an end that does not exist.
    """
    keys = set(nodes["key"].tolist())
    ends = list(zip(connections["target"].tolist(), connections["source"].tolist(), strict=True))
    if len(keys) < len(nodes) or min(keys, default=0) < 0:
        raise ValueError(f"genome {key}: expected nodes with different ids of at least 0")
    if not set(nodes["activation"].tolist()) <= set(range(len(ACTIVATIONS))):
        raise ValueError(f"genome {key}: a node has an activation that does not exist")
    if len(set(ends)) < len(ends):
        raise ValueError(f"genome {key}: expected at most one connection between two nodes")
    for target, source in ends:
        if target not in keys or (source >= 0 and source not in keys):
            raise ValueError(f"genome {key}: the connection from {source} to {target} has an end that does not exist")


def check_genome(genome: ArrayGenome, inputs: int, outputs: int, *, feed_forward: bool) -> None:
    """Refuse a genome that would not make a network of this shape.

    Args:
        genome: that `check_genes` found to be a graph.
        inputs: pins are -1, -2, ... to -inputs.
        outputs: nodes 0 to outputs - 1 must be there.
        feed_forward: whether connections, enabled or not, must not close a cycle.

    Raises:
        ValueError: it does not fit.
    """
    sources = genome.connections["source"]
    if not set(range(outputs)) <= set(genome.nodes["key"].tolist()):
        raise ValueError(f"genome {genome.key}: expected outputs 0 to {outputs - 1}")
    if sources.min(initial=0) < -inputs:
        raise ValueError(f"genome {genome.key}: expected connections from at most {inputs} inputs")
    if feed_forward:
        graph: TopologicalSorter[int] = TopologicalSorter()
        for target, source in zip(genome.connections["target"].tolist(), sources.tolist(), strict=True):
            graph.add(target, source)
        try:
            graph.prepare()
        except CycleError as error:
            raise ValueError(
                f"genome {genome.key}: expected a feed-forward network, got one that feeds itself"
            ) from error
