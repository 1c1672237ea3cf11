"""The sentence at the end of a run tells what happened, also when nothing did."""

from __future__ import annotations

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


@pytest.mark.parametrize(
    ("champion", "standing", "first", "verdict"),
    [(100.0, 0.0, 5.0, "Learned"), (4.0, 0.0, 5.0, "Nothing learned"), (4.0, 6.0, 1.0, "Nothing learned")],
)
def test_the_verdict_compares_with_both_baselines(champion: float, standing: float, first: float, verdict: str) -> None:
    def figures(mean: float) -> dict[str, float]:
        return {"episodes": 20, "fitness_mean": mean, "fitness_std": 1.0}

    result = {
        "champion": figures(champion),
        "standing_still": figures(standing),
        "first_generation": figures(first),
    }
    sentence = summary_sentence(AntTask(), result)
    assert sentence.startswith(f"{verdict}: on 20 test episodes")
    for figure in (champion, standing, first):
        assert f"{figure:.1f}" in sentence
