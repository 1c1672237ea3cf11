"""A linkage of one's own: in a ring, each module reads the outputs of its neighbour.

    python examples/custom_linkage.py task=track_maze budget=quick

trains with it as `exneat train` would; conf/linkage/ring.yaml beside this file is what `linkage=ring` finds.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from exneat_cli.main import main
from exneat_cli.tasks import Part
from exneat_cli.wiring import LINKAGES, Pin, Sizes, counter_clockwise


def ring(parts: Sequence[Part], own: int, sizes: Sizes) -> tuple[Pin, ...]:
    """The outputs of the next part module, counter-clockwise, as they were at the previous step."""
    neighbours = counter_clockwise(parts, own)[:1]
    return tuple(Pin(k, peer, delayed=True) for peer in neighbours for k in range(sizes.outputs[peer]))


LINKAGES["ring"] = ring

if __name__ == "__main__":
    conf = str(Path(__file__).parent / "conf")
    raise SystemExit(main(["train", "--config-dir", conf, "linkage=ring", *sys.argv[1:]]))
