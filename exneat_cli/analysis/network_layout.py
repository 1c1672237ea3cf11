"""Where the modules and nodes of a champion go on the page, in inches; pure geometry."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from exneat_cli.analysis.network_data import ChampionGraph, Node
from exneat_cli.wiring import Module, Plan

GAP = 0.3
"""Between boxes; links run there."""
TITLE, OUTPUT_NAMES, INPUT_NAMES, SIDE = 0.32, 0.2, 0.6, 0.2
"""What a box keeps free of nodes: at its top, above outputs that drive something, at its bottom, at its sides."""
LAYER = 0.55
"""Least distance of layers."""
PIN = 0.09
"""Least distance of inputs."""
ACTUATOR = 0.5
"""Least distance of outputs that carry a name."""
_CLEAR = 0.08
"""Least distance of a node from connections that pass it."""
_SHIFTS = (0.0, 0.15, -0.15, 0.3, -0.3)
"""By how much of the distance between its nodes a layer may move aside; the first is best among equals."""
_SAME_ROW = 0.1
"""Modules whose distance is below this share of the body's length stand in one row."""


@dataclass(frozen=True)
class Box:
    """A module's place; (x, y) is its lower left corner."""

    x: float
    y: float
    width: float
    height: float


@dataclass(frozen=True)
class Layout:
    """Everything that has a place.

    Attributes:
        width, height: of the page.
        boxes: one per module.
        places: (x, y) of every node and pin.
    """

    width: float
    height: float
    boxes: tuple[Box, ...]
    places: dict[Node, tuple[float, float]]


def page_direction(modules: Sequence[Module]) -> list[tuple[float, float]]:
    """Where each module lies as one looks at the page: to the right, and up.

    A body looks up the page: x ahead is up, y to the left is left. The parts of a map, which are called
    up and down, keep the map's x and y.
    """
    if any(module.name in ("up", "down") for module in modules):
        return [module.position for module in modules]
    return [(-module.position[1], module.position[0]) for module in modules]


def natural_size(graph: ChampionGraph) -> tuple[float, float]:
    """Width and height at which everything can be told apart, within what fits on a screen."""
    rows = _rows(page_direction(graph.plan.modules))
    widest = max(len(row) for row in rows)
    room = max(max(PIN * len(pin_slots(graph.plan, m)), ACTUATOR * len(m.drives)) for m in graph.plan.modules)
    layers = max(_deepest(graph, m) for m in range(len(graph.plan.modules))) + 1
    width = widest * (2 * SIDE + room) + (widest - 1) * GAP
    height = len(rows) * (TITLE + OUTPUT_NAMES + INPUT_NAMES + LAYER * layers) + (len(rows) - 1) * GAP
    return float(np.clip(width, 6.4, 12.0)), float(np.clip(height, 0.55 * width, 10.0).clip(4.0))


def lay_out(graph: ChampionGraph, width: float, height: float) -> Layout:
    """Place all modules and their nodes on a page of the given size."""
    boxes = _boxes(graph.plan.modules, width, height)
    places: dict[Node, tuple[float, float]] = {}
    for m, box in enumerate(boxes):
        places |= _places(graph, m, box)
    return Layout(width, height, tuple(boxes), places)


def pin_slots(plan: Plan, module: Module) -> list[int | None]:
    """The module's pins from left to right, with an empty slot between groups."""
    slots: list[int | None] = []
    for group in pin_groups(plan, module):
        slots += [None, *group] if slots else group
    return slots


def pin_groups(plan: Plan, module: Module) -> list[list[int]]:
    """The module's pins in their order; neighbours of one kind make a group."""
    return [list(group) for _, group in groupby(range(len(module.pins)), key=lambda k: plan.kind_of(module.pins[k]))]


def depths(hidden: Sequence[int], connections: Iterable[tuple[int, int]]) -> dict[int, int]:
    """Layer of each hidden node, from 1: one more than that of its deepest source, inputs being 0.

    Connections out of outputs and those that close a cycle do not count. In a cycle the node comes
    first that inputs or placed nodes reach, then the one that waits for fewest, then the lowest.

    Args:
        hidden: the hidden nodes of one network.
        connections: (source, target) of its enabled connections; inputs are negative.
    """
    members = set(hidden)
    sources: dict[int, set[int]] = {node: set() for node in hidden}
    for source, target in connections:
        if target in members and source != target and (source < 0 or source in members):
            sources[target].add(source)
    found: dict[int, int] = {}
    while len(found) < len(members):
        waiting = {
            node: [s for s in sources[node] if s >= 0 and s not in found] for node in sorted(members - set(found))
        }
        reached = {node for node in waiting if len(waiting[node]) < len(sources[node])}
        chosen = min(waiting, key=lambda node: (bool(waiting[node]), node not in reached, len(waiting[node]), node))
        found[chosen] = 1 + max((found[s] for s in sources[chosen] if s in found), default=0)
    return found


