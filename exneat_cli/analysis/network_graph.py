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
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Ellipse, FancyArrowPatch, FancyBboxPatch
from matplotlib.transforms import Bbox

from exneat_cli.analysis import styles
from exneat_cli.analysis.network_data import SENSORS, ChampionGraph, read_champion_graph
from exneat_cli.analysis.network_layout import Places, input_groups, lay_out, natural_size
from exneat_cli.records import RunDirectory

POSITIVE, NEGATIVE = styles.BLUE, styles.VERMILION
MODULE_COLOURS = (styles.GREEN, styles.ORANGE, styles.PURPLE, styles.SKY, styles.OLIVE, styles.BLACK)
"""Of the boxes, and of the links that leave them; none is a colour of weights."""
FAINT = 0.13
"""Opacity of what has no part in what the agent does."""
_GREY, _INNER = styles.GREY, "#999999"
_POINTS = 72.0  # per inch
_LEAST_ROOM, _ROOM_TO_STAND = 6.2, 16.0  # points from one input to the next that a rotated and an upright index need
_BOW = 0.15  # how far links swing aside, as a share of their length; there and back swing to different sides
_ALIKE = 0.98  # share of the weights whose widths differ: beside a single outlier all others would vanish
_MANY_LINKS, _MANY_EDGES = 40, 200


def draw_network(run: RunDirectory) -> list[Path]:
    """Draw the champion's networks, as PNG and SVG among the run's own plots.

    Raises:
        ExneatError: the run has no champion, or its file is damaged.
    """
    graph = read_champion_graph(run)
    title = f"{run.path.name}: champion, test fitness {graph.test_fitness:.4g}"
    return styles.save_figure(champions_figure(title, [graph]), run.plots / "network")


