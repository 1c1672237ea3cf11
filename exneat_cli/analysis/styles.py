"""How figures look, and how they are saved so that equal data gives equal bytes.

Variants have colours that colour-blind readers can tell apart, and shapes for grey print.
"""

from __future__ import annotations

import io
from collections.abc import Collection, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import matplotlib.style
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from exneat_cli.records import RunDirectory, make_directory, write_whole

Look = dict[str, Any]
"""Matplotlib's keywords for the line of a variant's mean: ``color``, ``marker``, ``linestyle`` and others."""

# Okabe and Ito, "Color universal design" (2008); their yellow is darkened, or lines of it vanish on white.
BLACK, ORANGE, SKY, GREEN = "#000000", "#e69f00", "#56b4e9", "#009e73"
BLUE, VERMILION, PURPLE, OLIVE = "#0072b2", "#d55e00", "#cc79a7", "#8f8700"
GREY = "#444444"  # of what belongs to no variant or module
AS_TRAINED: Look = {"color": GREY, "linestyle": ":", "linewidth": 1.2, "zorder": 1, "label": "as in training"}
"""The line at the level of a sweep at which runs were trained."""

_STYLE: dict[Any, Any] = {
    "svg.hashsalt": "exneat",
    "text.parse_math": False,  # labels of users are text, dollars and backslashes too
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.alpha": 0.25,
    "legend.frameon": False,
    "font.size": 10,
}
_METADATA: dict[str, dict[str, Any]] = {"png": {"Software": None}, "svg": {"Date": None, "Creator": None}}
_DASH_DOT_DOT = (0.0, (4.0, 1.5, 1.0, 1.5, 1.0, 1.5))


def _look(colour: str, marker: str, line: str | tuple[float, tuple[float, ...]] = "-") -> Look:
    rim = {"markersize": 6.0, "markeredgecolor": "white", "markeredgewidth": 0.6}
    return {"color": colour, "marker": marker, "linestyle": line, "zorder": 3, **rim}


_TRAINED = {
    "neat": _look(VERMILION, "s"),
    "exneat": _look(BLUE, "o"),
    "neat_unconnected": _look(ORANGE, "D", "--"),
    "exneat_unconnected": _look(SKY, "^", "--"),
    "single_unlinked": _look(SKY, "v"),
    "single_linked": _look(BLUE, "^"),
    "all_unlinked": _look(ORANGE, "D"),
    "all_linked": _look(GREEN, "o"),
    "fb": _look(PURPLE, "P"),
    "lr": _look(BLACK, "X"),
    "cross": _look(OLIVE, "*"),
}
_COLOURS = (BLUE, ORANGE, GREEN, PURPLE, SKY, BLACK, OLIVE, VERMILION)
_MORE_TRAINED = [_look(colour, marker) for colour, marker in zip(_COLOURS, "<>phd8HX", strict=True)]
_BASELINES = {
    "random": _look("#8a8a8a", "", ":"),
    "linear_fusion": _look("#4d4d4d", "", "-."),
    "motionless": _look("#6b6b6b", "", _DASH_DOT_DOT),
}
_MORE_BASELINES = [_look("#7a7a7a", "", line) for line in (":", "-.", _DASH_DOT_DOT)]


def variant_styles(variants: Collection[str], baselines: Collection[str] = ()) -> dict[str, Look]:
    """Choose the look of each of an experiment's `variants`; `baselines` among them are grey lines without markers.

    Variants of the thesis have a look of their own. Others take, in their order, the first colour that no
    variant of the same experiment has yet, and start over when all are taken.
    """
    trained = _chosen([name for name in variants if name not in baselines], _TRAINED, _MORE_TRAINED)
    return trained | _chosen([name for name in variants if name in baselines], _BASELINES, _MORE_BASELINES)


def _chosen(names: Sequence[str], known: Mapping[str, Look], others: Sequence[Look]) -> dict[str, Look]:
    looks = {name: known[name] for name in names if name in known}
    taken = [(look["color"], look["linestyle"]) for look in looks.values()]
    free = [look for look in others if (look["color"], look["linestyle"]) not in taken] or others
    strangers = [name for name in names if name not in known]
    return looks | {name: free[k % len(free)] for k, name in enumerate(strangers)}


def style() -> AbstractContextManager[None]:
    """Context in which figures are made and saved; a matplotlibrc of the user's own does not count there."""
    return matplotlib.style.context(_STYLE, after_reset=True)


def run_title(run: RunDirectory) -> str:
    """Say what a run is, e.g. ``hunting, exneat-all-none, seed 3``: the hash in its name tells nobody anything."""
    name, _, digest = run.path.name.rpartition("-")
    variant, _, seed = name.rpartition("-s")
    is_usual = bool(variant) and seed.isdigit() and len(digest) == 6
    return f"{run.path.parent.name}, {variant}, seed {seed}" if is_usual else run.path.name


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
        written.append(path.with_name(f"{path.name}.{kind}"))
        write_whole(written[-1], buffer.getvalue())
    return written
