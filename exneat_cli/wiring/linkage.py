"""Linkage: which connections run between modules. A linkage is one function, found by its name in `LINKAGES`.

Links between modules read the value of the previous step. Source: Zhang (2025), sections 3.1.1 and 3.2.3; the thesis'
"linked" agents are `hidden` (34 inputs = 22 sensors + 3 peers x 4 hidden nodes). `joints` reads sensors, in the same
step.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from exneat_cli.tasks import Part
from exneat_cli.wiring.plan import Pin

Linkage = Callable[[Sequence[Part], int, Sequence[int], int], tuple[Pin, ...]]
"""``linkage(parts, own, outputs, hidden_nodes)``: the extra pins of the module that serves ``parts[own]``. Module k
serves part k, and the central module has the number ``len(parts)``; the nodes of module k are its ``outputs[k]``
outputs, numbered from 0, then ``hidden_nodes`` initial hidden nodes. What a linkage requires follows from the pins that
it returns."""


def peers_of(parts: Sequence[Part], own: int) -> list[int]:
    """The other parts, counter-clockwise (seen from above) from part `own`; clockwise from a mirrored one.

    A shared genome thus finds the same relation everywhere: on Ant, the first peer of the front left leg is the back
    left one, and that of the back left leg the back right one. Parts at equal angles are ordered by class of alike
    parts, then by height.
    """
    angles = [math.atan2(y, x) for x, y in (part.position for part in parts)]
    way = -1.0 if parts[own].is_mirrored else 1.0

    def order(peer: int) -> tuple[float, int, float]:
        angle = round(way * (angles[peer] - angles[own]), 9) % round(math.tau, 9)
        return angle, parts[peer].likeness, parts[peer].height

    return sorted((peer for peer in range(len(parts)) if peer != own), key=order)


def none(parts: Sequence[Part], own: int, outputs: Sequence[int], hidden_nodes: int) -> tuple[Pin, ...]:
    """No links."""
    return ()


def output(parts: Sequence[Part], own: int, outputs: Sequence[int], hidden_nodes: int) -> tuple[Pin, ...]:
    """The outputs of every other part module."""
    peers = peers_of(parts, own)
    return tuple(Pin(k, peer, delayed=True) for peer in peers for k in range(outputs[peer]))


def hidden(parts: Sequence[Part], own: int, outputs: Sequence[int], hidden_nodes: int) -> tuple[Pin, ...]:
    """The initial hidden nodes of every other part module."""
    peers = peers_of(parts, own)
    return tuple(Pin(outputs[peer] + k, peer, delayed=True) for peer in peers for k in range(hidden_nodes))


def feedback(parts: Sequence[Part], own: int, outputs: Sequence[int], hidden_nodes: int) -> tuple[Pin, ...]:
    """The outputs of the central module: first those that move the module's own part, then those of its peers."""
    order = [own, *peers_of(parts, own)]
    return tuple(Pin(actuator, len(parts), delayed=True) for k in order for actuator in parts[k].actuators)


def full(parts: Sequence[Part], own: int, outputs: Sequence[int], hidden_nodes: int) -> tuple[Pin, ...]:
    """The links of `output`, `hidden` and `feedback`."""
    return tuple(pin for linkage in (output, hidden, feedback) for pin in linkage(parts, own, outputs, hidden_nodes))


def joints(parts: Sequence[Part], own: int, outputs: Sequence[int], hidden_nodes: int) -> tuple[Pin, ...]:
    """The joint sensors of every other part, in the same step, with the signs with which the own part sees them."""
    peers = [parts[peer] for peer in peers_of(parts, own)]
    seen = [peer.mirrored_joints if parts[own].is_mirrored else peer.joints for peer in peers]
    return tuple(Pin(entry) for entries in seen for entry in entries)


LINKAGES: dict[str, Linkage] = {
    "none": none,
    "output": output,
    "hidden": hidden,
    "feedback": feedback,
    "full": full,
    "joints": joints,
}
"""Every linkage by its name on the command line."""
