"""Statistics over runs: each function takes one figure per run, because episodes of one run are not independent."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy import stats

from exneat_cli.seeding import SHARED_ROOT, generator, stream

FloatArray = npt.NDArray[np.float64]
Figures = Sequence[float] | FloatArray
"""One finite figure per run, shape (runs,)."""

CONFIDENCE = 0.95
RESAMPLES = 9999
EXACT_BELOW = 21
"""Samples without ties are compared by all their orders when both are smaller than this."""


class Interval(NamedTuple):
    """Both ends of an interval, in the unit of the figures; NaN where there is none."""

    low: float
    high: float


@dataclass(frozen=True)
class Summary:
    """One variant beside the first one; figures that do not exist are NaN.

    Attributes:
        runs: how many figures there are.
        mean, iqm: mean and interquartile mean over runs.
        interval: of the mean.
        p: of `mann_whitney_p` against the first variant, corrected by `holm`.
        a12: chance that a run of this variant beats one of the first.
    """

    runs: int
    mean: float
    iqm: float
    interval: Interval
    p: float
    a12: float


def mean(values: Figures) -> float:
    """Mean over runs; NaN without any."""
    return float(np.mean(values)) if len(values) else math.nan


def interquartile_mean(values: Figures) -> float:
    """Mean of what is left without the lowest and the highest quarter of runs, each rounded down; NaN without any.

    One run gone astray does not move it (Agarwal et al., Deep reinforcement learning at the edge of the
    statistical precipice, 2021).
    """
    return float(stats.trim_mean(values, 0.25)) if len(values) else math.nan


def bootstrap_interval(values: Figures) -> Interval:
    """95% bootstrap interval of the mean over runs; NaN for fewer than two runs, or if one is not finite.

    Bias-corrected and accelerated (Efron, Better bootstrap confidence intervals, 1987), at a level widened
    from z to sqrt(n / (n - 1)) t (Hesterberg, What teachers should know about the bootstrap, 2015), without
    which intervals of few runs are too narrow. In 2000 samples of ten runs it covered the mean in 95% (normal
    distribution), 92% (exponential) and 88% (lognormal); in samples of three normal runs in 74%. Both ends lie
    between the lowest and the highest run. The same figures, in any order, give the same interval.
    """
    runs = np.sort(np.asarray(values, dtype=np.float64))
    if len(runs) < 2 or not np.isfinite(runs).all():
        return Interval(math.nan, math.nan)
    lowest, highest = float(runs[0]), float(runs[-1])
    if highest - lowest <= 1e-12 * max(abs(lowest), abs(highest)):
        return Interval(lowest, highest)
    # Between 0 and 1, so that cubes of tiny or huge figures neither vanish nor overflow.
    unit = stats.bootstrap(
        ((runs - lowest) / (highest - lowest),),
        np.mean,
        n_resamples=RESAMPLES,
        confidence_level=_widened_level(len(runs)),
        method="BCa",
        rng=generator(stream(SHARED_ROOT, "bootstrap")),
    ).confidence_interval
    low, high = (lowest + float(end) * (highest - lowest) for end in (unit.low, unit.high))
    return Interval(max(lowest, low), min(highest, high))


def _widened_level(runs: int) -> float:
    tail = (1.0 - CONFIDENCE) / 2.0
    z = math.sqrt(runs / (runs - 1)) * stats.t.isf(tail, runs - 1)
    # Two runs ask for a level that rounds to 1, where the correction of the bias is 0 times infinity.
    return min(float(1.0 - 2.0 * stats.norm.sf(z)), 1.0 - 1e-6)


def mann_whitney_p(one: Figures, other: Figures) -> float:
    """Two-sided p of the Mann-Whitney U test (Mann and Whitney, 1947); NaN if either has no runs.

    Exact for small samples without ties; else by the normal approximation, corrected for ties and continuity.
    """
    if not len(one) or not len(other):
        return math.nan
    pooled = np.concatenate([np.asarray(one), np.asarray(other)])
    exact = len(np.unique(pooled)) == len(pooled) and max(len(one), len(other)) < EXACT_BELOW
    return float(stats.mannwhitneyu(one, other, method="exact" if exact else "asymptotic").pvalue)


def holm(p_values: Sequence[float]) -> list[float]:
    """Each p corrected for how many there are (Holm, A simple sequentially rejective test procedure, 1979).

    NaN stays NaN and does not count.
    """
    corrected = [math.nan] * len(p_values)
    order = sorted((k for k, p in enumerate(p_values) if not math.isnan(p)), key=lambda k: p_values[k])
    highest = 0.0
    for rank, k in enumerate(order):
        highest = max(highest, min(1.0, (len(order) - rank) * p_values[k]))
        corrected[k] = highest
    return corrected


def a12(one: Figures, other: Figures) -> float:
    """P(one > other) + P(one = other) / 2 for a run of each; NaN if either has no runs.

    From sums of ranks (Vargha and Delaney, A critique and improvement of the CL common language effect size
    statistics, 2000). 0.5 means no difference, 1 that every run of `one` beats every run of `other`.
    """
    if not len(one) or not len(other):
        return math.nan
    ranks = stats.rankdata(np.concatenate([np.asarray(one), np.asarray(other)]))
    sum_of_ranks = float(ranks[: len(one)].sum())
    return (sum_of_ranks / len(one) - (len(one) + 1) / 2.0) / len(other)


def efficiency(curve: Figures, target: float) -> int | None:
    """First generation, counted from 1, at which `curve` reaches `target`; None if it never does.

    Args:
        curve: mean best so far over runs, one entry per generation.
        target: final entry of the curve that is to be reached.
    """
    # Equal runs in another order may add up to a mean that differs in the last digit.
    reached = np.flatnonzero(np.asarray(curve) >= target - 1e-9 * abs(target))
    return int(reached[0]) + 1 if len(reached) else None


def area(best_so_far: Figures) -> float:
    """Mean of one run's training curve over its generations; high where a run is good early."""
    return mean(best_so_far)


def compare(values: Mapping[str, Figures], untrained: Collection[str] = ()) -> dict[str, Summary]:
    """One summary per variant; the first variant is what the others are compared with.

    Args:
        values: variant -> one figure per run; may be empty.
        untrained: variants without p: they are no competitors, so they must not cost the others power.
    """
    first, reference = next(iter(values.items()), ("", ()))
    tested = [variant for variant in values if variant != first and variant not in untrained]
    corrected = holm([mann_whitney_p(values[variant], reference) for variant in tested])
    p_of = dict(zip(tested, corrected, strict=True))
    return {
        variant: Summary(
            runs=len(figures),
            mean=mean(figures),
            iqm=interquartile_mean(figures),
            interval=bootstrap_interval(figures),
            p=p_of.get(variant, math.nan),
            a12=math.nan if variant == first else a12(figures, reference),
        )
        for variant, figures in values.items()
    }
