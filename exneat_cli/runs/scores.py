"""Validation, test, and what the champion is compared with."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from exneat_cli.brains import Brains
from exneat_cli.records import Result, RobustnessRow, Score
from exneat_cli.rollouts import Outcomes, Runner
from exneat_cli.runs.settings import RunSettings
from exneat_cli.seeding import EpisodeSeeds, shared_episodes, stream
from exneat_cli.tasks import Task


def score_all(outcomes: Outcomes) -> list[Score]:
    """Summary of each brain's episodes."""
    columns = (outcomes.fitness, outcomes.full_reward, outcomes.failed)
    return [_score(*(values[k] for values in columns)) for k in range(len(outcomes.fitness))]


def _score(fitness: NDArray[np.float64], full_reward: NDArray[np.float64], failed: NDArray[np.bool_]) -> Score:
    return Score(
        episodes=len(fitness),
        fitness_mean=float(fitness.mean()),
        fitness_std=float(fitness.std()),
        full_reward_mean=float(full_reward.mean()),
        full_reward_std=float(full_reward.std()),
        failed_episodes=int(failed.sum()),
        fitness=tuple(fitness.tolist()),
    )


def score_brains(runner: Runner, brains: Sequence[Brains], purpose: str, episodes: int) -> list[Score]:
    """Scores of several brains on the same ``"validation"`` or ``"test"`` episodes, side by side."""
    return score_all(runner.run(brains, shared_episodes(purpose, episodes)))


def unseen_episodes(settings: RunSettings, episodes: int) -> list[EpisodeSeeds]:
    """The test episodes, equal for all runs and variants; random actions are drawn from the run's own stream."""
    tests = shared_episodes("test", episodes)
    if settings.algorithm.rule != "random":
        return tests
    root = settings.seed
    return [(world, noise, stream(root, "random_actions", k)) for k, (world, noise, _) in enumerate(tests)]


def robustness_row(settings: RunSettings, parameter: str, level: float, score: Score) -> RobustnessRow:
    """A run's score at one level of a sweep."""
    figures = (score.fitness_mean, score.fitness_std, score.full_reward_mean, score.full_reward_std)
    return RobustnessRow(settings.variant, settings.seed, parameter, float(level), score.episodes, *figures)


def summary_sentence(task: Task, result: Result) -> str:
    """What a run learned, in one sentence, from the `result` entry of its manifest.

    It says "Learned" only if the champion beats both baselines clearly: on the same test episodes, the
    mean difference exceeds twice its standard error.
    """
    champion, standing = result.champion, result.standing_still
    digits = task.fitness_decimals
    episodes = f"on {champion.episodes} test episodes"
    earned = (
        f"earned a {task.fitness_name} of {champion.fitness_mean:.{digits}f} on average "
        f"(sd {champion.fitness_std:.{digits}f}{_failures(champion)}), "
        f"beside {standing.fitness_mean:.{digits}f} for standing still"
    )
    first = result.first_generation
    if first is None:
        return f"No training: {episodes} the baseline {earned}."
    learned = _clearly_better(champion, standing) and _clearly_better(champion, first)
    return (
        f"{'Learned' if learned else 'Nothing learned for sure'}: {episodes} the champion {earned} "
        f"and {first.fitness_mean:.{digits}f} for the best team of the random first generation."
    )


def _failures(score: Score) -> str:
    failed = score.failed_episodes
    return f", {failed} of {score.episodes} episodes failed" if failed else ""


def _clearly_better(one: Score, other: Score) -> bool:
    difference = np.array(one.fitness) - np.array(other.fitness)
    if len(difference) < 2:
        return False
    return bool(difference.mean() > 2.0 * difference.std(ddof=1) / np.sqrt(len(difference)))
