"""How each variant looks in every figure: colours that colour-blind readers can tell apart, shapes for grey print."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

LineStyle = str | tuple[float, tuple[float, ...]]
"""As matplotlib takes it: a name, or an offset and the lengths of dashes and gaps in points."""


@dataclass(frozen=True)
class VariantStyle:
    """How one variant is drawn.

    Attributes:
        colour: hexadecimal.
        marker: matplotlib's letter for it; empty for baselines, which have no points.
        line: of the variant's mean.
    """

    colour: str
    marker: str
    line: LineStyle = "-"

    @property
    def mean(self) -> dict[str, Any]:
        """Matplotlib's keywords for the line of the variant's mean."""
        rim = {"markersize": 6.0, "markeredgecolor": "white", "markeredgewidth": 0.6}
        return {"color": self.colour, "linestyle": self.line, "marker": self.marker, "zorder": 3, **rim}


BLACK, ORANGE, SKY, GREEN = "#000000", "#e69f00", "#56b4e9", "#009e73"
BLUE, VERMILION, PURPLE, OLIVE = "#0072b2", "#d55e00", "#cc79a7", "#8f8700"
"""Okabe and Ito, "Color universal design" (2008); their yellow is darkened, or lines of it vanish on white."""

_TRAINED = {
    "neat": VariantStyle(VERMILION, "s"),
    "exneat": VariantStyle(BLUE, "o"),
    "single_unlinked": VariantStyle(SKY, "v"),
    "single_linked": VariantStyle(BLUE, "^"),
    "all_unlinked": VariantStyle(ORANGE, "D"),
    "all_linked": VariantStyle(GREEN, "o"),
    "fb": VariantStyle(PURPLE, "P"),
    "lr": VariantStyle(BLACK, "X"),
    "cross": VariantStyle(OLIVE, "*"),
}
_FALLBACKS = (
    VariantStyle(BLUE, "<"),
    VariantStyle(ORANGE, ">"),
    VariantStyle(GREEN, "p"),
    VariantStyle(PURPLE, "h"),
    VariantStyle(SKY, "d"),
    VariantStyle(BLACK, "8"),
    VariantStyle(OLIVE, "H"),
    VariantStyle(VERMILION, "X"),
)
_DASH_DOT_DOT: LineStyle = (0.0, (4.0, 1.5, 1.0, 1.5, 1.0, 1.5))
_BASELINES = {
    "random": VariantStyle("#8a8a8a", "", ":"),
    "linear_fusion": VariantStyle("#4d4d4d", "", "-."),
    "motionless": VariantStyle("#6b6b6b", "", _DASH_DOT_DOT),
}
_BASELINE_FALLBACKS = tuple(VariantStyle("#7a7a7a", "", line) for line in (":", "-.", _DASH_DOT_DOT))


def variant_styles(variants: Iterable[str], baselines: Iterable[str] = ()) -> dict[str, VariantStyle]:
    """The look of each variant.

    Variants of the thesis have a look of their own. Others take, in their order, the first colour that no
    variant of the same experiment has yet, and start over when all are taken.

    Args:
        variants: names, baselines included, in the order of the experiment.
        baselines: names of those that nothing trains; they are grey lines.
    """
    names, untrained = list(variants), set(baselines)
    trained = [name for name in names if name not in untrained]
    return {
        **_chosen(trained, _TRAINED, _FALLBACKS),
        **_chosen([name for name in names if name in untrained], _BASELINES, _BASELINE_FALLBACKS),
    }


def _chosen(
    names: list[str], known: dict[str, VariantStyle], fallbacks: tuple[VariantStyle, ...]
) -> dict[str, VariantStyle]:
    styles = {name: known[name] for name in names if name in known}
    taken = {(style.colour, style.line) for style in styles.values()}
    free = [style for style in fallbacks if (style.colour, style.line) not in taken] or list(fallbacks)
    strangers = [name for name in names if name not in known]
    return styles | {name: free[k % len(free)] for k, name in enumerate(strangers)}
