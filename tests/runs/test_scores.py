"""The sentence at the end of a run tells what happened, also when nothing did."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from exneat_cli.rollouts import Outcome
from exneat_cli.runs.scores import score, summary_sentence
from exneat_cli.tasks import AntTask


def test_a_score_counts_failures_with_their_floor() -> None:
    outcomes = [Outcome(10.0, 20.0, 5, False), Outcome(-100.0, -100.0, 2, True)]
    tested = score(outcomes)
    assert (tested.episodes, tested.failed_episodes) == (2, 1)
    assert (tested.fitness_mean, tested.fitness_std) == (-45.0, 55.0)
    assert (tested.full_reward_mean, tested.full_reward_std) == (-40.0, 60.0)


def figures(*fitness: float, failed: int = 0) -> dict[str, Any]:
    return {
        "episodes": len(fitness),
        "fitness_mean": float(np.mean(fitness)),
        "fitness_std": float(np.std(fitness)),
        "failed_episodes": failed,
        "fitness": list(fitness),
    }


@pytest.mark.parametrize(
    ("champion", "standing", "first", "verdict"),
    [
        ((100.0, 110.0, 95.0), (0.0, 1.0, -1.0), (5.0, 6.0, 7.0), "Learned:"),
        ((4.0, 5.0, 6.0), (0.0, 0.0, 0.0), (5.0, 5.0, 5.0), "Nothing learned for sure:"),
        ((4.0, 5.0, 6.0), (6.0, 7.0, 8.0), (1.0, 1.0, 1.0), "Nothing learned for sure:"),
        # Better on average by a hair, worse on one of the shared episodes by a lot.
        ((300.0, -270.0, 0.3), (0.0, 0.0, 0.0), (10.0, 10.0, 10.0), "Nothing learned for sure:"),
        ((100.0,), (0.0,), (5.0,), "Nothing learned for sure:"),
    ],
)
def test_the_verdict_needs_a_clear_difference_to_both_baselines(
    champion: tuple[float, ...], standing: tuple[float, ...], first: tuple[float, ...], verdict: str
) -> None:
    result = {
        "champion": figures(*champion),
        "standing_still": figures(*standing),
        "first_generation": figures(*first),
    }
    sentence = summary_sentence(AntTask(), result)
    assert sentence.startswith(f"{verdict} on {len(champion)} test episodes")
    for each in (champion, standing, first):
        assert f"{np.mean(each):.1f}" in sentence


def test_failed_episodes_of_the_champion_are_told() -> None:
    result = {"champion": figures(5.0, -100.0, failed=1), "standing_still": figures(0.0, 0.0)}
    assert "1 of 2 episodes failed" in summary_sentence(AntTask(), result)
