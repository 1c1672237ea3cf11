"""Values of curves, which a page shows where the pointer rests on their picture."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

MOST_STRIPS = 40
"""Strips per panel with values of their own; narrower ones would be hard to hit with a pointer."""


class Strip(NamedTuple):
    """An upright strip of a picture, in percent of its width and height from the upper left, and the values there."""

    left: float
    top: float
    width: float
    height: float
    text: str


def value_strips(figure: Figure, mark: str) -> tuple[Strip, ...]:
    """Cut each panel of a drawn figure at the points of its curves, the lines whose label begins with `mark`.

    Between its points a curve has the value that its line shows there.
    """
    found: list[Strip] = []
    for axes in figure.axes:
        lines = {str(line.get_label()): np.asarray(line.get_xydata(), dtype=np.float64) for line in axes.get_lines()}
        curves = {name.removeprefix(mark): xy for name, xy in lines.items() if name.startswith(mark) and len(xy)}
        if curves:
            found += _strips(figure, axes, curves)
    return tuple(found)


def _strips(figure: Figure, axes: Axes, curves: Mapping[str, NDArray[np.float64]]) -> Iterator[Strip]:
    places = np.unique(np.concatenate([xy[:, 0] for xy in curves.values()]))
    places = places[np.unique(np.linspace(0, len(places) - 1, MOST_STRIPS).round().astype(int))]
    pixels = axes.transData.transform([(place, axes.get_ylim()[0]) for place in places])
    across = figure.transFigure.inverted().transform(pixels)[:, 0]
    box = axes.get_position()
    edges = 100 * np.array([box.x0, *(across[1:] + across[:-1]) / 2, box.x1])
    for place, left, right in zip(places, edges[:-1], edges[1:], strict=True):
        values = {
            name: float(np.interp(place, xy[:, 0], xy[:, 1], left=np.nan, right=np.nan)) for name, xy in curves.items()
        }
        shown = [f"{name}: {value:.4g}" for name, value in values.items() if not np.isnan(value)]
        text = "\n".join([f"{axes.get_xlabel()} {place:,.6g}", *shown])
        yield Strip(left, 100 * (1 - box.y1), right - left, 100 * box.height, text)
