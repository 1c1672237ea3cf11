"""A custom linkage: in a ring, each module reads the outputs of its neighbour.

    python examples/custom_linkage.py train --config-dir examples/conf task=track_maze linkage=ring

This file is the program exneat with one additional linkage; `linkage=ring` selects conf/linkage/ring.yaml.
"""

from __future__ import annotations

from collections.abc import Sequence

from exneat_cli.main import main
from exneat_cli.tasks import Part
from exneat_cli.wiring import LINKAGES, Pin, peers_of


def ring(parts: Sequence[Part], own: int, outputs: Sequence[int], hidden_nodes: int) -> tuple[Pin, ...]:
    """The outputs of the next part module, counter-clockwise, at the previous step."""
    neighbours = peers_of(parts, own)[:1]
    return tuple(Pin(k, peer, delayed=True) for peer in neighbours for k in range(outputs[peer]))


LINKAGES["ring"] = ring

if __name__ == "__main__":
    raise SystemExit(main())
