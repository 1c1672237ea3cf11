"""Where in a brain's memory the value of each input and node of each module is."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from exneat_cli.algorithms import ArrayGenome
from exneat_cli.brains.assembly import _express, _give_slots, _room, wiring_tables
from exneat_cli.wiring import Plan

Place = tuple[int, int]
"""A module, and the key of a node in its genome, or -1 - k for its pin k."""


def places_in_memory(plan: Plan, genomes: Sequence[ArrayGenome], *, feed_forward: bool) -> dict[Place, int]:
    """The slot of each value, as `assemble` lays out a team; left out are nodes that are never evaluated.

    A delayed pin of a recurrent brain has the slot that it reads: what it read is there before the step.
    """
    wiring = wiring_tables(plan)
    networks, subpopulation, pins, _ = wiring
    slots, found = [], []
    for genome, network in zip(genomes, networks, strict=True):
        order, slot_of = np.zeros((2, len(genome.nodes)), np.int64)
        source_of = np.zeros(len(genome.connections), np.int64)
        evaluated, count = _express(network, genome.nodes, genome.connections, feed_forward, order, slot_of, source_of)
        slots.append(count)
        found.append(
            {int(genome.nodes[row]["key"]): int(slot_of[row] - network["inputs"]) for row in order[:evaluated]}
        )
    base, pin_slot = np.zeros(len(subpopulation) + 1, np.int64), np.zeros(len(pins), np.int64)
    _give_slots(wiring, 0, np.array(slots), feed_forward, base, pin_slot, _room(plan, 1, 0, 0, len(pins)))
    nodes = {(m, key): int(base[m] + k) for m, s in enumerate(subpopulation) for key, k in found[s].items()}
    inputs = [(m, -1 - k) for m, module in enumerate(plan.modules) for k in range(len(module.pins))]
    return nodes | dict(zip(inputs, pin_slot.tolist(), strict=True))