def _boxes(modules: Sequence[Module], width: float, height: float) -> list[Box]:
    directions = page_direction(modules)
    rows = _rows(directions)
    columns = max(len(row) for row in rows)
    box_width = (width - (columns - 1) * GAP) / columns
    box_height = (height - (len(rows) - 1) * GAP) / len(rows)
    boxes = {}
    for r, row in enumerate(rows):
        used = len(row) * box_width + (len(row) - 1) * GAP
        for c, m in enumerate(row):
            x = (width - used) / 2 + c * (box_width + GAP)
            boxes[m] = Box(x, height - (r + 1) * box_height - r * GAP, box_width, box_height)
    return [boxes[m] for m in range(len(modules))]


def _rows(directions: Sequence[tuple[float, float]]) -> list[list[int]]:
    """Indices of modules from the top row to the bottom one, each from left to right."""
    heights = [up for _, up in directions]
    tolerance = _SAME_ROW * (max(heights) - min(heights))
    rows: list[list[int]] = []
    for m in sorted(range(len(directions)), key=lambda m: (-heights[m], m)):
        if rows and heights[rows[-1][0]] - heights[m] <= tolerance:
            rows[-1].append(m)
        else:
            rows.append([m])
    return [sorted(row, key=lambda m: (directions[m][0], m)) for row in rows]


def _deepest(graph: ChampionGraph, m: int) -> int:
    return max(_depths_of(graph, m).values(), default=0)


def _depths_of(graph: ChampionGraph, m: int) -> dict[int, int]:
    return depths(graph.hidden[m], [(e.source[1], e.target[1]) for e in graph.edges if e.source[0] == m])


def _places(graph: ChampionGraph, m: int, box: Box) -> dict[Node, tuple[float, float]]:
    module = graph.plan.modules[m]
    bottom = box.y + INPUT_NAMES
    top = box.y + box.height - TITLE - (OUTPUT_NAMES if module.drives else 0.0)
    slots = pin_slots(graph.plan, module)
    spread = _spread(box, len(slots))
    places = {(m, -1 - k): (spread[slot], bottom) for slot, k in enumerate(slots) if k is not None}
    found = _depths_of(graph, m)
    deepest = max(found.values(), default=0)
    for depth in range(1, deepest + 1):
        layer = _sorted_by_sources(graph, m, [node for node in graph.hidden[m] if found[node] == depth], places)
        y = bottom + (top - bottom) * depth / (deepest + 1)
        places |= {(m, node): (x, y) for node, x in zip(layer, _spread(box, len(layer)), strict=True)}
    places |= {(m, output): (x, top) for output, x in enumerate(_spread(box, module.outputs))}
    for depth in range(1, deepest + 1):
        layer = [node for node in graph.hidden[m] if found[node] == depth]
        places |= _sidestepped(graph, m, layer, places, step=(box.width - 2 * SIDE) / len(layer))
    return places


def _spread(box: Box, count: int) -> list[float]:
    """`count` places across the box, centred, each in the middle of an equal share of its width."""
    room = box.width - 2 * SIDE
    return [box.x + SIDE + room * (k + 0.5) / count for k in range(count)]


def _sorted_by_sources(
    graph: ChampionGraph, m: int, layer: list[int], places: dict[Node, tuple[float, float]]
) -> list[int]:
    """Nodes in the order of the mean place of what they read, weighted, so that fewer lines cross."""
    centres = {}
    for node in layer:
        incoming = [e for e in graph.edges if e.target == (m, node) and e.source in places]
        weights = [abs(edge.weight) for edge in incoming]
        x = [places[edge.source][0] for edge in incoming]
        centres[node] = float(np.average(x, weights=weights)) if sum(weights) > 0 else np.inf
    return sorted(layer, key=lambda node: (centres[node], node))


def _sidestepped(
    graph: ChampionGraph, m: int, layer: list[int], places: dict[Node, tuple[float, float]], step: float
) -> dict[Node, tuple[float, float]]:
    """The layer, moved aside if connections that skip it would seem to end at its nodes."""
    passing = [
        (places[e.source], places[e.target])
        for e in graph.edges
        if e.source[0] == m and e.source[1] not in layer and e.target[1] not in layer
    ]

    def shifted(share: float) -> dict[Node, tuple[float, float]]:
        return {(m, node): (places[m, node][0] + share * step, places[m, node][1]) for node in layer}

    def hits(share: float) -> int:
        return sum(_touches(start, end, at) for at in shifted(share).values() for start, end in passing)

    return shifted(min(_SHIFTS, key=hits))


def _touches(start: tuple[float, float], end: tuple[float, float], at: tuple[float, float]) -> bool:
    if not min(start[1], end[1]) < at[1] < max(start[1], end[1]):
        return False
    x = start[0] + (at[1] - start[1]) / (end[1] - start[1]) * (end[0] - start[0])
    return abs(x - at[0]) < _CLEAR
