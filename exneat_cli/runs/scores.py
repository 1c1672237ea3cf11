"""Validation, test, and what the champion is compared with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from exneat_cli.brains import Brain, RandomActions
from exneat_cli.rollouts import Job, Outcome, Runner
from exneat_cli.seeding import shared_episodes, stream
from exneat_cli.tasks import Task


@dataclass(frozen=True)
class Score:
    """Means and standard deviations (population, over episodes) of one brain.

    Attributes:
        episodes: how many were run.
        fitness_mean, fitness_std: of the task's fitness.
        full_reward_mean, full_reward_std: of the task's second figure.
        failed_episodes: how many failed; those count with the failure floor.
    """

    episodes: int
    fitness_mean: float
    fitness_std: float
    full_reward_mean: float
    full_reward_std: float
    failed_episodes: int


def score(outcomes: Sequence[Outcome]) -> Score:
    """Summary of one brain's episodes."""
    fitness = np.array([outcome.fitness for outcome in outcomes])
    full_reward = np.array([outcome.full_reward for outcome in outcomes])
    return Score(
        episodes=len(outcomes),
        fitness_mean=float(fitness.mean()),
        fitness_std=float(fitness.std()),
        full_reward_mean=float(full_reward.mean()),
        full_reward_std=float(full_reward.std()),
        failed_episodes=sum(outcome.failed for outcome in outcomes),
    )


def score_brains(runner: Runner, brains: Sequence[Brain], purpose: str, episodes: int) -> list[Score]:
    """Scores of several brains on the same ``"validation"`` or ``"test"`` episodes, side by side."""
    seeds = shared_episodes(purpose, episodes)
    outcomes = runner.run([Job(brain, seed) for brain in brains for seed in seeds])
    return [score(outcomes[k * episodes : (k + 1) * episodes]) for k in range(len(brains))]


def random_jobs(task: Task, root: int, episodes: int) -> list[Job]:
    """The test episodes with actions drawn at random from the run's own stream."""
    brain = RandomActions(*task.action_bounds)
    return [
        Job(brain, seeds._replace(actions=stream(root, "random_actions", episode)))
        for episode, seeds in enumerate(shared_episodes("test", episodes))
    ]


def summary_sentence(task: Task, result: dict[str, Any]) -> str:
    """What a run learned, in one sentence, from the `result` entry of its manifest."""
    champion, standing = result["champion"], result["standing_still"]
    episodes = f"on {champion['episodes']} test episodes"
    if "first_generation" not in result:
        return (
            f"No training: {episodes} random actions earned a {task.fitness_name} of "
            f"{champion['fitness_mean']:.1f} on average (sd {champion['fitness_std']:.1f}), "
            f"beside {standing['fitness_mean']:.1f} for standing still."
        )
    first = result["first_generation"]
    learned = champion["fitness_mean"] > max(standing["fitness_mean"], first["fitness_mean"])
    return (
        f"{'Learned' if learned else 'Nothing learned'}: {episodes} the champion earned a {task.fitness_name} of "
        f"{champion['fitness_mean']:.1f} on average (sd {champion['fitness_std']:.1f}), beside "
        f"{standing['fitness_mean']:.1f} for standing still and {first['fitness_mean']:.1f} for the best team "
        f"of the random first generation."
    )
