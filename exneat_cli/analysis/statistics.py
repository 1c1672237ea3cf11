"""Statistics over runs: each function takes one value per run, because episodes of one run are not independent."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy import stats

from exneat_cli.seeding import SHARED_ROOT, generator, stream

Values = Sequence[float] | NDArray[np.float64]
"""One finite value per run, shape (runs,)."""

CONFIDENCE = 0.95
RESAMPLES = 9999
EXACT_BELOW = 21
"""Samples without ties are compared exactly, over all their orders, if both are smaller than this."""


def mean(values: Values) -> float:
    """Take the mean over runs; NaN without any."""
    return float(np.mean(values)) if len(values) else math.nan


def interquartile_mean(values: Values) -> float:
    """Take the mean without the lowest and the highest quarter of runs, each rounded down; NaN without any.

    A single outlier does not move it (Agarwal et al., Deep reinforcement learning at the edge of the
    statistical precipice, 2021).
    """
    return float(stats.trim_mean(values, 0.25)) if len(values) else math.nan


def bootstrap_interval(values: Values) -> tuple[float, float]:
    """Estimate the 95% interval of the mean over runs; NaN for fewer than two runs, or if one is not finite.

    A bias-corrected and accelerated bootstrap (Efron, Better bootstrap confidence intervals, 1987), at a level widened
    from z to sqrt(n / (n - 1)) t (Hesterberg, What teachers should know about the bootstrap, 2015), without
    which intervals of few runs are too narrow. In 2000 samples of ten runs it covered the mean in 95% (normal
    distribution), 92% (exponential) and 88% (lognormal); in samples of three normal runs in 74%. Both ends lie
    between the lowest and the highest run. The same values, in any order, give the same interval.
    """
    runs = np.sort(np.asarray(values, dtype=np.float64))
    if len(runs) < 2 or not np.isfinite(runs).all():
        return math.nan, math.nan
    lowest, highest = float(runs[0]), float(runs[-1])
    if highest - lowest <= 1e-12 * max(abs(lowest), abs(highest)):
        return lowest, highest
    z = math.sqrt(len(runs) / (len(runs) - 1)) * stats.t.isf((1.0 - CONFIDENCE) / 2.0, len(runs) - 1)
    # Two runs ask for a level that rounds to 1, where the correction of the bias is 0 times infinity.
    level = min(float(1.0 - 2.0 * stats.norm.sf(z)), 1.0 - 1e-6)
    # Between 0 and 1, so that cubes of tiny or huge values neither vanish nor overflow.
    unit = stats.bootstrap(
        ((runs - lowest) / (highest - lowest),),
        np.mean,
        n_resamples=RESAMPLES,
        confidence_level=level,
        method="BCa",
        rng=generator(stream(SHARED_ROOT, "bootstrap")),
    ).confidence_interval
    low, high = (lowest + float(end) * (highest - lowest) for end in (unit.low, unit.high))
    return max(lowest, low), min(highest, high)


def mann_whitney_p(one: Values, other: Values) -> float:
    """Two-sided p of the Mann-Whitney U test (Mann and Whitney, 1947); NaN if either has no runs.

    Exact for small samples without ties; else by the normal approximation, corrected for ties and continuity.
    """
    if not len(one) or not len(other):
        return math.nan
    pooled = np.concatenate([np.asarray(one), np.asarray(other)])
    exact = len(np.unique(pooled)) == len(pooled) and max(len(one), len(other)) < EXACT_BELOW
    return float(stats.mannwhitneyu(one, other, method="exact" if exact else "asymptotic").pvalue)


def holm(p_values: pd.Series) -> pd.Series:
    """Correct each p for the number of them (Holm, A simple sequentially rejective test procedure, 1979).

    NaN stays NaN and does not count.
    """
    ranked = p_values.dropna().sort_values(kind="stable")
    steps = (ranked * np.arange(len(ranked), 0, -1)).clip(upper=1.0)
    return steps.cummax().reindex(p_values.index)


def a12(one: Values, other: Values) -> float:
    """P(one > other) + P(one = other) / 2 for a run of each; NaN if either has no runs.

    From sums of ranks (Vargha and Delaney, A critique and improvement of the CL common language effect size
    statistics, 2000). 0.5 means no difference, 1 that every run of `one` beats every run of `other`.
    """
    if not len(one) or not len(other):
        return math.nan
    ranks = stats.rankdata(np.concatenate([np.asarray(one), np.asarray(other)]))
    sum_of_ranks = float(ranks[: len(one)].sum())
    return (sum_of_ranks / len(one) - (len(one) + 1) / 2.0) / len(other)


def efficiency(curve: Values, target: float) -> int | None:
    """Find the first generation, from 1, at which a mean curve of runs reaches `target`; None if it never does."""
    # Equal runs in another order may add up to a mean that differs in the last digit.
    reached = np.flatnonzero(np.asarray(curve) >= target - 1e-9 * abs(target))
    return int(reached[0]) + 1 if len(reached) else None


def least_p(one: int, other: int) -> float:
    """The smallest two-sided p possible with so many runs a side: every run of one side beats all of the other."""
    return min(1.0, 2.0 / math.comb(one + other, one))


def compare(
    values: Mapping[str, Values], untrained: Collection[str] = (), references: Mapping[str, str] | None = None
) -> pd.DataFrame:
    """Summarise variants, each with one value per run or none, and compare each with its reference.

    `references` names the reference of each variant that is not compared with the first one; references themselves are
    not compared. Variants in `untrained` have no p: they do not compete, so they must not cost the other tests power.

    Returns:
        One row per variant, NaN for what does not exist. Columns: runs (how many values), mean, low and high (ends of
        the mean's 95% interval), iqm (interquartile mean), margin (mean minus that of the reference), p_holm
        (`mann_whitney_p` against the reference, corrected by `holm`), a12 (probability that a run of this variant beats
        one of the reference).
    """
    first, references = next(iter(values), ""), references or {}
    rows = []
    for variant, runs in values.items():
        reference = values[references.get(variant, first)]
        own = (len(runs), mean(runs), *bootstrap_interval(runs), interquartile_mean(runs))
        if variant == first or variant in references.values():
            rows.append((*own, math.nan, math.nan, math.nan))
        else:
            p = math.nan if variant in untrained else mann_whitney_p(runs, reference)
            rows.append((*own, mean(runs) - mean(reference), p, a12(runs, reference)))
    table = pd.DataFrame(rows, list(values), ["runs", "mean", "low", "high", "iqm", "margin", "p_holm", "a12"])
    return table.assign(p_holm=holm(table["p_holm"].astype(float)))
