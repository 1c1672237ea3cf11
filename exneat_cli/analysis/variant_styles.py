"""How each variant looks in every figure: colours that colour-blind readers can tell apart, shapes for grey print."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

Look = dict[str, Any]
"""Matplotlib's keywords for the line of a variant's mean: ``color``, ``marker``, ``linestyle`` and others."""

BLACK, ORANGE, SKY, GREEN = "#000000", "#e69f00", "#56b4e9", "#009e73"
BLUE, VERMILION, PURPLE, OLIVE = "#0072b2", "#d55e00", "#cc79a7", "#8f8700"
"""Okabe and Ito, "Color universal design" (2008); their yellow is darkened, or lines of it vanish on white."""

_DASH_DOT_DOT = (0.0, (4.0, 1.5, 1.0, 1.5, 1.0, 1.5))


def _look(colour: str, marker: str, line: str | tuple[float, tuple[float, ...]] = "-") -> Look:
    rim = {"markersize": 6.0, "markeredgecolor": "white", "markeredgewidth": 0.6}
    return {"color": colour, "marker": marker, "linestyle": line, "zorder": 3, **rim}


_TRAINED = {
    "neat": _look(VERMILION, "s"),
    "exneat": _look(BLUE, "o"),
    "single_unlinked": _look(SKY, "v"),
    "single_linked": _look(BLUE, "^"),
    "all_unlinked": _look(ORANGE, "D"),
    "all_linked": _look(GREEN, "o"),
    "fb": _look(PURPLE, "P"),
    "lr": _look(BLACK, "X"),
    "cross": _look(OLIVE, "*"),
}
_FALLBACKS = [
    _look(*pair) for pair in zip((BLUE, ORANGE, GREEN, PURPLE, SKY, BLACK, OLIVE, VERMILION), "<>phd8HX", strict=True)
]
_BASELINES = {
    "random": _look("#8a8a8a", "", ":"),
    "linear_fusion": _look("#4d4d4d", "", "-."),
    "motionless": _look("#6b6b6b", "", _DASH_DOT_DOT),
}
_BASELINE_FALLBACKS = [_look("#7a7a7a", "", line) for line in (":", "-.", _DASH_DOT_DOT)]


def variant_styles(variants: Iterable[str], baselines: Iterable[str] = ()) -> dict[str, Look]:
    """Choose the look of each variant.

    Variants of the thesis have a look of their own. Others take, in their order, the first colour that no
    variant of the same experiment has yet, and start over when all are taken.

    Args:
        variants: names, baselines included, in the order of the experiment.
        baselines: names of those that nothing trains; they are grey lines without markers.
    """
    names, untrained = list(variants), set(baselines)
    trained = _chosen([name for name in names if name not in untrained], _TRAINED, _FALLBACKS)
    return trained | _chosen([name for name in names if name in untrained], _BASELINES, _BASELINE_FALLBACKS)


def _chosen(names: Sequence[str], known: Mapping[str, Look], fallbacks: Sequence[Look]) -> dict[str, Look]:
    looks = {name: known[name] for name in names if name in known}
    taken = [(look["color"], look["linestyle"]) for look in looks.values()]
    free = [look for look in fallbacks if (look["color"], look["linestyle"]) not in taken] or fallbacks
    strangers = [name for name in names if name not in known]
    return looks | {name: free[k % len(free)] for k, name in enumerate(strangers)}
