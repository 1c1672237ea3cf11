"""How work is shared out: every brain once in each episode, in shares that fit whom they are for."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from exneat_cli.rollouts import sharing
from exneat_cli.rollouts.sharing import blocks, shares_for_threads, short_shares


@given(st.integers(1, 300), st.integers(0, 40), st.integers(1, 20))
@settings(deadline=None)
def test_threads_get_every_brain_once_in_each_episode_in_their_order(brains: int, episodes: int, threads: int) -> None:
    every = [(episode, brain) for episode in range(episodes) for brain in range(brains)]
    for shares in (shares_for_threads(brains, episodes, threads), short_shares(brains, episodes)):
        assert [(episode, b) for episode, first, last in shares for b in range(first, last)] == every


@given(st.integers(1, 60), st.integers(0, 30), st.integers(1, 20), st.integers(1, 10**9))
def test_processes_get_every_brain_once_in_each_episode(b: int, e: int, workers: int, smallest: int) -> None:
    given_out = blocks(b, e, workers, smallest)
    runs = [(k, n) for some, which in given_out for k in range(some.start, some.stop) for n in range(e)[which]]
    assert sorted(runs) == [(k, n) for k in range(b) for n in range(e)]
    assert len(given_out) >= min(workers, b * e)
    if smallest >= b * e:  # not worth being cut
        assert len(given_out) <= 2 * workers


def test_one_thread_draws_each_world_once_and_many_end_with_single_brains() -> None:
    one, eight = ([last - first for _, first, last in shares_for_threads(50, 4, threads)] for threads in (1, 8))
    assert one == [50] * 4
    assert eight[0] > 1
    assert eight[-8:] == [1] * 8


@pytest.mark.parametrize(("seconds_per_brain", "largest"), [(1.0, 1), (1e-5, 200), (0.02, 4)])
def test_calls_in_the_main_thread_are_as_long_as_signals_may_wait(
    seconds_per_brain: float, largest: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = [0.0]
    monkeypatch.setattr(sharing.time, "perf_counter", lambda: now[0])
    sizes = []
    for _, first, last in short_shares(200, 3):
        sizes.append(last - first)
        now[0] += seconds_per_brain * sizes[-1]
    assert max(sizes) == largest
