"""How each arm looks, in every figure: colours that colour-blind readers can tell apart, and shapes for grey print."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

LineStyle = str | tuple[float, tuple[float, ...]]
"""As matplotlib takes it: a name, or an offset and the lengths of dashes and gaps in points."""


@dataclass(frozen=True)
class ArmStyle:
    """How one arm is drawn.

    Attributes:
        colour: hexadecimal.
        marker: matplotlib's letter for it; empty for baselines, which have no points.
        line: of the arm's mean.
    """

    colour: str
    marker: str
    line: LineStyle = "-"

    @property
    def mean(self) -> dict[str, Any]:
        """Matplotlib's keywords for the line of the arm's mean."""
        rim = {"markersize": 6.0, "markeredgecolor": "white", "markeredgewidth": 0.6}
        return {"color": self.colour, "linestyle": self.line, "marker": self.marker, "zorder": 3, **rim}


BLACK, ORANGE, SKY, GREEN = "#000000", "#e69f00", "#56b4e9", "#009e73"
BLUE, VERMILION, PURPLE, OLIVE = "#0072b2", "#d55e00", "#cc79a7", "#8f8700"
"""Okabe and Ito, "Color universal design" (2008); their yellow is darkened, or lines of it vanish on white."""

_TRAINED = {
    "neat": ArmStyle(VERMILION, "s"),
    "exneat": ArmStyle(BLUE, "o"),
    "single_unlinked": ArmStyle(SKY, "v"),
    "single_linked": ArmStyle(BLUE, "^"),
    "all_unlinked": ArmStyle(ORANGE, "D"),
    "all_linked": ArmStyle(GREEN, "o"),
    "fb": ArmStyle(PURPLE, "P"),
    "lr": ArmStyle(BLACK, "X"),
    "cross": ArmStyle(OLIVE, "*"),
}
_FALLBACKS = (
    ArmStyle(BLUE, "<"),
    ArmStyle(ORANGE, ">"),
    ArmStyle(GREEN, "p"),
    ArmStyle(PURPLE, "h"),
    ArmStyle(SKY, "d"),
    ArmStyle(BLACK, "8"),
    ArmStyle(OLIVE, "H"),
    ArmStyle(VERMILION, "X"),
)
_DASH_DOT_DOT: LineStyle = (0.0, (4.0, 1.5, 1.0, 1.5, 1.0, 1.5))
_BASELINES = {
    "random": ArmStyle("#8a8a8a", "", ":"),
    "linear_fusion": ArmStyle("#4d4d4d", "", "-."),
    "motionless": ArmStyle("#6b6b6b", "", _DASH_DOT_DOT),
}
_BASELINE_FALLBACKS = tuple(ArmStyle("#7a7a7a", "", line) for line in (":", "-.", _DASH_DOT_DOT))


def arm_styles(arms: Iterable[str], baselines: Iterable[str] = ()) -> dict[str, ArmStyle]:
    """The look of each arm.

    Arms of the thesis have a look of their own. Others take, in their order, the first colour that no
    arm of the same experiment has yet, and start over when all are taken.

    Args:
        arms: names, baselines included, in the order of the experiment.
        baselines: names of those that nothing trains; they are grey lines.
    """
    names, untrained = list(arms), set(baselines)
    trained = [name for name in names if name not in untrained]
    return {
        **_chosen(trained, _TRAINED, _FALLBACKS),
        **_chosen([name for name in names if name in untrained], _BASELINES, _BASELINE_FALLBACKS),
    }


def _chosen(names: list[str], known: dict[str, ArmStyle], fallbacks: tuple[ArmStyle, ...]) -> dict[str, ArmStyle]:
    styles = {name: known[name] for name in names if name in known}
    taken = {(style.colour, style.line) for style in styles.values()}
    free = [style for style in fallbacks if (style.colour, style.line) not in taken] or list(fallbacks)
    strangers = [name for name in names if name not in known]
    return styles | {name: free[k % len(free)] for k, name in enumerate(strangers)}
