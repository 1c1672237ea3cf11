"""Frames of a film: agents side by side, with captions, each next to its networks with the values of their nodes."""

from __future__ import annotations

import functools
import io
import math
from collections.abc import Sequence
from typing import NamedTuple

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from exneat_cli.analysis import styles
from exneat_cli.analysis.champion_graph import Node
from exneat_cli.analysis.network_graph import draw_champion
from exneat_cli.records.champion import Champion

Pixels = NDArray[np.uint8]
DPI, NATURAL = 100, 640
"""Pixels to an inch of networks, and the width in pixels below which they are drawn smaller as a whole."""
SIZE, BAR = 15, 23
"""Pixels of the letters of titles and captions, smaller for long ones, and of the bars around pictures for them."""
LEGEND_WIDTH = 430
"""Pixels that the legend needs."""
_LEGEND = "nodes: blue above 0, red below; full colour: the node's largest value so far"


class Panel:
    """A champion's networks where they sit on the body, whose nodes light up.

    Args:
        champion: whose networks.
        nodes: inputs (-1 - k) and nodes whose values are shown.
        width, height: pixels.
    """

    def __init__(self, champion: Champion, nodes: Sequence[Node], width: int, height: int) -> None:
        scale = min(1.0, width / NATURAL)
        dpi = DPI * scale
        inches = width / dpi, (height - BAR) / dpi
        with styles.SCREEN.style():
            figure = Figure(figsize=(width / dpi, height / dpi), dpi=dpi, facecolor="white")
            canvas = FigureCanvasAgg(figure)
            axes = figure.add_axes((0.0, 0.0, 1.0, 1.0 - BAR / height))
            places = draw_champion(axes, champion, *inches, with_nodes=False)
            letters = 7.5 / scale * min(1.0, width / LEGEND_WIDTH)  # as large in small pictures, where it fits
            figure.text(0.01, 1.0 - 0.5 * BAR / height, _LEGEND, fontsize=letters, va="center")
            canvas.draw()  # type: ignore[no-untyped-call]
            drawn = np.asarray(canvas.buffer_rgba())  # type: ignore[no-untyped-call]
        self._still = Image.fromarray(drawn[..., :3].copy())
        spots = axes.transData.transform([places[node] for node in nodes])
        self._spots = [(float(x), height - float(y)) for x, y in spots]
        crowded = max(len(module.pins) for module in champion.plan.modules) > 30
        self._radii = [scale * ((2.5 if crowded else 4.0) if key < 0 else 6.0) for _, key in nodes]

    def draw(self, shares: NDArray[np.float64]) -> Pixels:
        """(height, width, 3) for (nodes,) values between -1 and 1."""
        picture = self._still.copy()
        brush = ImageDraw.Draw(picture)
        low, high = (np.array(to_rgb(colour)) for colour in (styles.VERMILION, styles.BLUE))
        for (x, y), radius, share in zip(self._spots, self._radii, np.clip(shares, -1.0, 1.0), strict=True):
            colour = 1.0 + abs(share) * ((high if share > 0.0 else low) - 1.0)
            red, green, blue = (round(255 * each) for each in colour)
            brush.ellipse((x - radius, y - radius, x + radius, y + radius), (red, green, blue), styles.GREY)
        return np.asarray(picture)


class Still(NamedTuple):
    """One agent's part of a frame: its picture, the texts above and below it, and its networks, if any.

    The networks are 2 `BAR` taller than the picture.
    """

    picture: Pixels
    title: str
    caption: str
    panel: Pixels | None


def frame(stills: Sequence[Still]) -> Pixels:
    """Agents in rows and columns; width and height are even numbers of pixels, as codecs require."""
    tiles = []
    for still in stills:
        picture = _captioned(still.picture, still.title, still.caption)
        tiles.append(picture if still.panel is None else np.concatenate([picture, still.panel], axis=1))
    columns = math.ceil(math.sqrt(len(tiles)))
    nothing = np.full_like(tiles[0], 255)
    tiles += [nothing] * (-len(tiles) % columns)
    whole = np.concatenate([np.concatenate(tiles[k : k + columns], axis=1) for k in range(0, len(tiles), columns)])
    return np.ascontiguousarray(whole[: whole.shape[0] // 2 * 2, : whole.shape[1] // 2 * 2])


def fitted(picture: Pixels, width: int, height: int) -> Pixels:
    """(height, width, 3) the picture, as large as fits, in the middle of grey."""
    if picture.shape[:2] == (height, width):
        return picture
    scale = min(width / picture.shape[1], height / picture.shape[0])
    size = max(1, round(scale * picture.shape[1])), max(1, round(scale * picture.shape[0]))
    whole = Image.new("RGB", (width, height), (235, 235, 235))
    whole.paste(Image.fromarray(picture).resize(size), ((width - size[0]) // 2, (height - size[1]) // 2))
    return np.asarray(whole)


def as_jpeg(picture: Pixels) -> bytes:
    """A picture as the bytes of a JPEG file."""
    file = io.BytesIO()
    Image.fromarray(picture).save(file, "JPEG", quality=85)
    return file.getvalue()


def _captioned(picture: Pixels, title: str, caption: str) -> Pixels:
    bars = []
    for text in (title, caption):
        bar = Image.new("RGB", (picture.shape[1], BAR), (255, 255, 255))
        brush = ImageDraw.Draw(bar)
        sizes = (_font(size) for size in range(SIZE, 5, -1))
        font = next((each for each in sizes if brush.textlength(text, font=each) <= bar.width - 12), _font(6))
        brush.text((6, BAR // 2), text, fill=(20, 20, 20), font=font, anchor="lm")
        bars.append(np.asarray(bar))
    return np.concatenate([bars[0], picture, bars[1]])


@functools.cache
def _font(size: int) -> ImageFont.FreeTypeFont:
    return ImageFont.truetype(f"{matplotlib.get_data_path()}/fonts/ttf/DejaVuSans.ttf", size)
