"""The sentence at the end of a run tells what happened, also when nothing did."""

from __future__ import annotations

import numpy as np
import pytest

from exneat_cli.records import Result, Score
from exneat_cli.rollouts import Outcomes
from exneat_cli.runs.scores import score_all, summary_sentence, unseen_episodes
from exneat_cli.runs.settings import RunSettings
from exneat_cli.seeding import generator, shared_episodes
from exneat_cli.tasks import AntTask


def test_a_score_counts_failures_with_their_floor() -> None:
    outcomes = Outcomes(
        fitness=np.array([[1.0, 3.0], [10.0, -100.0]]),
        full_reward=np.array([[2.0, 4.0], [20.0, -100.0]]),
        steps=np.array([[5, 5], [5, 2]]),
        failed=np.array([[False, False], [False, True]]),
    )
    sound, tested = score_all(outcomes)
    assert (sound.episodes, sound.failed_episodes, sound.fitness) == (2, 0, (1.0, 3.0))
    assert (tested.episodes, tested.failed_episodes, tested.fitness) == (2, 1, (10.0, -100.0))
    assert (tested.fitness_mean, tested.fitness_std) == (-45.0, 55.0)
    assert (tested.full_reward_mean, tested.full_reward_std) == (-40.0, 60.0)


def test_random_actions_face_the_test_episodes_with_chance_of_the_runs_own() -> None:
    def draws(root: int) -> list[list[float]]:
        settings = RunSettings(algorithm="random", seed=root)
        return [[generator(seed).random() for seed in seeds] for seeds in unseen_episodes(settings, 3)]

    tests = [[generator(seed).random() for seed in seeds] for seeds in shared_episodes("test", 3)]
    zero, one = np.array(draws(0)), np.array(draws(1))
    np.testing.assert_array_equal(zero[:, :2], np.array(tests)[:, :2])
    np.testing.assert_array_equal(one[:, :2], zero[:, :2])
    assert len(np.unique([zero[:, 2], one[:, 2]])) == 6


@pytest.mark.parametrize("algorithm", ["neat", "exneat", "motionless"])
def test_all_other_variants_face_the_very_same_test_episodes(algorithm: str) -> None:
    episodes = unseen_episodes(RunSettings(algorithm=algorithm, seed=7), 3)
    draws = [[generator(seed).random() for seed in seeds] for seeds in episodes]
    assert draws == [[generator(seed).random() for seed in seeds] for seeds in shared_episodes("test", 3)]


def figures(*fitness: float, failed: int = 0) -> Score:
    return Score(len(fitness), float(np.mean(fitness)), float(np.std(fitness)), 0.0, 0.0, failed, fitness)


@pytest.mark.parametrize(
    ("champion", "standing", "first", "verdict"),
    [
        ((100.0, 110.0, 95.0), (0.0, 1.0, -1.0), (5.0, 6.0, 7.0), "Learned:"),
        ((4.0, 5.0, 6.0), (0.0, 0.0, 0.0), (5.0, 5.0, 5.0), "Nothing clearly learned:"),
        ((4.0, 5.0, 6.0), (6.0, 7.0, 8.0), (1.0, 1.0, 1.0), "Nothing clearly learned:"),
        # Better on average by a hair, worse on one of the shared episodes by a lot.
        ((300.0, -270.0, 0.3), (0.0, 0.0, 0.0), (10.0, 10.0, 10.0), "Nothing clearly learned:"),
        ((100.0,), (0.0,), (5.0,), "Nothing clearly learned:"),
    ],
)
def test_the_verdict_needs_a_clear_difference_to_both_baselines(
    champion: tuple[float, ...], standing: tuple[float, ...], first: tuple[float, ...], verdict: str
) -> None:
    scores = [figures(*each) for each in (champion, standing, first)]
    result = Result(champion=scores[0], standing_still=scores[1], first_generation=scores[2])
    sentence = summary_sentence(AntTask(), result)
    assert sentence.startswith(f"{verdict} on {len(champion)} test episodes")
    for each in (champion, standing, first):
        assert f"{np.mean(each):.1f}" in sentence


def test_failed_episodes_of_the_champion_are_told() -> None:
    result = Result(champion=figures(5.0, -100.0, failed=1), standing_still=figures(0.0, 0.0))
    assert "1 of 2 episodes failed" in summary_sentence(AntTask(), result)
