"""Two one-sided tests.

Source: Schuirmann, "A comparison of the two one-sided tests procedure and the power approach" (1987), with
Welch's degrees of freedom.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy import stats

MARGIN = 0.5
"""Largest difference that counts as none, in standard deviations between seeds of stock genomes."""
ALPHA = 0.05


class Equivalence(NamedTuple):
    """How far array genomes are from stock ones.

    Attributes:
        seeds: per kind of genome.
        array_mean, stock_mean: final fitness.
        stock_sd: between seeds.
        low, high: 90% interval of the difference of means (array less stock), in units of `stock_sd`.
        p: the larger of the two one-sided p-values.
    """

    seeds: int
    array_mean: float
    stock_mean: float
    stock_sd: float
    low: float
    high: float
    p: float

    @property
    def shown(self) -> bool:
        """Whether the difference lies within the margin, at `ALPHA`."""
        return self.p < ALPHA


def compare(array: Sequence[float], stock: Sequence[float]) -> Equivalence:
    """Two one-sided Welch tests of final fitness, one value per seed each."""
    ours, theirs = np.array(array), np.array(stock)
    sd = float(theirs.std(ddof=1))
    below = stats.ttest_ind(ours + MARGIN * sd, theirs, equal_var=False, alternative="greater").pvalue
    above = stats.ttest_ind(ours - MARGIN * sd, theirs, equal_var=False, alternative="less").pvalue
    interval = stats.ttest_ind(ours, theirs, equal_var=False).confidence_interval(1.0 - 2.0 * ALPHA)
    return Equivalence(
        seeds=len(ours),
        array_mean=float(ours.mean()),
        stock_mean=float(theirs.mean()),
        stock_sd=sd,
        low=float(interval.low) / sd,
        high=float(interval.high) / sd,
        p=max(float(below), float(above)),
    )
