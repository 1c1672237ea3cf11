"""Where the modules and nodes of a champion go on the page, in inches; pure geometry."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import groupby

import numpy as np
from matplotlib.transforms import Bbox

from exneat_cli.analysis.network_data import ChampionGraph, Edge
from exneat_cli.wiring import Module

Places = dict[int, tuple[float, float]]
"""(x, y) of the inputs and nodes of one module, by key."""

# Inches. Links run in the gap between boxes. What a box keeps free of nodes: at its top, above outputs that drive
# something, at its bottom, at its sides.
GAP = 0.3
TITLE, OUTPUT_NAMES, INPUT_NAMES, SIDE = 0.32, 0.2, 0.6, 0.2
# Least distances: of layers, of inputs, of outputs that carry a name, of a node from connections that pass it.
LAYER, INPUT, ACTUATOR, CLEAR = 0.55, 0.09, 0.5, 0.08

_SHIFTS = (0.0, 0.15, -0.15, 0.3, -0.3)
"""By how much of the distance between its nodes a layer may move aside; the first is best among equals."""
_SAME_ROW = 0.1
"""Modules whose distance is below this share of the body's length stand in one row."""


def page_direction(modules: Sequence[Module]) -> list[tuple[float, float]]:
    """Say where each module lies as one looks at the page: to the right, and up.

    A body looks up the page: x ahead is up, y to the left is left. The parts of a map, which are called
    up and down, keep the map's x and y.
    """
    if any(module.name in ("up", "down") for module in modules):
        return [module.position for module in modules]
    return [(-module.position[1], module.position[0]) for module in modules]


def natural_size(graph: ChampionGraph) -> tuple[float, float]:
    """Width and height at which everything can be told apart, within what fits on a screen."""
    modules = graph.plan.modules
    rows = _rows(page_direction(modules))
    widest = max(len(row) for row in rows)
    slots = [len(own) + len(input_groups(graph, m)) - 1 for m, own in enumerate(graph.inputs)]
    room = max(max(INPUT * count, ACTUATOR * len(module.drives)) for count, module in zip(slots, modules, strict=True))
    deepest = max(max(depths(graph.hidden[m], graph.edges[m]).values(), default=0) for m in range(len(modules)))
    width = widest * (2 * SIDE + room) + (widest - 1) * GAP
    height = len(rows) * (TITLE + OUTPUT_NAMES + INPUT_NAMES + LAYER * (deepest + 1)) + (len(rows) - 1) * GAP
    return float(np.clip(width, 6.4, 12.0)), float(np.clip(height, 0.55 * width, 10.0).clip(4.0))


def lay_out(graph: ChampionGraph, width: float, height: float) -> tuple[list[Bbox], list[Places]]:
    """Place every module in a box, and the nodes within it, on a page of the given size; rows of boxes are centred."""
    rows = _rows(page_direction(graph.plan.modules))
    columns = max(len(row) for row in rows)
    box_width = (width - (columns - 1) * GAP) / columns
    box_height = (height - (len(rows) - 1) * GAP) / len(rows)
    boxes: dict[int, Bbox] = {}
    for r, row in enumerate(rows):
        left = (width - len(row) * box_width - (len(row) - 1) * GAP) / 2
        bottom = height - (r + 1) * box_height - r * GAP
        for c, m in enumerate(row):
            boxes[m] = Bbox.from_bounds(left + c * (box_width + GAP), bottom, box_width, box_height)
    return [boxes[m] for m in sorted(boxes)], [_places(graph, m, boxes[m]) for m in sorted(boxes)]


def input_groups(graph: ChampionGraph, m: int) -> list[list[int]]:
    """The inputs of module `m` in their order; neighbours that read one kind of thing make a group."""
    inputs = graph.inputs[m]
    return [list(group) for _, group in groupby(range(len(inputs)), key=lambda k: graph.kind_of(inputs[k]))]


