"""Episodes: shared out in full, independent of workers, disturbed as told, counted right, and safe from explosions."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from exneat_cli.brains import Brains, motionless
from exneat_cli.brains.rules import weighted_sums
from exneat_cli.rollouts import Executor, Noise, Runner, runner
from exneat_cli.rollouts.episode import _loop_of
from exneat_cli.rollouts.runner import shares_for_threads, short_shares
from exneat_cli.seeding import generator, training_episodes
from exneat_cli.tasks import AntTask, TrackMaze
from tests.rollouts.drifting import COMPILED, EPISODES, PLAIN, SERIAL, Drifting, assert_equal, random_brains, run

EXPLODING = weighted_sums(np.full((1, 3), math.nan), np.zeros(1))


def by_hand(brain: Brains, k: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The trace of episode k of `Drifting`, and what was sensed, in a few lines of NumPy."""
    world_rng, sensor_rng, action_rng = map(generator, EPISODES[k])
    rows, sensed = [(world_rng.uniform(-1.0, 1.0), 0.0)], []
    while len(sensed) < 12 and abs(rows[-1][0]) <= 2.0:
        x, time = np.clip([rows[-1][0], len(sensed) / 10.0] + sensor_rng.normal(0.0, 0.3, 2), -1.0, 1.0)  # noqa: RUF005
        sensed.append((-x, time, x * time))
        way = -0.5 * (float(np.dot(sensed[-1], brain.edge_weight)) + brain.bias[0] + 0.01 * action_rng.random())
        rows.append((rows[-1][0] + way, way))
    return np.array(rows), np.array(sensed)


@pytest.mark.parametrize("compiled", [True, False])
def test_a_step_observes_disturbs_clips_senses_thinks_drives_and_steps_in_this_order(compiled: bool) -> None:
    brains = random_brains(3)
    with Runner(Drifting(compiled=compiled), Noise(0.3), SERIAL, training=True) as runner:
        fitness = runner.run(brains, EPISODES).fitness
        for b, k in np.ndindex(fitness.shape):
            expected, _ = by_hand(brains[b], k)
            np.testing.assert_allclose(runner.trace(brains[b], EPISODES[k])[0], expected, rtol=0, atol=1e-12)
            assert fitness[b, k] == pytest.approx(expected[:, 1].sum(), abs=1e-12)


def test_moments_are_those_of_all_that_a_brain_sensed_but_in_failed_episodes() -> None:
    brains = [*random_brains(3), EXPLODING]
    moments = run(Drifting(), brains).moments
    assert moments is not None
    for b, brain in enumerate(brains[:-1]):
        sensed = np.concatenate([by_hand(brain, k)[1] for k in range(len(EPISODES))])
        assert (moments.counts[b] == len(sensed)).all()
        np.testing.assert_allclose(moments.means[b], sensed.mean(axis=0), rtol=0, atol=1e-12)
        np.testing.assert_allclose(moments.squares[b] / len(sensed), sensed.var(axis=0), rtol=1e-10)
    assert not np.any([values[-1] for values in moments])


def test_moments_are_of_the_noisy_readings_where_there_is_no_sense_and_are_given_only_if_wanted() -> None:
    with Runner(TrackMaze(), Noise(1e9), SERIAL, training=True) as runner:
        outcomes = runner.run(random_brains(1, TrackMaze()), EPISODES, moments=True)
        assert runner.run(random_brains(1, TrackMaze()), EPISODES).moments is None
    counts, means, squares = outcomes.moments or ()
    assert (counts == outcomes.steps.sum()).all()
    np.testing.assert_allclose(squares / counts, means * (1 - means))  # clipped readings are 0 or 1 in noise so strong


@pytest.mark.parametrize("executor", [SERIAL, Executor("threads", 1), Executor("threads", 5)])
@pytest.mark.parametrize("compiled", [True, False])
def test_outcomes_depend_neither_on_the_workers_nor_on_compilation(compiled: bool, executor: Executor) -> None:
    brains = [*random_brains(9), EXPLODING]
    expected = run(Drifting(), brains)
    assert len(np.unique(expected.fitness)) > 30
    assert_equal(run(Drifting(compiled=compiled), brains, executor), expected)


