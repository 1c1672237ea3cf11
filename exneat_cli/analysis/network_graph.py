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
from matplotlib.patches import Ellipse, FancyBboxPatch, Patch, PathPatch
from matplotlib.path import Path as Outline
from matplotlib.transforms import Bbox

from exneat_cli.analysis.figures import GREY, new_figure, save_figure, style
from exneat_cli.analysis.network_data import SENSORS, ChampionGraph, Link, read_champion_graph
from exneat_cli.analysis.network_layout import Places, input_groups, lay_out, natural_size
from exneat_cli.analysis.variant_styles import BLACK, BLUE, GREEN, OLIVE, ORANGE, PURPLE, SKY, VERMILION
from exneat_cli.records import RunDirectory

POSITIVE, NEGATIVE = BLUE, VERMILION
MODULE_COLOURS = (GREEN, ORANGE, PURPLE, SKY, OLIVE, BLACK)
"""Of the boxes, and of the links that leave them; none is a colour of weights."""
FAINT = 0.13
"""Opacity of what has no part in what the agent does."""
_AROUND, _TITLE = 1.0, 0.6
"""Inches for the figure's title and the legend, and for titles of the single champions."""
_POINTS = 72.0
_LEAST_ROOM = 6.2
"""Points from one input to the next that a rotated index needs."""
_ROOM_TO_STAND = 16.0
"""The same for an upright one."""
_BOW = 0.15
"""How far links swing aside, as a share of their length; there and back swing to different sides."""
_ALIKE = 0.98
"""Share of the weights whose widths differ; see `_thick_from`."""
_MANY_LINKS, _MANY_EDGES = 40, 200


def draw_network(run: RunDirectory) -> list[Path]:
    """Draw the champion's networks, as PNG and SVG among the run's own plots.

    Raises:
        ExneatError: the run has no champion, or its file is damaged.
    """
    graph = read_champion_graph(run)
    title = f"{run.path.name}: champion, test fitness {graph.test_fitness:.4g}"
    return save_figure(champions_figure(title, [graph]), run.plots / "network")


