"""A champion's networks as a picture: modules where they sit on the body, layered from inputs to outputs."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_hex, to_rgb, to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Ellipse, FancyArrowPatch, FancyBboxPatch
from matplotlib.transforms import Bbox

from exneat_cli.analysis import champion_graph as graph
from exneat_cli.analysis import network_layout as layout
from exneat_cli.analysis import styles
from exneat_cli.analysis.champion_graph import Node
from exneat_cli.analysis.network_layout import Places
from exneat_cli.errors import ExneatError
from exneat_cli.records import RunDirectory
from exneat_cli.records.champion import Champion, read_champion

POSITIVE, NEGATIVE = "#00508a", "#ee7733"
"""Colours of weights, one dark and one light, so that they differ in grey print."""
MODULE_COLOURS = (styles.GREEN, styles.ORANGE, styles.PURPLE, styles.SKY, styles.OLIVE, styles.BLACK)
"""Colours of the boxes and of the links that leave them; none is a colour of weights."""
FAINT = 0.13
"""Opacity of what has no effect on what the agent does."""
_GREY, _INNER = styles.GREY, "#999999"
_LEAST_ROOM = 5.4  # points between inputs that names need
_BOW = 0.15  # how far links swing aside, as a share of their length; there and back swing to different sides
_ALIKE = 0.98  # share of the weights drawn with different widths: next to an outlier, all others would vanish
_MANY_LINKS, _MANY_EDGES = 40, 200


def draw_network(run: RunDirectory) -> list[Path]:
    """Draw the champion's networks, as PNG and SVG among the run's own plots.

    Raises:
        ExneatError: the run has no champion, or its file is damaged.
    """
    champion = champion_of(run)
    title = f"{styles.run_title(run)}: champion, test fitness {champion.scores.test.fitness_mean:.4g}"
    return styles.save_figure(champions_figure(title, [champion]), run.plots / "network")


def champion_of(run: RunDirectory) -> Champion:
    """Read the champion of a run.

    Raises:
        ExneatError: it has none, like baselines and unfinished runs, or its file is damaged.
    """
    if not run.champion.exists():
        raise ExneatError(f"{run.path}: expected a champion, got none: baselines and unfinished runs have no network")
    return read_champion(run.champion)


def champions_figure(
    title: str, champions: Sequence[Champion], titles: Sequence[str] = (), paper: styles.Paper = styles.SCREEN
) -> Figure:
    """Draw champions side by side, with a legend; each with a title of its own, or none.

    Their size is what they need, even on paper.
    """
    widths, heights = zip(*(layout.natural_size(champion) for champion in champions), strict=True)
    width, height = sum(widths) + 0.3 * (len(widths) - 1), max(heights)
    with paper.style():
        figure = Figure(figsize=(width, height + (1.6 if titles else 1.0)), layout="constrained")
        panels = figure.subplots(1, len(champions), squeeze=False, width_ratios=widths)[0]
        for axes, champion, wide in zip(panels, champions, widths, strict=True):
            draw_champion(axes, champion, wide, height)
        for axes, words in zip(panels, titles, strict=False):
            axes.set_title(words)
        if paper.columns is None:
            figure.suptitle(title)
        columns = max(2, int(width // 2.6))
        figure.legend(handles=legend_entries(champions), loc="outside lower center", ncols=columns)
    return figure


def draw_champion(axes: Axes, champion: Champion, width: float, height: float, *, with_nodes: bool = True) -> Places:
    """Draw a champion on empty axes, which lose their frame and ticks; text is made to fit their size in inches.

    Returns the places of the nodes; if not `with_nodes`, nodes and names of inputs are left for the caller to draw.
    """
    boxes, places = layout.lay_out(champion, width, height, named=with_nodes)
    used = graph.used_nodes(champion)
    axes.set(xlim=(-0.02, width + 0.02), ylim=(-0.02, height + 0.02))
    axes.set_axis_off()
    _draw_links(axes, champion, places, used)
    _draw_edges(axes, champion, places, used)
    for m, box in enumerate(boxes):
        _draw_box(axes, champion, m, box)
        if with_nodes:
            _draw_nodes(axes, champion, m, places, used)
        _name_outputs(axes, champion, m, places)
        if with_nodes:
            _name_inputs(axes, champion, m, places)
    return places


def legend_entries(champions: Sequence[Champion]) -> list[Artist]:
    """Entries that explain the lines and shapes that occur in `champions`."""
    thickest = " and ".join(f"{_thick_from(champion):.2g}" for champion in champions)
    hidden = sum(len(graph.edges_of(champion)) - len(graph.strongest_edges(champion)) for champion in champions)
    delays = {is_delayed for champion in champions for _, _, is_delayed in graph.links_of(champion)}
    loops = not all(champion.feed_forward for champion in champions)
    entries: dict[str, styles.Look] = {
        "positive weight": {"color": POSITIVE, "linewidth": 2.0},
        "negative weight": {"color": NEGATIVE, "linewidth": 2.0},
        f"thicker: further from 0, up to {thickest}": {"linewidth": 2.8},
        **({f"left out: the {hidden} weakest connections": {"linestyle": ""}} if hidden else {}),
        "faint: on no path from a sensor to an actuator": {"alpha": 0.3, "marker": "o"},
        "sensor": _dot("white"),
        **({"reads another module": _dot(_INNER, marker="s")} if delays else {}),
        "hidden node": _dot(_INNER),
        "output": _dot(_GREY),
        **({"loop or arc: to itself, sideways or back": _dot("none", markersize=9.0)} if loops else {}),
        **({"link, coloured like its source module": {}} if False in delays else {}),
        **({"link, one step late, coloured likewise": {"linestyle": "--"}} if True in delays else {}),
    }
    return [Line2D([], [], label=label, **{"color": _GREY, **look}) for label, look in entries.items()]


def _dot(face: str, **look: Any) -> styles.Look:
    return {"linestyle": "", "marker": "o", "markersize": 6.0, "markerfacecolor": face, **look}


def _colour(m: int) -> str:
    """A distinct colour for every module: beyond `MODULE_COLOURS` they repeat, each time halfway closer to grey."""
    turn, k = divmod(m, len(MODULE_COLOURS))
    share = 0.5**turn
    red, green, blue = (share * own + (1.0 - share) * 0.75 for own in to_rgb(MODULE_COLOURS[k]))
    return str(to_hex((red, green, blue)))


def _draw_box(axes: Axes, champion: Champion, m: int, box: Bbox) -> None:
    modules = champion.plan.modules
    look: styles.Look = {"facecolor": to_rgba(_colour(m), 0.07), "edgecolor": to_rgba(_colour(m), 0.8)}
    corner, width, height = (box.x0 + 0.05, box.y0 + 0.05), box.width - 0.1, box.height - 0.1
    axes.add_patch(FancyBboxPatch(corner, width, height, boxstyle="round,pad=0.05", linewidth=1.0, zorder=0, **look))
    genome = modules[m].subpopulation
    sharers = sum(other.subpopulation == genome for other in modules)
    shared = f"  (genome {genome + 1}, shared by {sharers})" if sharers > 1 else ""
    name = modules[m].name.replace("_", " ") + shared
    axes.text(box.x0 + 0.1, box.y1 - 0.14, name, fontsize=8.5, va="center", weight="bold", zorder=5)


def _draw_curve(axes: Axes, start: tuple[float, float], end: tuple[float, float], bow: float, **look: Any) -> None:
    bent = f"arc3,rad={bow}"
    axes.add_patch(FancyArrowPatch(start, end, connectionstyle=bent, arrowstyle="-", shrinkA=0, shrinkB=0, **look))


def _draw_links(axes: Axes, champion: Champion, places: Places, used: set[Node]) -> None:
    links = graph.links_of(champion)
    opacity, width = (0.45, 0.6) if len(links) > _MANY_LINKS else (0.8, 0.9)
    for source, target, is_delayed in links:
        alpha = opacity if {source, target} <= used else FAINT
        look = {"edgecolor": _colour(source[0]), "alpha": alpha, "linewidth": width, "zorder": 1}
        dashes = (0.0, (4.0, 2.5)) if is_delayed else "-"
        _draw_curve(axes, places[source], places[target], _BOW, linestyle=dashes, **look)


def _thick_from(champion: Champion) -> float:
    """The magnitude beyond which weights are drawn equally thick."""
    return float(np.quantile([abs(weight) for _, _, weight in graph.edges_of(champion)] or [0.0], _ALIKE))


def _draw_edges(axes: Axes, champion: Champion, places: Places, used: set[Node]) -> None:
    """Draw weak connections first, so that strong ones stay visible among hundreds."""
    edges, limit = graph.strongest_edges(champion), _thick_from(champion) or 1.0
    thickest, contrast = (2.2, 1.5) if len(edges) > _MANY_EDGES else (2.8, 1.0)
    lines, widths, colours = [], [], []
    for source, target, weight in edges:
        start, end = places[source], places[target]
        share = min(1.0, abs(weight) / limit)
        opacity = 0.16 + 0.74 * share**contrast if {source, target} <= used else FAINT
        colour = to_rgba(POSITIVE if weight >= 0 else NEGATIVE, opacity)
        look: styles.Look = {"edgecolor": colour, "linewidth": 0.3 + thickest * share, "zorder": 2}
        if end[1] > start[1]:
            lines.append([start, end])
            widths.append(look["linewidth"])
            colours.append(colour)
        elif start == end:
            axes.add_patch(Ellipse((start[0] + 0.09, start[1]), 0.18, 0.13, fill=False, **look))
        else:  # sideways or back
            _draw_curve(axes, start, end, -max(0.25, 0.12 / float(np.hypot(*np.subtract(end, start)))), **look)
    axes.add_collection(LineCollection(lines, linewidths=widths, colors=colours, capstyle="round", zorder=2))


def _draw_nodes(axes: Axes, champion: Champion, m: int, places: Places, used: set[Node]) -> None:
    """Draw inputs, hidden nodes and outputs."""
    module = champion.plan.modules[m]
    small = 10.0 if len(module.pins) > 30 else 22.0
    groups = (
        ([(m, -1 - k) for k, pin in enumerate(module.pins) if pin.is_sensor], "o", "white", small),
        ([(m, -1 - k) for k, pin in enumerate(module.pins) if not pin.is_sensor], "s", _INNER, small),
        ([node for node in graph.hidden_of(champion) if node[0] == m], "o", _INNER, 34.0),
        ([(m, output) for output in range(module.outputs)], "o", _GREY, 34.0),
    )
    for nodes, marker, face, size in groups:
        opacity = [1.0 if node in used else 2 * FAINT for node in nodes]
        faces, rims = ([to_rgba(colour, alpha) for alpha in opacity] for colour in (face, _GREY))
        if nodes:
            x, y = zip(*(places[node] for node in nodes), strict=True)
            axes.scatter(x, y, size, faces, marker=marker, edgecolors=rims, linewidths=0.7, zorder=3)


def _name_outputs(axes: Axes, champion: Champion, m: int, places: Places) -> None:
    """Write above each output the actuator that it drives, if any."""
    outputs = range(len(champion.plan.modules[m].drives))
    across = [places[m, output][0] for output in outputs]
    room = min((right - left for left, right in pairwise(across)), default=1.0)
    names, size, is_upright = layout.output_names(champion, m, room)
    look: styles.Look = {"fontsize": size, "rotation": 90 * is_upright, "linespacing": 1.0}
    for output, name in zip(outputs, names, strict=True):
        top = places[m, output][1] + 0.08
        axes.text(across[output], top, name, ha="center", va="bottom", zorder=5, **look)


def _name_inputs(axes: Axes, champion: Champion, m: int, places: Places) -> None:
    """Write under each input what it reads or, where that does not fit, how many inputs of each kind there are."""
    pins = champion.plan.modules[m].pins
    x = [places[m, -1 - k][0] for k in range(len(pins))]
    by_kind = layout.are_by_kind(champion, m)
    room = layout.POINTS * min((right - left for left, right in pairwise(x)), default=1.0)
    if not by_kind and room >= _LEAST_ROOM:
        for k, name in enumerate(layout.input_names(champion, m)):
            y = places[m, -1 - k][1] - 0.07
            axes.text(x[k], y, name, fontsize=layout.NAME_SIZE, rotation=90, ha="center", va="top")
        return
    for group in layout.input_groups(champion, m):
        left, right, y = x[group[0]], x[group[-1]], places[m, -1 - group[0]][1] - (0.07 if by_kind else 0.1)
        axes.plot([left - 0.03, right + 0.03], [y, y], color=_GREY, linewidth=0.7)
        name = layout.group_name(champion, m, group)
        look: styles.Look = {"fontsize": layout.KIND_SIZE, "rotation": 90 * by_kind, "ha": "center", "va": "top"}
        axes.text((left + right) / 2, y - 0.03, name if by_kind else name.replace(" of others", "\nof others"), **look)