@pytest.mark.parametrize("task", [Drifting(), Drifting(compiled=False)])
def test_an_exploding_episode_gets_the_failure_floor_and_leaves_the_others_alone(task: Any) -> None:
    good = random_brains(3)
    mixed = run(task, [brain for each in good for brain in (EXPLODING, each)], Executor("threads", 2))
    assert mixed.failed.tolist() == [[True] * 4, [False] * 4] * 3
    np.testing.assert_array_equal(mixed.fitness[1::2], run(task, good).fitness)
    np.testing.assert_array_equal([mixed.fitness[::2], mixed.full_reward[::2]], -7.0)


@pytest.mark.parametrize("acting", [motionless(2, np.zeros(1)), motionless(3, np.zeros(2))])
def test_a_brain_of_another_task_is_refused_before_it_can_touch_memory(acting: Brains) -> None:
    message = r"brains: expected sizes \(3, 1\) of observation and action, got \((2, 1|3, 2)\)"
    with Runner(Drifting(), Noise(), SERIAL, training=False) as runner:
        with pytest.raises(ValueError, match=message):
            runner.run([acting], EPISODES)
        with pytest.raises(ValueError, match=message):
            runner.trace(acting, EPISODES[0])


def replace_functions(patch: pytest.MonkeyPatch, **functions: Any) -> None:
    own = Drifting.open
    patch.setattr(Drifting, "open", lambda task, training: replace(own(task, training=training), **functions))


def test_a_loop_is_compiled_anew_once_a_function_of_ones_own_has_changed(monkeypatch: pytest.MonkeyPatch) -> None:
    before = run(Drifting(), random_brains(1)).fitness
    replace_functions(monkeypatch, drive=COMPILED["locate"])  # goes as far as the point is from 0
    assert (run(Drifting(), random_brains(1)).fitness != before).all()


def test_a_world_without_sense_whose_task_needs_one_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    replace_functions(monkeypatch, sense=None)
    with pytest.raises(ValueError, match="task drifting: expected a simulation with `sense`, since brains sense 3"):
        run(Drifting(), random_brains(1))


def test_an_error_in_one_thread_stops_the_others_reaches_the_caller_and_leaves_the_runner_usable(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def fragile(world: Any, rng: Any) -> None:
        begun.append(world)
        if len(begun) == 3:
            raise RuntimeError("broken")
        PLAIN["reset"](world, rng)

    brains, episodes, begun = random_brains(20), training_episodes(0, 0, 20), []
    expected = run(Drifting(), brains, episodes=episodes)
    replace_functions(monkeypatch, reset=fragile)
    with Runner(Drifting(compiled=False), Noise(0.3), Executor("threads", 2), training=True) as runner:
        with pytest.raises(RuntimeError, match="broken"):
            runner.run(brains, episodes)
        assert 3 <= len(begun) < 20
        assert_equal(runner.run(brains, episodes, moments=True), expected)


@given(st.integers(1, 300), st.integers(0, 40), st.integers(1, 20))
@settings(deadline=None)
def test_threads_get_every_brain_once_in_each_episode_in_their_order(brains: int, episodes: int, threads: int) -> None:
    every = [(episode, brain) for episode in range(episodes) for brain in range(brains)]
    for shares in (shares_for_threads(brains, episodes, threads), short_shares(brains, episodes)):
        assert [(episode, b) for episode, first, last in shares for b in range(first, last)] == every


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
    monkeypatch.setattr(runner.time, "perf_counter", lambda: now[0])
    sizes = []
    for _, first, last in short_shares(200, 3):
        sizes.append(last - first)
        now[0] += seconds_per_brain * sizes[-1]
    assert max(sizes) == largest


def test_worlds_of_one_task_that_sense_differently_never_share_a_cached_loop() -> None:
    world, part = (_loop_of(AntTask(frame=frame).open(training=True), "ant") for frame in ("world", "part"))
    assert world.py_func.__qualname__ != part.py_func.__qualname__  # type: ignore[attr-defined]
