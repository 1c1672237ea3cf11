"""What one row of the table holds, and how ratios are measured."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

RATIO = "ratio"
SECONDS = "s"
MEGABYTES = "MB"
STEPS_A_SECOND = "steps/s"
"""Units of the rows; 1 MB is 10^6 bytes."""


class VerificationError(RuntimeError):
    """The two sides of a comparison did not do the same, or a process failed: no figure would count."""


@dataclass(frozen=True)
class Bar:
    """What a row's median should reach.

    Attributes:
        value: in the row's unit.
        at_least: whether the median should be `value` or more, else `value` or less.
    """

    value: float
    at_least: bool

    def __str__(self) -> str:
        return f"{'at least' if self.at_least else 'at most'} {self.value:g}"

    def met_by(self, median: float) -> bool:
        """Whether `median`, in the row's unit, reaches the bar."""
        return median >= self.value if self.at_least else median <= self.value


@dataclass(frozen=True)
class Row:
    """One row of the table.

    Attributes:
        comparison: what was compared or measured, in words.
        unit: one of `RATIO`, `SECONDS`, `MEGABYTES` and `STEPS_A_SECOND`.
        values: one per repetition, in that unit.
        bar: what their median should reach; None where nothing is asked of it.
        note: what a reader needs to judge the figures by.
    """

    comparison: str
    unit: str
    values: Sequence[float]
    bar: Bar | None
    note: str = ""

    @property
    def median(self) -> float:
        """Median over the repetitions, in the row's unit."""
        return statistics.median(self.values)

    @property
    def verdict(self) -> str:
        """``meets`` or ``misses``; ``-`` without a bar."""
        if self.bar is None:
            return "-"
        return "meets" if self.bar.met_by(self.median) else "misses"


def seconds_of(work: Callable[[], object]) -> float:
    """Wall seconds of one call."""
    began = time.perf_counter()
    work()
    return time.perf_counter() - began


class Pair(NamedTuple):
    """The two sides of a comparison, for one piece of the work.

    Attributes:
        ours, reference: do the same number of environment steps once and return their wall seconds.
    """

    ours: Callable[[], float]
    reference: Callable[[], float]


def speed_ratios(pairs: Sequence[Pair], repetitions: int) -> list[float]:
    """How many times as fast as the reference we are, one value per repetition.

    Args:
        pairs: the pieces of one repetition. Both sides take turns from piece to piece, so that a machine
            that slows down for a second slows down both.
        repetitions: how often all pieces are done.
    """
    ratios = []
    for _ in range(repetitions):
        seconds = [(pair.ours(), pair.reference()) for pair in pairs]
        our_seconds, reference_seconds = (sum(side) for side in zip(*seconds, strict=True))
        ratios.append(reference_seconds / our_seconds)
    return ratios


def growth_ratios(costs: Sequence[Callable[[], float]], repetitions: int) -> list[list[float]]:
    """How many times as long each size of the work takes as the one before it.

    Args:
        costs: one per size, in rising order: does the work once and returns its wall seconds. All sizes
            take turns.
        repetitions: how often every size is done.

    Returns:
        For every size but the first, one value per repetition.
    """
    rounds = [[cost() for cost in costs] for _ in range(repetitions)]
    return [[seconds[k] / seconds[k - 1] for seconds in rounds] for k in range(1, len(costs))]


class Pace(NamedTuple):
    """Agent steps that were done, and the wall seconds that they took."""

    steps: int
    seconds: float

    @property
    def rate(self) -> float:
        """Steps per second."""
        return self.steps / self.seconds


class Paces(NamedTuple):
    """What `pace_ratios` found.

    Attributes:
        ratios: steps per second of ours over those of the reference, one value per repetition.
        ours, reference: the last repetition.
    """

    ratios: list[float]
    ours: Pace
    reference: Pace


def pace_ratios(pairs: Sequence[tuple[Callable[[], Pace], Callable[[], Pace]]], repetitions: int) -> Paces:
    """`speed_ratios` for sides that do not do the same number of steps.

    Args:
        pairs: ours and the reference for every piece of one repetition; the sides take turns.
        repetitions: how often all pieces are done, at least 1.
    """
    ratios = []
    for _ in range(repetitions):
        sides = zip(*[(ours(), reference()) for ours, reference in pairs], strict=True)
        ours, reference = (Pace(sum(p.steps for p in side), sum(p.seconds for p in side)) for side in sides)
        ratios.append(ours.rate / reference.rate)
    return Paces(ratios, ours, reference)
