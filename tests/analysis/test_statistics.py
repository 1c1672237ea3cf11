"""Statistics against cases worked out by hand, against scipy, and against counting."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.random import Generator
from scipy import stats

from exneat_cli.analysis.statistics import (
    a12,
    area,
    bootstrap_interval,
    compare,
    efficiency,
    holm,
    interquartile_mean,
    mann_whitney_p,
    mean,
)

FIGURES = st.lists(st.floats(-1e6, 1e6, allow_subnormal=False), min_size=2, max_size=12)
COARSE = st.lists(st.integers(0, 4).map(float), min_size=1, max_size=6)
P_VALUES = st.lists(st.floats(0.0, 1.0), min_size=1, max_size=8)


@pytest.mark.parametrize(
    ("draw", "truth"),
    [
        (lambda generator: generator.normal(size=10), 0.0),
        (lambda generator: generator.exponential(size=10), 1.0),
        (lambda generator: generator.beta(5.0, 0.7, size=10), 5.0 / 5.7),
    ],
    ids=["normal", "long tail", "near a ceiling"],
)
def test_the_interval_covers_the_true_mean_often_enough_at_ten_runs(
    draw: Callable[[Generator], np.ndarray], truth: float
) -> None:
    generator = np.random.default_rng(1)
    intervals = [bootstrap_interval(draw(generator)) for _ in range(300)]
    assert sum(low <= truth <= high for low, high in intervals) / len(intervals) >= 0.85


def test_the_interval_of_many_runs_is_that_of_the_normal_approximation() -> None:
    runs = np.random.default_rng(2).normal(5.0, 2.0, size=400)
    half = 1.96 * runs.std(ddof=1) / math.sqrt(len(runs))
    assert bootstrap_interval(runs) == pytest.approx((runs.mean() - half, runs.mean() + half), abs=0.05 * half)


@given(FIGURES, st.randoms(use_true_random=False))
@settings(max_examples=40, deadline=None)
def test_the_interval_holds_the_mean_within_the_runs_and_ignores_their_order(
    figures: list[float], random: object
) -> None:
    low, high = bootstrap_interval(figures)
    assert min(figures) <= low <= high <= max(figures)
    rounding = 1e-9 * (max(figures) - min(figures)) + 1e-12 * max(map(abs, figures))
    assert low - rounding <= mean(figures) <= high + rounding
    shuffled = list(figures)
    random.shuffle(shuffled)  # type: ignore[attr-defined]
    assert bootstrap_interval(shuffled) == (low, high)


@pytest.mark.parametrize("runs", [2, 3, 10])
def test_runs_that_are_all_equal_have_an_interval_of_no_width(runs: int) -> None:
    assert bootstrap_interval([0.7] * runs) == (0.7, 0.7)


def test_neither_no_run_nor_one_run_nor_a_run_without_a_figure_has_an_interval() -> None:
    for figures in ([], [1.0], [1.0, math.nan, 2.0]):
        assert all(math.isnan(end) for end in bootstrap_interval(figures))


@pytest.mark.parametrize(
    ("figures", "expected"),
    [([1.0, 2.0, 3.0, 100.0], 2.5), ([1.0, 2.0, 9.0], 4.0), ([0.0, 0.0, *range(1, 7), 50.0, 99.0], 3.5)],
)
def test_the_interquartile_mean_leaves_out_a_quarter_at_each_end(figures: list[float], expected: float) -> None:
    assert interquartile_mean(figures) == pytest.approx(expected)


def test_no_runs_have_no_mean_and_no_interquartile_mean() -> None:
    assert math.isnan(mean([]))
    assert math.isnan(interquartile_mean([]))


def test_runs_apart_have_the_smallest_exact_p() -> None:
    assert mann_whitney_p([1.0, 2.0, 3.0], [4.0, 5.0, 6.0]) == pytest.approx(2 / math.comb(6, 3))
    ten = np.arange(10.0)
    assert mann_whitney_p(ten, ten + 20.0) == pytest.approx(2 / math.comb(20, 10))


@given(st.permutations(range(7)), st.integers(1, 6))
def test_p_without_ties_is_the_share_of_orders_at_least_as_far_apart(order: list[int], size: int) -> None:
    def off_centre(ranks: tuple[int, ...]) -> float:
        return abs(sum(ranks) - size * 3.0)

    orders = list(itertools.combinations(range(7), size))
    as_far = sum(off_centre(each) >= off_centre(tuple(order[:size])) for each in orders)
    one, other = [float(r) for r in order[:size]], [float(r) for r in order[size:]]
    assert mann_whitney_p(one, other) == pytest.approx(as_far / len(orders))


@given(COARSE, COARSE)
def test_p_with_ties_is_that_of_scipy(one: list[float], other: list[float]) -> None:
    tied = [2.0, *one], [2.0, *other]
    assert mann_whitney_p(*tied) == stats.mannwhitneyu(*tied).pvalue


def test_p_of_runs_that_are_all_equal_is_one() -> None:
    assert mann_whitney_p([1.0] * 3, [1.0] * 3) == 1.0


def test_holm_corrects_a_case_worked_out_by_hand() -> None:
    corrected = holm([0.01, 0.04, math.nan, 0.03, 0.5])
    assert [corrected[k] for k in (0, 1, 3, 4)] == pytest.approx([0.04, 0.09, 0.09, 0.5])
    assert math.isnan(corrected[2])


def test_a_single_p_needs_no_correction() -> None:
    assert holm([math.nan, 0.2])[1] == 0.2
    assert holm([]) == []


@given(P_VALUES)
def test_holm_lies_between_no_correction_and_bonferroni_and_keeps_the_order(p_values: list[float]) -> None:
    corrected = holm(p_values)
    for p, q in zip(p_values, corrected, strict=True):
        assert p <= q <= min(1.0, len(p_values) * p)
    assert min(corrected) == min(1.0, len(p_values) * min(p_values))
    by_p = [corrected[k] for k in np.argsort(p_values, kind="stable")]
    assert by_p == sorted(by_p)


@given(COARSE, COARSE)
def test_a12_is_the_share_of_pairs_won_with_ties_as_half(one: list[float], other: list[float]) -> None:
    won = [1.0 if a > b else 0.5 if a == b else 0.0 for a in one for b in other]
    assert a12(one, other) == pytest.approx(sum(won) / len(won))


def test_a12_is_one_zero_or_a_half_at_its_extremes() -> None:
    low, high = [0.1, 0.2, 0.3], [0.8, 0.9]
    assert (a12(high, low), a12(low, high), a12(low, low), a12([1.0], [1.0])) == (1.0, 0.0, 0.5, 0.5)


def test_without_runs_there_is_neither_p_nor_a12() -> None:
    for pair in (([], [1.0]), ([1.0], []), ([], [])):
        assert math.isnan(mann_whitney_p(*pair))
        assert math.isnan(a12(*pair))


@pytest.mark.parametrize(
    ("curve", "target", "generation"),
    [
        ([0.2, 0.5, 0.9], 0.1, 1),
        ([0.2, 0.5, 0.9], 0.5, 2),
        ([0.2, 0.5, 0.9], 0.6, 3),
        ([0.2, 0.5, 0.9], 0.95, None),
        ([-5.0, -3.0], -4.0, 2),
        ([0.1 + 0.2], 0.3, 1),
        ([0.3], 0.1 + 0.2, 1),
        ([], 0.5, None),
    ],
)
def test_efficiency_is_the_first_generation_that_reaches_the_target(
    curve: list[float], target: float, generation: int | None
) -> None:
    assert efficiency(curve, target) == generation


def test_an_variant_that_is_good_early_has_more_area() -> None:
    assert area([0.0, 1.0, 1.0, 1.0]) == 0.75
    assert area([0.0, 0.0, 0.0, 1.0]) == 0.25


def test_every_variant_is_compared_with_the_first_and_corrected_together() -> None:
    low, middle, high = [0.1, 0.2, 0.3], [0.15, 0.25, 0.35], [0.7, 0.8, 0.9]
    found = compare({"neat": low, "single": middle, "all": high})
    assert math.isnan(found["neat"].p)
    assert math.isnan(found["neat"].a12)
    alone = [mann_whitney_p(variant, low) for variant in (middle, high)]
    assert [found["single"].p, found["all"].p] == holm(alone)
    assert found["all"].p == pytest.approx(2 * 0.1)
    assert (found["single"].a12, found["all"].a12) == (pytest.approx(6 / 9), 1.0)
    assert (found["all"].runs, found["all"].mean) == (3, pytest.approx(0.8))


def test_an_untrained_variant_has_an_effect_size_but_costs_the_others_no_power() -> None:
    variants = {"neat": [0.1, 0.2, 0.3], "exneat": [0.7, 0.8, 0.9], "random": [0.0]}
    found = compare(variants, untrained=("random",))
    assert found["exneat"].p == pytest.approx(0.1)
    assert math.isnan(found["random"].p)
    assert found["random"].a12 == 0.0


def test_variants_without_runs_can_be_compared() -> None:
    found = compare({"neat": [], "exneat": [0.5, 0.6], "all": []})
    assert (found["neat"].runs, found["exneat"].runs) == (0, 2)
    for variant in ("exneat", "all"):
        assert math.isnan(found[variant].p)
        assert math.isnan(found[variant].a12)
    assert math.isnan(found["all"].mean)
    assert compare({}) == {}
