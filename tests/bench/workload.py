"""What all comparisons run: random NEAT networks on Ant, in one episode of full length for all of them."""

from __future__ import annotations

from typing import NamedTuple

import neat
import numpy as np

from exneat_cli.algorithms import ArrayGenome, EvolutionSettings, neat_config
from exneat_cli.algorithms.neat.subpopulation import Subpopulation
from exneat_cli.brains import Brains, assemble
from exneat_cli.rollouts import Executor, Noise, Runner
from exneat_cli.seeding import EpisodeSeeds, shared_episodes, stream
from exneat_cli.tasks import AntTask
from exneat_cli.wiring import plan_body
from tests.bench.measurement import VerificationError

CANDIDATES = 100
"""Genomes of the random first generation that the workload is chosen from."""
ROOT_SEED = 0

TASK = AntTask(max_steps=1000)
SETTINGS = EvolutionSettings()
PLAN = plan_body(TASK, hidden=SETTINGS.neat_hidden)


class Workload(NamedTuple):
    """Genomes whose episode lasts `TASK.max_steps` control steps.

    Attributes:
        config: neat-python's configuration of the genomes.
        genomes: that all face the same episode, as in training.
        seeds: of that episode.
    """

    config: neat.Config
    genomes: list[ArrayGenome]
    seeds: EpisodeSeeds

    def first(self, count: int) -> Workload:
        """The same with only the first `count` genomes."""
        return self._replace(genomes=self.genomes[:count])

    def one_by_one(self) -> list[Workload]:
        """The same, a genome each."""
        return [self._replace(genomes=[genome]) for genome in self.genomes]

    def brains(self) -> list[Brains]:
        """The genomes compiled."""
        return [assemble(PLAN, [[genome]], feed_forward=SETTINGS.feed_forward) for genome in self.genomes]


def open_runner(threads: int) -> Runner:
    """A runner of whole episodes: without early stopping and sensor noise."""
    return Runner(TASK, Noise(), Executor("threads", threads), training=False)


def find_workload(count: int) -> Workload:
    """The first `count` untrained genomes that do not fall.

    Raises:
        VerificationError: too few of the random genomes keep upright.
    """
    (shape,) = PLAN.subpopulation_shapes
    config = neat_config(SETTINGS, CANDIDATES, shape)
    genomes = list(Subpopulation(config, stream(ROOT_SEED, "evolution", 0)).genomes.values())
    (seeds,) = shared_episodes("test", 1)
    candidates = Workload(config, genomes, seeds)
    with open_runner(threads=1) as runner:
        outcomes = runner.run(candidates.brains(), [seeds])
    upright = np.flatnonzero((outcomes.steps[:, 0] == TASK.max_steps) & ~outcomes.failed[:, 0])
    if len(upright) < count:
        raise VerificationError(f"expected {count} of {CANDIDATES} random genomes to keep upright, got {len(upright)}")
    return candidates._replace(genomes=[genomes[k] for k in upright[:count]])
