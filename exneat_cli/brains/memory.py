"""Where in a brain's memory the value of each input and node of each module is."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from exneat_cli.algorithms import ArrayGenome
from exneat_cli.brains.assembly import _express, wiring_tables
from exneat_cli.wiring import Plan

Place = tuple[int, int]
"""A module, and the key of a node in its genome, or -1 - k for its pin k."""


def places_in_memory(plan: Plan, genomes: Sequence[ArrayGenome], *, feed_forward: bool) -> dict[Place, int]:
    """The slot of each value, as `assemble` lays out a team; left out are nodes that are never evaluated.

    A delayed pin of a recurrent brain has the slot that it reads: what it read is there before the step.
    """
    networks, subpopulation, pins, _ = wiring_tables(plan)
    slots, found = [], []
    for genome, network in zip(genomes, networks, strict=True):
        order, slot_of = np.zeros((2, len(genome.nodes)), np.int64)
        source_of = np.zeros(len(genome.connections), np.int64)
        evaluated, count = _express(network, genome.nodes, genome.connections, feed_forward, order, slot_of, source_of)
        slots.append(count)
        found.append(
            {int(genome.nodes[row]["key"]): int(slot_of[row] - network["inputs"]) for row in order[:evaluated]}
        )
    base = plan.observation_size + np.cumsum([0] + [slots[s] for s in subpopulation])
    places = {(m, key): int(base[m] + k) for m, s in enumerate(subpopulation) for key, k in found[s].items()}
    end, p = int(base[-1]), 0
    for m, module in enumerate(plan.modules):
        for k in range(len(module.pins)):
            pin = pins[p]
            slot = int(pin["index"] + (base[pin["module"]] if pin["module"] >= 0 else 0))
            if feed_forward and pin["delayed"]:
                slot, end = end, end + 1  # a copy, made at the step's start
            places[m, -1 - k] = slot
            p += 1
    return places
