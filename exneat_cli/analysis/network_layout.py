"""Where a champion's modules and nodes go on the page, in inches, and what is written beside them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import groupby

import numpy as np
from matplotlib.transforms import Bbox

from exneat_cli.analysis.champion_graph import Edge, Node, depths, edges_of, hidden_of
from exneat_cli.records.champion import Champion
from exneat_cli.wiring import Module

Places = dict[Node, tuple[float, float]]
"""(x, y) of inputs and nodes."""

# Inches. Links run in the gap between boxes. What a box keeps free of nodes: at its top, above outputs that drive
# something (more where their names stand upright), at its sides, and at its bottom, besides the names of inputs.
GAP = 0.3
TITLE, OUTPUT_NAMES, SIDE, BELOW = 0.32, 0.3, 0.2, 0.15
# Of a name below an input: its size in points, inches per character, and the characters that are shown at most.
NAME_SIZE, CHARACTER, LONGEST_NAME = 5.0, 0.035, 48
KIND_SIZE = 6.0  # points, of the name of many inputs
# Points, of a name above an output: it stands upright where it would be smaller lying. Width of a letter as a share.
LARGEST_LYING, SMALLEST_LYING, LETTER = 7.0, 3.5, 0.64
POINTS = 72.0  # per inch
# Least distances: of layers, of inputs, of outputs that carry a name, of a node from connections that pass it.
LAYER, INPUT, ACTUATOR, CLEAR = 0.55, 0.09, 0.5, 0.08

MOST_NAMED = 60
"""With more inputs than this, a module's inputs are named by kind."""
_SHIFTS = (0.0, 0.15, -0.15, 0.3, -0.3)
"""Shares of the distance between its nodes by which a layer may move aside; among equals, the first is used."""
_SAME_ROW = 0.1
"""Modules whose distance is below this share of the body's length stand in one row."""


def are_by_kind(champion: Champion, m: int) -> bool:
    """Whether module `m` has too many inputs to name each of them."""
    return len(champion.plan.modules[m].pins) > MOST_NAMED


def input_groups(champion: Champion, m: int) -> list[list[int]]:
    """The inputs of module `m` from left to right; those that read one kind of thing make a group.

    In their order or, if there are too many to name each, with sensors of one quantity side by side.
    """
    plan, pins = champion.plan, champion.plan.modules[m].pins
    if not are_by_kind(champion, m):
        return [list(group) for _, group in groupby(range(len(pins)), key=lambda k: plan.kind_of(pins[k]))]
    groups: dict[tuple[str, str], list[int]] = {}
    for k, pin in enumerate(pins):
        quantity = _quantity(champion.name_of(pin)) if pin.is_sensor else ""
        groups.setdefault((plan.kind_of(pin), quantity), []).append(k)
    return list(groups.values())


def group_name(champion: Champion, m: int, group: Sequence[int]) -> str:
    """How many inputs of module `m` are in a group, and what they read."""
    pin = champion.plan.modules[m].pins[group[0]]
    quantity = _quantity(champion.name_of(pin)) if pin.is_sensor and are_by_kind(champion, m) else ""
    others = {"sensor": "sensors", "output": "outputs of others", "hidden": "hidden nodes of others"}
    return f"{len(group)} {quantity or others[champion.plan.kind_of(pin)]}"


def _quantity(name: str) -> str:
    """What a sensor measures, with its unit: "velocity (m/s)" of "trunk velocity x (m/s)"."""
    subject, _, unit = name.replace("_", " ").partition(" (")
    words = [word for word in subject.partition(",")[0].split() if len(word) > 1 and not word.isdigit()]
    return (words or [subject])[-1] + (f" ({unit}" if unit else "")


def input_names(champion: Champion, m: int) -> list[str]:
    """What the inputs of module `m` read, cut to what is shown."""
    names = [champion.name_of(pin).replace("_", " ") for pin in champion.plan.modules[m].pins]
    return [name if len(name) <= LONGEST_NAME else f"{name[: LONGEST_NAME - 3]}..." for name in names]