def depths(hidden: Iterable[int], edges: Iterable[Edge]) -> dict[int, int]:
    """Find the layer of each hidden node, from 1: one more than that of its deepest source, inputs being 0.

    Connections out of outputs and those that close a cycle do not count. In a cycle the node comes
    first that inputs or placed nodes reach, then the one that waits for fewest, then the lowest.
    """
    sources: dict[int, set[int]] = {node: set() for node in sorted(hidden)}
    for source, target, _ in edges:
        if target in sources and source != target and (source < 0 or source in sources):
            sources[target].add(source)
    found: dict[int, int] = {}

    def turn(node: int) -> tuple[bool, bool, int]:
        waits_for = sum(source >= 0 and source not in found for source in sources[node])
        return waits_for > 0, waits_for == len(sources[node]), waits_for

    while len(found) < len(sources):
        chosen = min((node for node in sources if node not in found), key=turn)
        found[chosen] = 1 + max((found.get(source, 0) for source in sources[chosen]), default=0)
    return found


def _rows(directions: Sequence[tuple[float, float]]) -> list[list[int]]:
    """Indices of modules from the top row to the bottom one, each from left to right."""
    heights = [up for _, up in directions]
    tolerance = _SAME_ROW * (max(heights) - min(heights))
    rows: list[list[int]] = []
    for m in sorted(range(len(directions)), key=lambda m: -heights[m]):
        if rows and heights[rows[-1][0]] - heights[m] <= tolerance:
            rows[-1].append(m)
        else:
            rows.append([m])
    return [sorted(row, key=lambda m: (directions[m][0], m)) for row in rows]


def _places(graph: ChampionGraph, m: int, box: Bbox) -> Places:
    """Inputs at the bottom, outputs at the top, hidden nodes in layers between them."""
    module, edges = graph.plan.modules[m], graph.edges[m]
    bottom, top = box.y0 + INPUT_NAMES, box.y1 - TITLE - (OUTPUT_NAMES if module.drives else 0.0)
    groups = input_groups(graph, m)
    slots = _spread(box, len(module.pins) + len(groups) - 1)
    # An empty slot between groups.
    places = {-1 - k: (slots[k + gap], bottom) for gap, group in enumerate(groups) for k in group}
    depth = depths(graph.hidden[m], edges)
    by_depth = sorted(graph.hidden[m], key=depth.__getitem__)
    layers = [list(layer) for _, layer in groupby(by_depth, key=depth.__getitem__)]
    for d, layer in enumerate(layers, start=1):
        y = bottom + (top - bottom) * d / (len(layers) + 1)
        ordered = sorted(layer, key=lambda node: (_centre(node, edges, places), node))
        places |= {node: (x, y) for node, x in zip(ordered, _spread(box, len(layer)), strict=True)}
    places |= {output: (x, top) for output, x in enumerate(_spread(box, module.outputs))}
    for layer in layers:
        places |= _sidestepped(layer, edges, places, step=(box.width - 2 * SIDE) / len(layer))
    return places


def _spread(box: Bbox, count: int) -> list[float]:
    """`count` places across the box, centred, each in the middle of an equal share of its width."""
    room = box.width - 2 * SIDE
    return [box.x0 + SIDE + room * (k + 0.5) / count for k in range(count)]


def _centre(node: int, edges: Iterable[Edge], places: Places) -> float:
    """The mean place of what a node reads, weighted: nodes in this order have fewer lines cross."""
    read = [edge for edge in edges if edge.target == node and edge.source in places]
    total = sum(abs(edge.weight) for edge in read)
    return sum(places[edge.source][0] * abs(edge.weight) for edge in read) / total if total > 0 else np.inf


def _sidestepped(layer: Sequence[int], edges: Iterable[Edge], places: Places, step: float) -> Places:
    """The layer, moved aside if connections that skip it would seem to end at its nodes."""
    y = places[layer[0]][1]
    crossings = []
    for edge in edges:
        (x0, y0), (x1, y1) = places[edge.source], places[edge.target]
        if min(y0, y1) < y < max(y0, y1):
            crossings.append(x0 + (y - y0) / (y1 - y0) * (x1 - x0))

    def hits(share: float) -> int:
        return sum(abs(places[node][0] + share * step - x) < CLEAR for node in layer for x in crossings)

    share = min(_SHIFTS, key=hits)
    return {node: (places[node][0] + share * step, y) for node in layer}
