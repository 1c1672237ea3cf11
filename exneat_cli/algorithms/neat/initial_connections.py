"""The connections of the first generation, before they have weights."""

from __future__ import annotations

import numpy as np
from neat.genome import DefaultGenomeConfig
from numpy.random import Generator

from exneat_cli.algorithms.neat.genes import CONNECTION, Connections

INITIAL_CONNECTIONS = ("full_nodirect", "full_direct", "unconnected", "fs_neat_nohidden", "fs_neat_hidden")
"""neat-python's names."""


def initial_connections(config: DefaultGenomeConfig, rng: Generator) -> Connections:
    """Sorted, enabled connections with innovation numbers and weights of 0.

    Args:
        config: `initial_connection` says which; its tracker gives the numbers.
        rng: draws the only pin that the ``fs_neat`` kinds connect (Whiteson et al., "Automatic feature selection
            in neuroevolution", 2005).
    """
    number = config.innovation_tracker.get_innovation_number
    rows = [
        (target, source, number(source, target, "initial_connection"), 0.0, True)
        for target, source in sorted(_ends(config, rng))
    ]
    return np.array(rows, CONNECTION)


def _ends(config: DefaultGenomeConfig, rng: Generator) -> list[tuple[int, int]]:
    """Target and source of every connection."""
    kind, outputs, pins = config.initial_connection, config.output_keys, config.input_keys
    nodes = range(config.num_outputs + config.num_hidden)
    hidden = nodes[config.num_outputs :]
    if kind == "unconnected":
        return []
    if kind.startswith("fs_neat"):
        pin = pins[rng.integers(len(pins))]
        return [(node, pin) for node in (nodes if kind == "fs_neat_hidden" else outputs)]
    ends = [(node, pin) for node in hidden for pin in pins]
    ends += [(output, node) for output in outputs for node in hidden]
    if kind == "full_direct" or not hidden:
        ends += [(output, pin) for output in outputs for pin in pins]
    if not config.feed_forward:
        ends += [(node, node) for node in nodes]
    return ends