def champions_figure(title: str, graphs: Sequence[ChampionGraph], titles: Sequence[str] = ()) -> Figure:
    """Draw champions side by side, with a legend; each with a title of its own, or none."""
    sizes = [natural_size(graph) for graph in graphs]
    widths = [wide for wide, _ in sizes]
    width, height = sum(widths) + 0.3 * (len(widths) - 1), max(tall for _, tall in sizes)
    with styles.style():
        figure = Figure(figsize=(width, height + (1.6 if titles else 1.0)), layout="constrained")
        panels = figure.subplots(1, len(graphs), squeeze=False, width_ratios=widths)[0]
        for axes, graph, wide in zip(panels, graphs, widths, strict=True):
            draw_champion(axes, graph, wide, height)
        for axes, words in zip(panels, titles, strict=False):
            axes.set_title(words, fontsize=10)
        figure.suptitle(title, fontsize=12 if titles else 11)
        columns = max(2, int(width // 2.6))
        figure.legend(handles=legend_entries(graphs), loc="outside lower center", ncols=columns, fontsize=8)
    return figure


def draw_champion(axes: Axes, graph: ChampionGraph, width: float, height: float) -> None:
    """Draw a champion on empty axes, which lose their frame and ticks; text is made to fit their size in inches."""
    boxes, places = lay_out(graph, width, height)
    axes.set(xlim=(-0.02, width + 0.02), ylim=(-0.02, height + 0.02))
    axes.set_axis_off()
    _draw_links(axes, graph, places)
    for m, box in enumerate(boxes):
        _draw_box(axes, graph, m, box)
        _draw_edges(axes, graph, m, places[m])
        _draw_nodes(axes, graph, m, places[m])
        _name_inputs(axes, graph, m, places[m])
        for output, actuator in enumerate(graph.plan.modules[m].drives):
            x, y = places[m][output]
            name = graph.actuators[actuator].replace("_", " ")
            axes.text(x, y + 0.08, name, fontsize=7, ha="center", va="bottom", zorder=5)


def legend_entries(graphs: Sequence[ChampionGraph]) -> list[Artist]:
    """Say what lines and shapes mean, as far as they occur in one of `graphs`."""
    thickest = " and ".join(f"{_thick_from(graph):.2g}" for graph in graphs)
    delays = {link.delayed for graph in graphs for link in graph.links}
    loops = not all(graph.feed_forward for graph in graphs)
    entries: dict[str, styles.Look] = {
        "positive weight": {"color": POSITIVE, "linewidth": 2.0},
        "negative weight": {"color": NEGATIVE, "linewidth": 2.0},
        f"thicker: further from 0, up to {thickest}": {"linewidth": 2.8},
        "faint: on no path from a sensor to an actuator": {"alpha": 0.3, "marker": "o"},
        "sensor": _dot("white"),
        **({"reads another module": _dot(_INNER, marker="s")} if delays else {}),
        "hidden node": _dot(_INNER),
        "output": _dot(_GREY),
        **({"loop or arc: to itself, sideways or back": _dot("none", markersize=9.0)} if loops else {}),
        **({"link, coloured as the module it leaves": {}} if False in delays else {}),
        **({"link, coloured likewise, one step late": {"linestyle": "--"}} if True in delays else {}),
    }
    return [Line2D([], [], label=label, **{"color": _GREY, **look}) for label, look in entries.items()]


def _dot(face: str, **look: Any) -> styles.Look:
    return {"linestyle": "", "marker": "o", "markersize": 6.0, "markerfacecolor": face, **look}


def _colour(m: int) -> str:
    return MODULE_COLOURS[m % len(MODULE_COLOURS)]


def _draw_box(axes: Axes, graph: ChampionGraph, m: int, box: Bbox) -> None:
    module = graph.plan.modules[m]
    look: styles.Look = {"facecolor": to_rgba(_colour(m), 0.07), "edgecolor": to_rgba(_colour(m), 0.8)}
    corner, width, height = (box.x0 + 0.05, box.y0 + 0.05), box.width - 0.1, box.height - 0.1
    axes.add_patch(FancyBboxPatch(corner, width, height, boxstyle="round,pad=0.05", linewidth=1.0, zorder=0, **look))
    sharers = sum(other.subpopulation == module.subpopulation for other in graph.plan.modules)
    shared = f"  (genome {module.subpopulation + 1}, shared by {sharers})" if sharers > 1 else ""
    name = module.name.replace("_", " ") + shared
    axes.text(box.x0 + 0.1, box.y1 - 0.14, name, fontsize=8.5, va="center", weight="bold", zorder=5)


def _draw_curve(axes: Axes, start: tuple[float, float], end: tuple[float, float], bow: float, **look: Any) -> None:
    bent = f"arc3,rad={bow}"
    axes.add_patch(FancyArrowPatch(start, end, connectionstyle=bent, arrowstyle="-", shrinkA=0, shrinkB=0, **look))


def _draw_links(axes: Axes, graph: ChampionGraph, places: Sequence[Places]) -> None:
    opacity, width = (0.45, 0.6) if len(graph.links) > _MANY_LINKS else (0.8, 0.9)
    for link in graph.links:
        (source, start), (target, end) = link.source, link.target
        look = {
            "edgecolor": _colour(source),
            "alpha": opacity if {link.source, link.target} <= graph.used else FAINT,
            "linewidth": width,
            "linestyle": (0.0, (4.0, 2.5)) if link.delayed else "-",
        }
        _draw_curve(axes, places[source][start], places[target][end], _BOW, zorder=1, **look)


def _thick_from(graph: ChampionGraph) -> float:
    """Weights from here on are drawn alike."""
    return float(np.quantile([abs(edge.weight) for own in graph.edges for edge in own] or [0.0], _ALIKE))


def _draw_edges(axes: Axes, graph: ChampionGraph, m: int, places: Places) -> None:
    """Draw light ones first, so that the heavy ones stay visible among hundreds."""
    limit = _thick_from(graph) or 1.0
    many = sum(len(own) for own in graph.edges) > _MANY_EDGES
    thickest, contrast = (2.2, 1.5) if many else (2.8, 1.0)
    lines, widths, colours = [], [], []
    for edge in sorted(graph.edges[m], key=lambda edge: abs(edge.weight)):
        start, end = places[edge.source], places[edge.target]
        share = min(1.0, abs(edge.weight) / limit)
        is_used = {(m, edge.source), (m, edge.target)} <= graph.used
        opacity = 0.16 + 0.74 * share**contrast if is_used else FAINT
        colour = to_rgba(POSITIVE if edge.weight >= 0 else NEGATIVE, opacity)
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


def _draw_nodes(axes: Axes, graph: ChampionGraph, m: int, places: Places) -> None:
    inputs = graph.inputs[m]
    small = 10.0 if len(inputs) > 30 else 22.0
    groups = (
        ([-1 - k for k, source in enumerate(inputs) if source[0] == SENSORS], "o", "white", small),
        ([-1 - k for k, source in enumerate(inputs) if source[0] != SENSORS], "s", _INNER, small),
        (graph.hidden[m], "o", _INNER, 34.0),
        (range(graph.plan.modules[m].outputs), "o", _GREY, 34.0),
    )
    for keys, marker, face, size in groups:
        opacity = [1.0 if (m, key) in graph.used else 2 * FAINT for key in keys]
        faces, rims = ([to_rgba(colour, alpha) for alpha in opacity] for colour in (face, _GREY))
        if keys:
            x, y = zip(*(places[key] for key in keys), strict=True)
            axes.scatter(x, y, size, faces, marker=marker, edgecolors=rims, linewidths=0.7, zorder=3)


def _name_inputs(axes: Axes, graph: ChampionGraph, m: int, places: Places) -> None:
    """Write indices under the sensors where they fit, and a bracket with words under each group of inputs."""
    inputs = graph.inputs[m]
    x = [places[-1 - k][0] for k in range(len(inputs))]
    room = _POINTS * min((right - left for left, right in pairwise(x)), default=1.0)
    for group in input_groups(graph, m):
        y = places[-1 - group[0]][1]
        kind = graph.kind_of(inputs[group[0]])
        if kind == "sensors" and room >= _LEAST_ROOM:
            turn = 90 if room < _ROOM_TO_STAND else 0
            for k in group:
                axes.text(x[k], y - 0.06, str(inputs[k][1]), fontsize=5.5, rotation=turn, ha="center", va="top")
        left, right = x[group[0]], x[group[-1]]
        axes.plot([left - 0.03, right + 0.03], [y - 0.28, y - 0.28], color=_GREY, linewidth=0.7)
        # In two lines, as groups of links are narrow.
        sources = {inputs[k][0] for k in group}
        whose = graph.plan.modules[sources.pop()].name.replace("_", " ") if len(sources) == 1 else "others"
        words = "sensors, by index" if kind == "sensors" else f"{kind} of\n{whose}"
        axes.text((left + right) / 2, y - 0.31, words, fontsize=6.0, ha="center", va="top")
