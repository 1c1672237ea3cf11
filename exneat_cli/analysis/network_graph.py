"""A champion's networks as a picture: modules where they sit on the body, layered from inputs to outputs."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgba
from matplotlib.lines import Line2D
from matplotlib.patches import Ellipse, FancyBboxPatch, PathPatch
from matplotlib.path import Path as Outline

from exneat_cli.analysis.figures import new_figure, save_figure, style
from exneat_cli.analysis.network_data import ChampionGraph, Edge, Link, Node, read_champion_graph
from exneat_cli.analysis.network_layout import Layout, lay_out, natural_size, pin_groups
from exneat_cli.analysis.variant_styles import BLACK, BLUE, GREEN, OLIVE, ORANGE, PURPLE, SKY, VERMILION
from exneat_cli.records import RunDirectory
from exneat_cli.wiring import Module

POSITIVE, NEGATIVE = BLUE, VERMILION
MODULE_COLOURS = (GREEN, ORANGE, PURPLE, SKY, OLIVE, BLACK)
"""Of the boxes, and of the links that leave them; none is a colour of weights."""
FAINT = 0.13
"""Opacity of what has no part in what the agent does."""
_GREY = "#444444"
_LEGEND_HEIGHT = 1.0
_POINTS = 72.0
_LEAST_ROOM = 6.2
"""Points from one input to the next that a rotated index needs."""
_ROOM_TO_STAND = 16.0
"""The same for an upright one."""
_BOW = 0.15
"""How far links swing aside, as a share of their length; there and back swing to different sides."""
_ALIKE = 0.98
"""Share of the weights whose widths differ; see `_thick_from`."""
_MANY_LINKS = 40
_MANY_EDGES = 200


def draw_network(run: RunDirectory) -> list[Path]:
    """The champion's networks, as PNG and SVG among the run's own plots.

    Raises:
        ExneatError: the run has no champion, or its file is damaged.
    """
    graph = read_champion_graph(run)
    width, height = natural_size(graph)
    with style():
        figure = new_figure(width, height + _LEGEND_HEIGHT)
        draw_champion(figure.add_subplot(), graph, width, height)
        figure.suptitle(f"{run.path.name}: champion, test fitness {graph.test_fitness:.4g}", fontsize=11)
        handles = legend_entries([graph])
        figure.legend(handles=handles, loc="outside lower center", ncols=max(2, int(width // 2.6)), fontsize=8)
    return save_figure(figure, run.plots / "network")


def draw_champion(axes: Axes, graph: ChampionGraph, width: float, height: float) -> None:
    """Draw a champion on empty axes.

    Args:
        axes: lose their frame and ticks.
        graph: the champion.
        width: of the axes in inches, at least roughly; text is made to fit it.
        height: the same.
    """
    layout = lay_out(graph, width, height)
    axes.set(xlim=(-0.02, width + 0.02), ylim=(-0.02, height + 0.02))
    axes.set_axis_off()
    for m in range(len(graph.plan.modules)):
        _draw_box(axes, graph, layout, m)
    for link in graph.links:
        _draw_link(axes, graph, layout, link)
    _draw_edges(axes, graph, layout)
    for m in range(len(graph.plan.modules)):
        _draw_nodes(axes, graph, layout, m)
        _name_pins(axes, graph, layout, m)
        _name_outputs(axes, graph, layout, m)


def legend_entries(graphs: list[ChampionGraph]) -> list[Artist]:
    """What lines and shapes mean, as far as they occur in one of `graphs`."""
    thickest = " and ".join(f"{_thick_from(graph):.2g}" for graph in graphs)
    links = [link for graph in graphs for link in graph.links]
    entries: list[Artist] = [
        Line2D([], [], color=POSITIVE, linewidth=2.0, label="positive weight"),
        Line2D([], [], color=NEGATIVE, linewidth=2.0, label="negative weight"),
        Line2D([], [], color=_GREY, linewidth=2.8, label=f"thicker: further from 0, up to {thickest}"),
        Line2D([], [], color=_GREY, alpha=0.3, marker="o", label="faint: on no path from a sensor to an actuator"),
        _shape("o", "white", "sensor"),
        *([_shape("s", "#999999", "reads another module")] if links else []),
        _shape("o", "#999999", "hidden node"),
        _shape("o", _GREY, "output"),
    ]
    if not all(graph.feed_forward for graph in graphs):
        entries.append(_shape("o", "none", "loop or arc: to itself, sideways or back", size=9.0))
    if any(not link.delayed for link in links):
        entries.append(Line2D([], [], color=_GREY, label="link, coloured as the module it leaves"))
    if any(link.delayed for link in links):
        entries.append(Line2D([], [], color=_GREY, linestyle="--", label="link, coloured likewise, one step late"))
    return entries


def _shape(marker: str, face: str, label: str, size: float = 6.0) -> Line2D:
    look = {"marker": marker, "markersize": size, "markerfacecolor": face, "markeredgecolor": _GREY}
    return Line2D([], [], linestyle="", label=label, **look)  # type: ignore[arg-type]


def _colour(m: int) -> str:
    return MODULE_COLOURS[m % len(MODULE_COLOURS)]


def _draw_box(axes: Axes, graph: ChampionGraph, layout: Layout, m: int) -> None:
    box, module = layout.boxes[m], graph.plan.modules[m]
    colour = _colour(m)
    shape = FancyBboxPatch(
        (box.x + 0.05, box.y + 0.05),
        box.width - 0.1,
        box.height - 0.1,
        boxstyle="round,pad=0.05",
        facecolor=to_rgba(colour, 0.07),
        edgecolor=to_rgba(colour, 0.8),
        linewidth=1.0,
        zorder=0,
    )
    axes.add_patch(shape)
    sharers = [other.name for other in graph.plan.modules if other.subpopulation == module.subpopulation]
    shared = f"  (genome {module.subpopulation + 1}, shared by {len(sharers)})" if len(sharers) > 1 else ""
    name = module.name.replace("_", " ") + shared
    axes.text(box.x + 0.1, box.y + box.height - 0.14, name, fontsize=8.5, va="center", weight="bold", zorder=5)


def _draw_link(axes: Axes, graph: ChampionGraph, layout: Layout, link: Link) -> None:
    (x0, y0), (x1, y1) = layout.places[link.source], layout.places[link.target]
    control = (x0 + x1) / 2 + _BOW * (y1 - y0), (y0 + y1) / 2 - _BOW * (x1 - x0)
    outline = Outline([(x0, y0), control, (x1, y1)], [Outline.MOVETO, Outline.CURVE3, Outline.CURVE3])
    many = len(graph.links) > _MANY_LINKS
    is_used = link.source in graph.used and link.target in graph.used
    axes.add_patch(
        PathPatch(
            outline,
            fill=False,
            edgecolor=_colour(link.source[0]),
            alpha=(0.45 if many else 0.8) if is_used else FAINT,
            linewidth=0.6 if many else 0.9,
            linestyle=(0.0, (4.0, 2.5)) if link.delayed else "-",
            zorder=1,
        )
    )


def _thick_from(graph: ChampionGraph) -> float:
    """Weights from here on are drawn alike: beside a single outlier all others would vanish."""
    return float(np.quantile([abs(edge.weight) for edge in graph.edges] or [0.0], _ALIKE))


def _draw_edges(axes: Axes, graph: ChampionGraph, layout: Layout) -> None:
    """Light ones first, so that the heavy ones stay visible among hundreds."""
    limit = _thick_from(graph) or 1.0
    many = len(graph.edges) > _MANY_EDGES
    thickest, contrast = (2.2, 1.5) if many else (2.8, 1.0)
    straight, widths, colours = [], [], []
    for edge in sorted(graph.edges, key=lambda edge: abs(edge.weight)):
        share = min(1.0, abs(edge.weight) / limit)
        is_used = edge.source in graph.used and edge.target in graph.used
        colour = to_rgba(
            POSITIVE if edge.weight >= 0 else NEGATIVE, 0.16 + 0.74 * share**contrast if is_used else FAINT
        )
        width = 0.3 + thickest * share
        if edge.source != edge.target and layout.places[edge.target][1] > layout.places[edge.source][1]:
            straight.append([layout.places[edge.source], layout.places[edge.target]])
            widths.append(width)
            colours.append(colour)
        else:
            axes.add_patch(_returning(edge, layout, colour, width))
    axes.add_collection(LineCollection(straight, linewidths=widths, colors=colours, capstyle="round", zorder=2))


def _returning(edge: Edge, layout: Layout, colour: tuple[float, ...], width: float) -> Ellipse | PathPatch:
    """A loop for a connection to itself, an arc for one that runs sideways or back."""
    (x0, y0), (x1, y1) = layout.places[edge.source], layout.places[edge.target]
    look: dict[str, Any] = {"edgecolor": colour, "linewidth": width, "zorder": 2, "fill": False}
    if edge.source == edge.target:
        return Ellipse((x0 + 0.09, y0), 0.18, 0.13, **look)
    along = np.array([x1 - x0, y1 - y0])
    aside = np.array([along[1], -along[0]]) / np.hypot(*along)
    control = np.array([x0, y0]) + along / 2 - aside * max(0.12, 0.25 * float(np.hypot(*along)))
    return PathPatch(
        Outline([(x0, y0), tuple(control), (x1, y1)], [Outline.MOVETO, Outline.CURVE3, Outline.CURVE3]), **look
    )


def _draw_nodes(axes: Axes, graph: ChampionGraph, layout: Layout, m: int) -> None:
    module = graph.plan.modules[m]
    pins = [(m, -1 - k) for k in range(len(module.pins))]
    sensing = [node for node, pin in zip(pins, module.pins, strict=True) if pin.is_sensor]
    reading = [node for node, pin in zip(pins, module.pins, strict=True) if not pin.is_sensor]
    small = 10.0 if len(pins) > 30 else 22.0
    _scatter(axes, graph, layout, sensing, "o", "white", small)
    _scatter(axes, graph, layout, reading, "s", "#999999", small)
    _scatter(axes, graph, layout, [(m, node) for node in graph.hidden[m]], "o", "#999999", 34.0)
    _scatter(axes, graph, layout, [(m, node) for node in range(module.outputs)], "o", _GREY, 34.0)


def _scatter(
    axes: Axes, graph: ChampionGraph, layout: Layout, nodes: list[Node], marker: str, face: str, size: float
) -> None:
    if not nodes:
        return
    places = np.array([layout.places[node] for node in nodes])
    opacity = [1.0 if node in graph.used else 2 * FAINT for node in nodes]
    faces = [to_rgba(face, alpha) for alpha in opacity]
    rims = [to_rgba(_GREY, alpha) for alpha in opacity]
    axes.scatter(places[:, 0], places[:, 1], s=size, marker=marker, c=faces, edgecolors=rims, linewidths=0.7, zorder=3)


def _name_pins(axes: Axes, graph: ChampionGraph, layout: Layout, m: int) -> None:
    """Indices under the sensors where they fit, and a bracket with words under each group of inputs."""
    module = graph.plan.modules[m]
    places = [layout.places[m, -1 - k] for k in range(len(module.pins))]
    room = _POINTS * min((b[0] - a[0] for a, b in pairwise(places)), default=1.0)
    turn = 90 if room < _ROOM_TO_STAND else 0
    for group in pin_groups(graph.plan, module):
        if module.pins[group[0]].is_sensor and room >= _LEAST_ROOM:
            for k in group:
                x, y = places[k]
                axes.text(x, y - 0.06, str(module.pins[k].index), fontsize=5.5, rotation=turn, ha="center", va="top")
        left, right, y = places[group[0]][0], places[group[-1]][0], places[group[0]][1] - 0.28
        axes.plot([left - 0.03, right + 0.03], [y, y], color=_GREY, linewidth=0.7)
        axes.text((left + right) / 2, y - 0.03, _words(graph, module, group), fontsize=6.0, ha="center", va="top")


def _words(graph: ChampionGraph, module: Module, group: list[int]) -> str:
    """What a group of inputs reads, in two lines, as groups of links are narrow."""
    pins = [module.pins[k] for k in group]
    if pins[0].is_sensor:
        return "sensors, by index"
    sources = {pin.module for pin in pins}
    whose = graph.plan.modules[sources.pop()].name.replace("_", " ") if len(sources) == 1 else "others"
    return f"{'outputs' if graph.plan.kind_of(pins[0]) == 'output' else 'hidden'} of\n{whose}"


def _name_outputs(axes: Axes, graph: ChampionGraph, layout: Layout, m: int) -> None:
    for output, actuator in enumerate(graph.plan.modules[m].drives):
        x, y = layout.places[m, output]
        axes.text(
            x, y + 0.08, graph.actuators[actuator].replace("_", " "), fontsize=7, ha="center", va="bottom", zorder=5
        )
