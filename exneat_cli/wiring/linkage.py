"""Linkage: which extra pins run between modules. A linkage is one function, found by its name in `LINKAGES`.

Links read the value of the previous step. Source: Zhang (2025), sections 3.1.1 and 3.2.3; the thesis'
"linked" agents are `hidden` (34 inputs = 22 sensors + 3 peers x 4 hidden nodes).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

from exneat_cli.tasks import Part
from exneat_cli.wiring.plan import Pin


class Sizes(NamedTuple):
    """What a linkage can read; module k serves part k, and the central module comes after them.

    Attributes:
        outputs: number of outputs of each part module; its output nodes are 0 to outputs - 1.
        hidden: number of initial hidden nodes of a part module; they follow the outputs.
    """

    outputs: tuple[int, ...]
    hidden: int


Linkage = Callable[[Sequence[Part], int, Sizes], tuple[Pin, ...]]
"""``linkage(parts, own, sizes)``: the extra pins of the module that serves ``parts[own]``. Whether it needs a
central module (number ``len(parts)``) or hidden nodes follows from the pins that it returns."""


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


def none(parts: Sequence[Part], own: int, sizes: Sizes) -> tuple[Pin, ...]:
    """No links."""
    return ()


def output(parts: Sequence[Part], own: int, sizes: Sizes) -> tuple[Pin, ...]:
    """The outputs of every other part module."""
    peers = counter_clockwise(parts, own)
    return tuple(Pin(k, peer, delayed=True) for peer in peers for k in range(sizes.outputs[peer]))


def hidden(parts: Sequence[Part], own: int, sizes: Sizes) -> tuple[Pin, ...]:
    """The initial hidden nodes of every other part module."""
    peers = counter_clockwise(parts, own)
    return tuple(Pin(sizes.outputs[peer] + k, peer, delayed=True) for peer in peers for k in range(sizes.hidden))


def feedback(parts: Sequence[Part], own: int, sizes: Sizes) -> tuple[Pin, ...]:
    """The outputs of the central module, first those that move the own part, then those of its peers."""
    order = [own, *counter_clockwise(parts, own)]
    return tuple(Pin(actuator, len(parts), delayed=True) for k in order for actuator in parts[k].actuators)


def full(parts: Sequence[Part], own: int, sizes: Sizes) -> tuple[Pin, ...]:
    """All three."""
    return output(parts, own, sizes) + hidden(parts, own, sizes) + feedback(parts, own, sizes)


LINKAGES: dict[str, Linkage] = {"none": none, "output": output, "hidden": hidden, "feedback": feedback, "full": full}
"""Every linkage by its name on the command line."""