def champions_figure(title: str, graphs: Sequence[ChampionGraph], titles: Sequence[str] = ()) -> Figure:
    """Draw champions side by side, with a legend.

    Args:
        title: of the figure.
        graphs: the champions.
        titles: of each; none leaves no room for them.
    """
    sizes = [natural_size(graph) for graph in graphs]
    widths = [wide for wide, _ in sizes]
    height = max(tall for _, tall in sizes)
    width = sum(widths) + 0.3 * (len(widths) - 1)
    with style():
        figure = new_figure(width, height + _AROUND + (_TITLE if titles else 0.0))
        panels = figure.subplots(1, len(graphs), squeeze=False, width_ratios=widths)[0]
        for k, (axes, graph) in enumerate(zip(panels, graphs, strict=True)):
            draw_champion(axes, graph, widths[k], height)
            if titles:
                axes.set_title(titles[k], fontsize=10)
        figure.suptitle(title, fontsize=12 if titles else 11)
        columns = max(2, int(width // 2.6))
        figure.legend(handles=legend_entries(graphs), loc="outside lower center", ncols=columns, fontsize=8)
    return figure


def draw_champion(axes: Axes, graph: ChampionGraph, width: float, height: float) -> None:
    """Draw a champion on empty axes.

    Args:
        axes: lose their frame and ticks.
        graph: the champion.
        width: of the axes in inches, at least roughly; text is made to fit it.
        height: the same.
    """
    boxes, places = lay_out(graph, width, height)
    axes.set(xlim=(-0.02, width + 0.02), ylim=(-0.02, height + 0.02))
    axes.set_axis_off()
    for link in graph.links:
        _draw_link(axes, graph, places, link)
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
    entries: list[Artist] = [
        _line("positive weight", color=POSITIVE, linewidth=2.0),
        _line("negative weight", color=NEGATIVE, linewidth=2.0),
        _line(f"thicker: further from 0, up to {thickest}", linewidth=2.8),
        _line("faint: on no path from a sensor to an actuator", alpha=0.3, marker="o"),
        _shape("sensor", "o", "white"),
        *([_shape("reads another module", "s", "#999999")] if delays else []),
        _shape("hidden node", "o", "#999999"),
        _shape("output", "o", GREY),
    ]
    if not all(graph.feed_forward for graph in graphs):
        entries.append(_shape("loop or arc: to itself, sideways or back", "o", "none", size=9.0))
    if False in delays:
        entries.append(_line("link, coloured as the module it leaves"))
    if True in delays:
        entries.append(_line("link, coloured likewise, one step late", linestyle="--"))
    return entries


def _line(label: str, **look: Any) -> Line2D:
    return Line2D([], [], label=label, **{"color": GREY, **look})


def _shape(label: str, marker: str, face: str, size: float = 6.0) -> Line2D:
    return _line(label, linestyle="", marker=marker, markersize=size, markerfacecolor=face, markeredgecolor=GREY)


def _colour(m: int) -> str:
    return MODULE_COLOURS[m % len(MODULE_COLOURS)]


def _draw_box(axes: Axes, graph: ChampionGraph, m: int, box: Bbox) -> None:
    module = graph.plan.modules[m]
    look = {"facecolor": to_rgba(_colour(m), 0.07), "edgecolor": to_rgba(_colour(m), 0.8), "linewidth": 1.0}
    corner, width, height = (box.x0 + 0.05, box.y0 + 0.05), box.width - 0.1, box.height - 0.1
    axes.add_patch(FancyBboxPatch(corner, width, height, boxstyle="round,pad=0.05", zorder=0, **look))
    sharers = sum(other.subpopulation == module.subpopulation for other in graph.plan.modules)
    shared = f"  (genome {module.subpopulation + 1}, shared by {sharers})" if sharers > 1 else ""
    name = module.name.replace("_", " ") + shared
    axes.text(box.x0 + 0.1, box.y1 - 0.14, name, fontsize=8.5, va="center", weight="bold", zorder=5)


def _curve(start: Sequence[float], control: Sequence[float], end: Sequence[float], **look: Any) -> PathPatch:
    codes = [Outline.MOVETO, Outline.CURVE3, Outline.CURVE3]
    return PathPatch(Outline([tuple(start), tuple(control), tuple(end)], codes), fill=False, **look)


def _draw_link(axes: Axes, graph: ChampionGraph, places: Sequence[Places], link: Link) -> None:
    start, end = (np.array(places[m][key]) for m, key in (link.source, link.target))
    aside = np.array([end[1] - start[1], start[0] - end[0]])
    many = len(graph.links) > _MANY_LINKS
    is_used = {link.source, link.target} <= graph.used
    look = {
        "edgecolor": _colour(link.source[0]),
        "alpha": (0.45 if many else 0.8) if is_used else FAINT,
        "linewidth": 0.6 if many else 0.9,
        "linestyle": (0.0, (4.0, 2.5)) if link.delayed else "-",
    }
    axes.add_patch(_curve(start, (start + end) / 2 + _BOW * aside, end, zorder=1, **look))


def _thick_from(graph: ChampionGraph) -> float:
    """Weights from here on are drawn alike: beside a single outlier all others would vanish."""
    return float(np.quantile([abs(edge.weight) for own in graph.edges for edge in own] or [0.0], _ALIKE))


def _draw_edges(axes: Axes, graph: ChampionGraph, m: int, places: Places) -> None:
    """Draw light ones first, so that the heavy ones stay visible among hundreds."""
    limit = _thick_from(graph) or 1.0
    many = sum(len(own) for own in graph.edges) > _MANY_EDGES
    thickest, contrast = (2.2, 1.5) if many else (2.8, 1.0)
    lines, widths, colours = [], [], []
    for source, target, weight in sorted(graph.edges[m], key=lambda edge: abs(edge.weight)):
        share = min(1.0, abs(weight) / limit)
        is_used = {(m, source), (m, target)} <= graph.used
        opacity = 0.16 + 0.74 * share**contrast if is_used else FAINT
        colour = to_rgba(POSITIVE if weight >= 0 else NEGATIVE, opacity)
        width = 0.3 + thickest * share
        if places[target][1] > places[source][1]:
            lines.append([places[source], places[target]])
            widths.append(width)
            colours.append(colour)
        else:
            axes.add_patch(_returning(places[source], places[target], edgecolor=colour, linewidth=width, zorder=2))
    axes.add_collection(LineCollection(lines, linewidths=widths, colors=colours, capstyle="round", zorder=2))


def _returning(start: tuple[float, float], end: tuple[float, float], **look: Any) -> Patch:
    """A loop for a connection to itself, an arc for one that runs sideways or back."""
    if start == end:
        return Ellipse((start[0] + 0.09, start[1]), 0.18, 0.13, fill=False, **look)
    along = np.subtract(end, start)
    length = float(np.hypot(*along))
    aside = np.array([along[1], -along[0]]) / length
    return _curve(start, start + along / 2 - aside * max(0.12, 0.25 * length), end, **look)


def _draw_nodes(axes: Axes, graph: ChampionGraph, m: int, places: Places) -> None:
    inputs = graph.inputs[m]
    small = 10.0 if len(inputs) > 30 else 22.0
    groups = (
        ([-1 - k for k, source in enumerate(inputs) if source[0] == SENSORS], "o", "white", small),
        ([-1 - k for k, source in enumerate(inputs) if source[0] != SENSORS], "s", "#999999", small),
        (list(graph.hidden[m]), "o", "#999999", 34.0),
        (list(range(graph.plan.modules[m].outputs)), "o", GREY, 34.0),
    )
    for keys, marker, face, size in groups:
        if keys:
            opacity = [1.0 if (m, key) in graph.used else 2 * FAINT for key in keys]
            look = {"c": [to_rgba(face, alpha) for alpha in opacity], "edgecolors": [to_rgba(GREY, a) for a in opacity]}
            x, y = zip(*(places[key] for key in keys), strict=True)
            axes.scatter(x, y, s=size, marker=marker, linewidths=0.7, zorder=3, **look)


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
        axes.plot([left - 0.03, right + 0.03], [y - 0.28, y - 0.28], color=GREY, linewidth=0.7)
        # In two lines, as groups of links are narrow.
        sources = {inputs[k][0] for k in group}
        whose = graph.plan.modules[sources.pop()].name.replace("_", " ") if len(sources) == 1 else "others"
        words = "sensors, by index" if kind == "sensors" else f"{kind} of\n{whose}"
        axes.text((left + right) / 2, y - 0.31, words, fontsize=6.0, ha="center", va="top")
