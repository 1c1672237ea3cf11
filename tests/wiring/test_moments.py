"""Statistics of what brains sense, per pin."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from exneat_cli.tasks import AntTask
from exneat_cli.wiring import Geometry, Moments, Wiring, merged, plan_modules, pooled_by_pin


def moments_of(samples: np.ndarray) -> Moments:
    """Of the last axis."""
    means = samples.mean(axis=-1, keepdims=True)
    counts = np.full(samples.shape[:-1], float(samples.shape[-1]))
    return Moments(counts, means[..., 0], ((samples - means) ** 2).sum(axis=-1))


@given(st.lists(st.integers(1, 20), min_size=1, max_size=6), st.integers(0, 2**32 - 1))
def test_merged_moments_are_those_of_all_numbers_together(lengths: list[int], seed: int) -> None:
    parts = [np.random.default_rng(seed + k).normal(3.0, 2.0, (4, length)) for k, length in enumerate(lengths)]
    together = merged((moments_of(part) for part in parts), 4)
    for ours, expected in zip(together, moments_of(np.concatenate(parts, axis=1)), strict=True):
        np.testing.assert_allclose(ours, expected, rtol=1e-9, atol=1e-9)


def test_pins_pool_over_teams_and_the_modules_that_share_them_and_links_count_nothing() -> None:
    plan = plan_modules(AntTask(), Geometry("single"), "output", Wiring(), hidden=4)
    samples = np.random.default_rng(0).normal(size=(2, plan.observation_size, 5))
    legs, central = pooled_by_pin(plan, moments_of(samples))
    entries = [[module.sensors[3] for module in plan.modules[:4]], [plan.modules[4].sensors[3]]]
    for pooled, own in zip((legs, central), entries, strict=True):
        expected = moments_of(samples[:, own].reshape(1, -1))
        np.testing.assert_allclose([values[3] for values in pooled], np.ravel(expected), rtol=1e-9)
    assert legs.counts.tolist() == [2 * 4 * 5.0] * 22 + [0.0] * 6
