"""Statistics against cases worked out by hand, and against counting."""

from __future__ import annotations

import itertools
import math
import random

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from exneat_cli.analysis.statistics import (
    a12,
    bootstrap_interval,
    compare,
    efficiency,
    holm,
    interquartile_mean,
    least_p,
    mann_whitney_p,
    mean,
)

VALUES = st.lists(st.floats(-1e6, 1e6, allow_subnormal=False), min_size=2, max_size=12)
COARSE = st.lists(st.integers(0, 4).map(float), min_size=1, max_size=6)
P_VALUES = st.lists(st.floats(0.0, 1.0), min_size=1, max_size=8)


def test_the_interval_covers_the_true_mean_often_enough_at_ten_runs() -> None:
    draw = np.random.default_rng(1)
    for sample, truth in ((draw.normal, 0.0), (draw.exponential, 1.0)):
        intervals = [bootstrap_interval(sample(size=10)) for _ in range(300)]
        assert sum(low <= truth <= high for low, high in intervals) / len(intervals) >= 0.85


@given(VALUES)
@settings(max_examples=40, deadline=None)
def test_the_interval_holds_the_mean_within_the_runs_and_ignores_their_order(values: list[float]) -> None:
    low, high = bootstrap_interval(values)
    assert min(values) <= low <= high <= max(values)
    rounding = 1e-9 * (max(values) - min(values)) + 1e-12 * max(map(abs, values))
    assert low - rounding <= mean(values) <= high + rounding
    assert bootstrap_interval(random.Random(0).sample(values, len(values))) == (low, high)


def test_equal_runs_have_an_interval_of_no_width_and_too_few_or_unmeasured_ones_have_none() -> None:
    for runs in (2, 3, 10):
        assert bootstrap_interval([0.7] * runs) == (0.7, 0.7)
    for values in ([], [1.0], [1.0, math.nan, 2.0]):
        assert all(math.isnan(end) for end in bootstrap_interval(values))


def test_the_interquartile_mean_leaves_out_a_quarter_at_each_end() -> None:
    for values, expected in (([1.0, 2.0, 3.0, 100.0], 2.5), ([1.0, 2.0, 9.0], 4.0), ([0.0, 0.0, *range(1, 9)], 3.5)):
        assert interquartile_mean(values) == pytest.approx(expected)


@given(st.permutations(range(7)), st.integers(1, 6))
def test_p_without_ties_is_the_share_of_orders_at_least_as_far_apart(order: list[int], size: int) -> None:
    def off_centre(ranks: tuple[int, ...]) -> float:
        return abs(sum(ranks) - size * 3.0)

    orders = list(itertools.combinations(range(7), size))
    as_far = sum(off_centre(each) >= off_centre(tuple(order[:size])) for each in orders)
    one, other = [float(r) for r in order[:size]], [float(r) for r in order[size:]]
    assert mann_whitney_p(one, other) == pytest.approx(as_far / len(orders))


def test_holm_corrects_a_case_worked_out_by_hand() -> None:
    corrected = holm(pd.Series([0.01, 0.04, math.nan, 0.03, 0.5]))
    np.testing.assert_allclose(corrected, [0.04, 0.09, math.nan, 0.09, 0.5])
    assert holm(pd.Series([], dtype=float)).empty


@given(P_VALUES)
def test_holm_lies_between_no_correction_and_bonferroni_and_keeps_the_order(p_values: list[float]) -> None:
    corrected = holm(pd.Series(p_values))
    for p, q in zip(p_values, corrected, strict=True):
        assert p <= q <= min(1.0, len(p_values) * p)
    assert min(corrected) == min(1.0, len(p_values) * min(p_values))
    by_p = [corrected[k] for k in np.argsort(p_values, kind="stable")]
    assert by_p == sorted(by_p)


@given(COARSE, COARSE)
def test_a12_is_the_share_of_pairs_won_with_ties_as_half(one: list[float], other: list[float]) -> None:
    won = [1.0 if a > b else 0.5 if a == b else 0.0 for a in one for b in other]
    assert a12(one, other) == pytest.approx(sum(won) / len(won))


def test_efficiency_is_the_first_generation_that_reaches_the_target() -> None:
    rising = [0.2, 0.5, 0.9]
    assert [efficiency(rising, target) for target in (0.1, 0.5, 0.6, 0.95)] == [1, 2, 3, None]
    assert efficiency([-5.0, -3.0], -4.0) == 2
    assert efficiency([0.3], 0.1 + 0.2) == 1, "equal but for rounding"


def test_every_variant_is_compared_with_the_first_and_those_that_learn_are_corrected_together() -> None:
    low, middle, high = [0.1, 0.2, 0.3], [0.15, 0.25, 0.35], [0.7, 0.8, 0.9]
    found = compare({"neat": low, "single": middle, "all": high, "random": [0.0]}, untrained=("random",))
    alone = [mann_whitney_p(variant, low) for variant in (middle, high)]
    np.testing.assert_allclose(found["p_holm"], [math.nan, *holm(pd.Series(alone)), math.nan])
    assert found.loc["all", "p_holm"] == pytest.approx(2 * 0.1)
    np.testing.assert_allclose(found["a12"], [math.nan, 6 / 9, 1.0, 0.0])
    assert list(found["runs"]) == [3, 3, 3, 1]
    assert found.loc["all", ["mean", "iqm"]].tolist() == pytest.approx([0.8, 0.8])


def test_those_that_others_are_compared_with_are_not_compared_themselves() -> None:
    low, middle, high = [0.1, 0.2, 0.3], [0.15, 0.25, 0.35], [0.7, 0.8, 0.9]
    found = compare({"a": low, "b": high, "c": middle, "d": high}, references={"d": "c"})
    assert found[["margin", "p_holm", "a12"]].isna().all(axis=1).tolist() == [True, False, True, False]
    np.testing.assert_allclose(found.loc[["b", "d"], "margin"], [0.6, 0.55])
    np.testing.assert_allclose(found.loc[["b", "d"], "p_holm"], 2 * 0.1)


@pytest.mark.parametrize(("one", "other"), [(1, 1), (1, 3), (3, 3), (4, 5)])
def test_the_least_p_is_that_of_samples_far_apart(one: int, other: int) -> None:
    low, high = [float(k) for k in range(one)], [100.0 + k for k in range(other)]
    assert least_p(one, other) == pytest.approx(mann_whitney_p(low, high))


def test_variants_without_runs_can_be_compared() -> None:
    found = compare({"neat": [], "exneat": [0.5, 0.6], "all": []})
    assert list(found["runs"]) == [0, 2, 0]
    assert found[["p_holm", "a12"]].isna().all(axis=None)
    assert found.loc["all"].drop("runs").isna().all()
    assert compare({}).empty
