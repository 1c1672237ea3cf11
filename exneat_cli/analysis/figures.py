"""How every figure looks, and how it is saved so that equal data gives equal bytes."""

from __future__ import annotations

import io
from collections.abc import Iterable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import matplotlib.style
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from exneat_cli.records import make_directory, write_whole

GREY = "#444444"
"""Of what belongs to no variant or module."""
_STYLE: dict[Any, Any] = {
    "svg.hashsalt": "exneat",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.alpha": 0.25,
    "legend.frameon": False,
    "font.size": 10,
}
_METADATA: dict[str, dict[str, Any]] = {"png": {"Software": None}, "svg": {"Date": None, "Creator": None}}


def style() -> AbstractContextManager[None]:
    """Context in which figures are made and saved; a matplotlibrc of the user's own does not count there."""
    return matplotlib.style.context(_STYLE, after_reset=True)


def new_figure(width: float = 7.0, height: float = 4.2) -> Figure:
    """An empty figure of the given size in inches; to be called in `style`."""
    return Figure(figsize=(width, height), layout="constrained")


def tick_levels(axes: Axes, levels: Iterable[float]) -> None:
    """Keep the ticks of a horizontal axis whole where all levels are, such as numbers of tiles."""
    if all(float(level).is_integer() for level in levels):
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))


def save_figure(figure: Figure, path: Path) -> list[Path]:
    """Write ``path.png`` and ``path.svg``, also where the name has dots of its own; returns both paths.

    Raises:
        ExneatError: they cannot be written.
    """
    make_directory(path.parent)
    written = []
    for kind, metadata in _METADATA.items():
        buffer = io.BytesIO()
        with style():
            figure.savefig(buffer, format=kind, metadata=metadata, dpi=150)
        target = path.with_name(f"{path.name}.{kind}")
        write_whole(target, buffer.getvalue())
        written.append(target)
    return written
