"""Whole episodes against the loop that a user of neat-python and Gymnasium would write."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import gymnasium
import neat
import numpy as np

from exneat_cli.algorithms import to_stock
from exneat_cli.rollouts import Outcomes, Runner
from exneat_cli.seeding import EpisodeSeeds, generator
from tests.bench.measurement import RATIO, Bar, Pair, Row, VerificationError, seconds_of, speed_ratios
from tests.bench.workload import Workload, open_runner

BAR = Bar(1.5, at_least=True)
TOLERANCE = 1e-6
"""Largest relative difference of the two sides' forward rewards."""


def compare_with_gymnasium(workload: Workload, repetitions: int) -> Row:
    """Environment steps per second of ours, on one thread, over those of neat-python on Gymnasium's Ant-v5.

    Both times begin with genomes of each side's own: ours has `assemble`, neat-python's has
    `FeedForwardNetwork.create`.

    Raises:
        VerificationError: the forward rewards of an episode differ.
    """
    env = gymnasium.make("Ant-v5")
    references = [
        partial(_forward_reward, env, to_stock(genome), workload.config, workload.seeds) for genome in workload.genomes
    ]
    with open_runner(threads=1) as runner:
        _check_rewards(workload, runner, references)
        pairs = [
            Pair(partial(seconds_of, partial(_run_ours, runner, single)), partial(seconds_of, reference))
            for single, reference in zip(workload.one_by_one(), references, strict=True)
        ]
        ratios = speed_ratios(pairs, repetitions)
    env.close()
    return Row("exneat / neat-python on Gymnasium's Ant-v5, NEAT 105-6-8, steps/s, 1 thread", RATIO, ratios, BAR)


def _run_ours(runner: Runner, workload: Workload) -> Outcomes:
    return runner.run(workload.brains(), [workload.seeds])


def _forward_reward(
    env: gymnasium.Env[Any, Any], genome: neat.DefaultGenome, config: neat.Config, seeds: EpisodeSeeds
) -> float:
    network = neat.nn.FeedForwardNetwork.create(genome, config)
    env.unwrapped.np_random = generator(seeds[0])
    observation, _ = env.reset()
    total, over = 0.0, False
    while not over:
        observation, _, terminated, truncated, info = env.step(np.array(network.activate(observation)))
        total += info["reward_forward"]
        over = terminated or truncated
    return total


def _check_rewards(workload: Workload, runner: Runner, references: Sequence[Callable[[], float]]) -> None:
    fitness = _run_ours(runner, workload).fitness[:, 0].tolist()
    for genome, ours, reference in zip(workload.genomes, fitness, references, strict=True):
        expected = reference()
        if not abs(ours - expected) <= TOLERANCE * abs(expected):
            raise VerificationError(f"forward reward of genome {genome.key}: {ours!r}; Gymnasium gives {expected!r}")
