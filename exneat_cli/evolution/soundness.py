"""Whether a genome from a file could have come from a run."""

from __future__ import annotations

from exneat_cli.evolution.array_genome import ArrayGenome


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
