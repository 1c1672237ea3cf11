"""Statistics of the sensed values: per entry while episodes run, pooled per pin for algorithms that ask for them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exneat_cli.wiring.plan import Plan


class Moments(NamedTuple):
    """Counts, means and sums of squared deviations of sequences of numbers; arrays of equal shapes."""

    counts: NDArray[np.float64]
    means: NDArray[np.float64]
    squares: NDArray[np.float64]


def merged(parts: Iterable[Moments], size: int) -> Moments:
    """The moments of all parts together, (size,); their last bits depend on the order of the parts.

    Source: Chan, Golub and LeVeque, "Updating formulae and a pairwise algorithm for computing sample variances",
    1979.
    """
    count, mean, squares = np.zeros((3, size))
    for part in parts:
        together = count + part.counts
        share = np.divide(part.counts, together, out=np.zeros(size), where=together > 0)
        step = part.means - mean
        squares = squares + part.squares + step * step * count * share
        mean = mean + step * share
        count = together
    return Moments(count, mean, squares)


def with_sensed(before: Sequence[Moments], new: Sequence[Moments]) -> list[Moments]:
    """The moments of each subpopulation's pins, updated with new ones."""
    return [merged(pair, pair[0].counts.size) for pair in zip(before, new, strict=True)]


def pooled_by_pin(plan: Plan, teams: Moments) -> tuple[Moments, ...]:
    """The moments of each subpopulation's pins, (pins,), over `teams`, (T, sensed), and the modules that share it.

    Teams are merged in order, and so are the modules of each team. Pins that read modules have a count of 0.
    """
    found = []
    for index, (count, _, _) in enumerate(plan.subpopulation_shapes):
        entries = [
            np.array([pin.index if pin.is_sensor else -1 for pin in module.pins], np.int64)
            for module in plan.modules
            if module.subpopulation == index
        ]
        parts = [
            Moments(*(np.where(own >= 0, values[team, own], 0.0) for values in teams))
            for team in range(len(teams.counts))
            for own in entries
        ]
        found.append(merged(parts, count))
    return tuple(found)
