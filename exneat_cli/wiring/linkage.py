"""Linkage: which extra pins run between modules.

Links read the value of the previous step. Source: Zhang (2025), sections 3.1.1 and 3.2.3; the thesis'
"linked" agents are `hidden` (34 inputs = 22 sensors + 3 peers x 4 hidden nodes).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from exneat_cli.tasks import Part
from exneat_cli.wiring.plan import Pin

LINKAGES = ("none", "output", "hidden", "feedback", "full")


def counter_clockwise(parts: Sequence[Part], own: int) -> list[int]:
    """The other parts, counter-clockwise (seen from above) from part `own`.

    A shared genome so sees the same relation everywhere: on Ant the first peer of the front left leg is
    the back left one, and the first peer of the back left leg the back right one.
    """

    def angle(index: int) -> float:
        x, y = parts[index].position
        return math.atan2(y, x)

    turn = 2 * math.pi
    others = [index for index in range(len(parts)) if index != own]
    return sorted(others, key=lambda index: ((angle(index) - angle(own)) % turn, index))


def link_pins(
    linkage: str, parts: Sequence[Part], own: int, *, outputs: Sequence[int], hidden: int, central: int
) -> tuple[Pin, ...]:
    """Extra pins of the part module `own`: peers' outputs, peers' hidden nodes, the central outputs.

    Args:
        linkage: one of `LINKAGES`.
        parts: all parts; module k serves part k.
        own: index of the module whose pins are wanted.
        outputs: number of outputs of each part module.
        hidden: number of initial hidden nodes of a part module.
        central: index of the central module, read by `feedback` and `full`. Its outputs come in the
            same relative order as peers: those that move the own part, then counter-clockwise.
    """
    peers = counter_clockwise(parts, own)
    pins: list[Pin] = []
    if linkage in ("output", "full"):
        pins += [Pin("output", k, peer, delayed=True) for peer in peers for k in range(outputs[peer])]
    if linkage in ("hidden", "full"):
        pins += [Pin("hidden", k, peer, delayed=True) for peer in peers for k in range(hidden)]
    if linkage in ("feedback", "full"):
        pins += [Pin("output", a, central, delayed=True) for s in [own, *peers] for a in parts[s].actuators]
    return tuple(pins)