def below_inputs(champion: Champion) -> float:
    """Inches below the inputs, alike in all modules: their longest name stands upright there."""
    lengths = []
    for m in range(len(champion.plan.modules)):
        groups = input_groups(champion, m) if are_by_kind(champion, m) else []
        names = [group_name(champion, m, group) for group in groups] or input_names(champion, m)
        lengths += [len(name) * (KIND_SIZE / NAME_SIZE if groups else 1.0) for name in names]
    return BELOW + CHARACTER * max(8, *lengths)


def output_names(champion: Champion, m: int, room: float) -> tuple[list[str], float, bool]:
    """What stands above the outputs of module `m` that are `room` inches apart.

    Returns the names of the actuators that they drive, their size in points and whether they stand upright.
    """
    names = [champion.actuators[actuator].replace("_", " ") for actuator in champion.plan.modules[m].drives]
    lying = [name.replace(" (", "\n(") for name in names]  # the unit has a line of its own
    widest = 1 + max((len(line) for name in lying for line in name.split("\n")), default=0)
    size = POINTS * room / (LETTER * widest)
    if size >= SMALLEST_LYING:
        return lying, min(size, LARGEST_LYING), False
    return names, min(NAME_SIZE, 0.9 * POINTS * room), True


def above_outputs(champion: Champion, width: float) -> float:
    """Inches above outputs that drive something, alike in all modules, on a page of that width."""
    room = _box_width(champion, width) - 2 * SIDE
    upright = []
    for m, module in enumerate(champion.plan.modules):
        names, _, is_upright = output_names(champion, m, room / module.outputs)
        upright += names if is_upright else []
    return max(OUTPUT_NAMES, BELOW + CHARACTER * max(map(len, upright), default=0))


def _box_width(champion: Champion, width: float) -> float:
    columns = max(len(row) for row in _rows(champion.plan.modules))
    return (width - (columns - 1) * GAP) / columns


def natural_size(champion: Champion) -> tuple[float, float]:
    """Width and height at which everything can be told apart, within what fits on a screen."""
    modules = champion.plan.modules
    rows = _rows(modules)
    columns = max(len(row) for row in rows)
    slots = [len(module.pins) + len(input_groups(champion, m)) - 1 for m, module in enumerate(modules)]
    room = max(*(INPUT * count for count in slots), *(ACTUATOR * len(module.drives) for module in modules))
    deepest = max(depths(hidden_of(champion), edges_of(champion)).values(), default=0)
    width = columns * (2 * SIDE + room) + (columns - 1) * GAP
    wide = float(np.clip(width, 6.4, 12.0))
    besides = TITLE + above_outputs(champion, wide) + below_inputs(champion)
    height = len(rows) * (besides + LAYER * (deepest + 1)) + (len(rows) - 1) * GAP
    return wide, float(np.clip(height, 0.55 * width, 13.0).clip(4.0))


def lay_out(champion: Champion, width: float, height: float, *, named: bool = True) -> tuple[list[Bbox], Places]:
    """Place every module in a box, and the nodes within it, on a page of the given size; rows of boxes are centred.

    If `named`, there is room for the names of inputs.
    """
    rows = _rows(champion.plan.modules)
    box_width = _box_width(champion, width)
    below, above = below_inputs(champion) if named else BELOW, above_outputs(champion, width)
    box_height = (height - (len(rows) - 1) * GAP) / len(rows)
    boxes: dict[int, Bbox] = {}
    places: Places = {}
    for r, row in enumerate(rows):
        left = (width - len(row) * box_width - (len(row) - 1) * GAP) / 2
        bottom = height - (r + 1) * box_height - r * GAP
        for c, m in enumerate(row):
            boxes[m] = Bbox.from_bounds(left + c * (box_width + GAP), bottom, box_width, box_height)
            places |= _places(champion, m, boxes[m], below, above)
    return [boxes[m] for m in sorted(boxes)], places


