"""How figures look, and how they are saved so that equal data gives equal bytes.

Variants have colours that colour-blind readers can tell apart, and shapes and dashes for grey print.
"""

from __future__ import annotations

import io
import itertools
from collections.abc import Collection, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import matplotlib.style
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from exneat_cli.errors import ExneatError, nearest
from exneat_cli.records import RunDirectory, make_directory, write_whole

Look = dict[str, Any]
"""Matplotlib's keywords for the line of a variant's mean: ``color``, ``marker``, ``linestyle`` and others."""

# Okabe and Ito, "Color universal design" (2008); their yellow is darkened, since lines in it vanish on white,
# and so much that readers who see no red or no green do not take it for vermilion.
BLACK, ORANGE, SKY, GREEN = "#000000", "#e69f00", "#56b4e9", "#009e73"
BLUE, VERMILION, PURPLE, OLIVE = "#0072b2", "#d55e00", "#cc79a7", "#5c5800"
GREY = "#444444"  # for what belongs to no variant or module
AS_TRAINED: Look = {"color": GREY, "linestyle": ":", "linewidth": 1.2, "zorder": 1, "label": "as in training"}
"""The line at the level of a sweep at which runs were trained."""

_STYLE: dict[str, Any] = {
    "svg.hashsalt": "exneat",
    "svg.fonttype": "none",  # text stays text, which can be searched and edited
    "pdf.fonttype": 42,  # TrueType; publishers refuse the outlines that are the default
    "text.parse_math": False,  # users' labels are plain text, with any dollars and backslashes
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.titlesize": "medium",
    "figure.titlesize": "large",
    "grid.alpha": 0.25,
    "legend.frameon": False,
    "legend.fontsize": "small",
    "font.size": 10,
    "savefig.dpi": 150,
}
_PRINTED: dict[str, Any] = {"font.size": 8, "lines.linewidth": 1.0, "lines.markersize": 5.0, "savefig.dpi": 300}
_COLUMN_WIDTHS = {1: 3.5, 2: 7.16}
"""Width (inches) of figures of one and of two columns: IEEE, "Preparation of papers" (2014)."""
_NARROWEST_PANEL = 2.3  # inches, with axis labels of 8 points
_ASPECT, _HIGHEST_PANEL = 0.72, 3.0  # of panels on paper: height in widths, and in inches
_METADATA: dict[str, dict[str, Any]] = {
    "png": {"Software": None},
    "svg": {"Date": None, "Creator": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}
DASH_DOT_DOT = (0.0, (4.0, 1.5, 1.0, 1.5, 1.0, 1.5))


def _look(colour: str, marker: str, line: str | tuple[float, tuple[float, ...]] = "-") -> Look:
    rim = {"markeredgecolor": "white", "markeredgewidth": 0.6}
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
_MORE_TRAINED = [
    *(_look(colour, marker) for colour, marker in zip(_COLOURS, "<>phd8HX", strict=True)),
    *(_look(colour, marker, "--") for colour, marker in zip(_COLOURS, "vPX*s^do", strict=True)),
]
_BASELINES = {
    "random": _look("#8a8a8a", "", ":"),
    "linear_fusion": _look("#4d4d4d", "", "-."),
    "motionless": _look("#6b6b6b", "", DASH_DOT_DOT),
}
_MORE_BASELINES = [_look("#7a7a7a", "", line) for line in (":", "-.", DASH_DOT_DOT)]


def variant_styles(
    variants: Collection[str], baselines: Collection[str] = (), cycle: Iterable[Look] = ()
) -> dict[str, Look]:
    """Choose the look of each of an experiment's `variants`; `baselines` among them are grey lines without markers.

    Variants of the thesis have a look of their own. Others take, in their order, the first colour that no
    variant of the same experiment has yet, and start over when all are taken. Colours, markers and dashes of a `cycle`
    (matplotlib's ``axes.prop_cycle``) are given to the trained variants in order, and take precedence.
    """
    learning = [name for name in variants if name not in baselines]
    trained = _chosen(learning, _TRAINED, _MORE_TRAINED)
    for name, own in zip(learning, itertools.cycle(cycle), strict=False):
        trained[name] = trained[name] | {key: own[key] for key in ("color", "marker", "linestyle") if key in own}
    return trained | _chosen([name for name in variants if name in baselines], _BASELINES, _MORE_BASELINES)


def _chosen(names: Sequence[str], known: Mapping[str, Look], others: Sequence[Look]) -> dict[str, Look]:
    looks = {name: known[name] for name in names if name in known}
    taken = [(look["color"], look["linestyle"]) for look in looks.values()]
    free = [look for look in others if (look["color"], look["linestyle"]) not in taken] or others
    strangers = [name for name in names if name not in known]
    return looks | {name: free[k % len(free)] for k, name in enumerate(strangers)}


@dataclass(frozen=True)
class Paper:
    """What figures are made for: the screen, or one or two columns of a paper.

    Attributes:
        columns: 1 or 2; None is the screen, where figures are larger and have titles.
        sheet: matplotlib's settings that take precedence over ours.
    """

    columns: int | None = None
    sheet: Mapping[str, Any] = field(default_factory=dict)

    def style(self) -> AbstractContextManager[None]:
        """Context in which figures are made and saved; the user's matplotlibrc has no effect there."""
        printed = _PRINTED if self.columns else {}
        settings: Any = {**_STYLE, **printed, **self.sheet}
        return matplotlib.style.context(settings, after_reset=True)

    def grid(self, panels: int) -> tuple[int, int, float, float]:
        """Rows and columns of panels that fit on paper, and width and height (inches) of a figure of them."""
        width = _COLUMN_WIDTHS[self.columns or 2]
        beside = min(panels, int(width // _NARROWEST_PANEL))
        rows = -(-panels // beside)
        return rows, beside, width, rows * min(_HIGHEST_PANEL, _ASPECT * width / beside)


SCREEN = Paper()


def read_style_sheet(path: Path) -> dict[str, Any]:
    """Read a matplotlib style sheet (``.mplstyle``), a line ``key: value`` for each setting.

    Raises:
        ExneatError: it is not such a file, or has a key or value that matplotlib does not know.
    """
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
        keys = [key for line in lines if (key := line.partition("#")[0].partition(":")[0].strip())]
        for key in keys:
            if key not in matplotlib.rcParams:
                hint = nearest(key, matplotlib.rcParams)
                raise ExneatError(f"style={path}: {key}: matplotlib has no such setting\n  {hint}".rstrip())
        settings: Any = matplotlib.rc_params_from_file(path, fail_on_error=True, use_default_template=False)
        return dict(settings)
    except (OSError, UnicodeDecodeError) as error:
        why = error.strerror if isinstance(error, OSError) else "it is not UTF-8 text"
        raise ExneatError(f"style={path}: the style sheet cannot be read: {why}") from error
    except ValueError as error:
        why = str(error).splitlines()[0]
        raise ExneatError(f"style={path}: matplotlib does not accept a value: {why}") from error


def run_title(run: RunDirectory) -> str:
    """Say what a run is, e.g. ``hunting, exneat-all-none, seed 3``, without the hash in its name."""
    name, _, digest = run.path.name.rpartition("-")
    variant, _, seed = name.rpartition("-s")
    is_usual = bool(variant) and seed.isdigit() and len(digest) == 6
    return f"{run.path.parent.name}, {variant}, seed {seed}" if is_usual else run.path.name


def tick_levels(axes: Axes, levels: Iterable[float]) -> None:
    """Use only whole numbers as ticks of a horizontal axis if all levels are whole, such as numbers of tiles."""
    if all(float(level).is_integer() for level in levels):
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))


def save_figure(figure: Figure, path: Path, paper: Paper = SCREEN, kinds: Sequence[str] = ("png", "svg")) -> list[Path]:
    """Write ``path.<kind>`` for all `kinds`, even if the name contains dots; returns all paths.

    Raises:
        ExneatError: they cannot be drawn with the settings of the paper, or cannot be written.
    """
    make_directory(path.parent)
    written = []
    for kind in kinds:
        buffer = io.BytesIO()
        with paper.style():
            try:
                figure.savefig(buffer, format=kind, metadata=_METADATA[kind])
            except (RuntimeError, ValueError) as error:
                if not paper.sheet:
                    raise
                why = (str(error).strip() or type(error).__name__).splitlines()[0]
                raise ExneatError(f"{path}.{kind}: cannot be drawn with this style=: {why}") from error
        written.append(path.with_name(f"{path.name}.{kind}"))
        write_whole(written[-1], buffer.getvalue())
    return written