def _rows(modules: Sequence[Module]) -> list[list[int]]:
    """Indices of modules from the top row of the page to the bottom one, each from left to right.

    A body looks up the page: x ahead is up, y to the left is left. The parts of a map, which are called
    up and down, keep the map's x and y.
    """
    is_map = any(module.name in ("up", "down") for module in modules)
    right = [module.position[0] if is_map else -module.position[1] for module in modules]
    up = [module.position[1] if is_map else module.position[0] for module in modules]
    tolerance = _SAME_ROW * (max(up) - min(up))
    rows: list[list[int]] = []
    for m in sorted(range(len(modules)), key=lambda m: -up[m]):
        if rows and up[rows[-1][0]] - up[m] <= tolerance:
            rows[-1].append(m)
        else:
            rows.append([m])
    return [sorted(row, key=lambda m: (right[m], m)) for row in rows]


def _places(champion: Champion, m: int, box: Bbox, below: float, above: float) -> Places:
    """Inputs of module `m` at the bottom, outputs at the top, hidden nodes in layers between them."""
    module = champion.plan.modules[m]
    edges = [edge for edge in edges_of(champion) if edge[0][0] == m]
    hidden = [node for node in hidden_of(champion) if node[0] == m]
    bottom, top = box.y0 + below, box.y1 - TITLE - (above if module.drives else 0.0)
    groups = input_groups(champion, m)
    slots = _spread(box, len(module.pins) + len(groups) - 1)
    # An empty slot between groups.
    in_order = [(gap, k) for gap, group in enumerate(groups) for k in group]
    places = {(m, -1 - k): (slots[place + gap], bottom) for place, (gap, k) in enumerate(in_order)}
    depth = depths(hidden, edges)
    layers = [list(layer) for _, layer in groupby(sorted(hidden, key=depth.__getitem__), key=depth.__getitem__)]
    for d, layer in enumerate(layers, start=1):
        y = bottom + (top - bottom) * d / (len(layers) + 1)
        ordered = sorted(layer, key=lambda node: (_centre(node, edges, places), node))
        places |= {node: (x, y) for node, x in zip(ordered, _spread(box, len(layer)), strict=True)}
    places |= {(m, output): (x, top) for output, x in enumerate(_spread(box, module.outputs))}
    for layer in layers:
        places |= _sidestepped(layer, edges, places, step=(box.width - 2 * SIDE) / len(layer))
    return places


def _spread(box: Bbox, count: int) -> list[float]:
    """`count` places across the box, centred, each in the middle of an equal share of its width."""
    room = box.width - 2 * SIDE
    return [box.x0 + SIDE + room * (k + 0.5) / count for k in range(count)]


def _centre(node: Node, edges: Iterable[Edge], places: Places) -> float:
    """The mean place of what a node reads, weighted: in this order, fewer lines cross."""
    read = [(places[source][0], abs(weight)) for source, target, weight in edges if target == node and source in places]
    total = sum(weight for _, weight in read)
    return sum(x * weight for x, weight in read) / total if total > 0 else np.inf


def _sidestepped(layer: Sequence[Node], edges: Iterable[Edge], places: Places, step: float) -> Places:
    """The places of a layer, moved aside if connections that skip it would seem to end at its nodes."""
    y = places[layer[0]][1]
    crossings = []
    for source, target, _ in edges:
        (x0, y0), (x1, y1) = places[source], places[target]
        if min(y0, y1) < y < max(y0, y1):
            crossings.append(x0 + (y - y0) / (y1 - y0) * (x1 - x0))

    def hits(share: float) -> int:
        return sum(abs(places[node][0] + share * step - x) < CLEAR for node in layer for x in crossings)

    share = min(_SHIFTS, key=hits)
    return {node: (places[node][0] + share * step, y) for node in layer}
