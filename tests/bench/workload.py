"""What all comparisons run: random NEAT networks on Ant, in episodes of full length."""

from __future__ import annotations

from typing import NamedTuple

import neat

from exneat_cli.brains import assemble
from exneat_cli.evolution import EvolutionSettings, neat_config
from exneat_cli.evolution.subpopulation import Subpopulation
from exneat_cli.rollouts import Executor, Job, Noise, Runner
from exneat_cli.seeding import EpisodeSeeds, shared_episodes, stream
from exneat_cli.tasks import AntTask
from exneat_cli.wiring import Geometry, Wiring, plan_wiring
from tests.bench.measurement import VerificationError

CANDIDATES = 100
"""Genomes of the random first generation that episodes are drawn from."""
ROOT_SEED = 0

TASK = AntTask(max_steps=1000)
SETTINGS = EvolutionSettings()
PLAN = plan_wiring(TASK, "neat", Geometry(), "none", Wiring(), hidden=SETTINGS.neat_hidden)


class Episode(NamedTuple):
    """One genome in one episode."""

    genome: neat.DefaultGenome
    seeds: EpisodeSeeds


class Workload(NamedTuple):
    """Episodes that all last `TASK.max_steps` control steps.

    Attributes:
        config: neat-python's configuration of the genomes.
        episodes: each with a genome and a world of its own.
    """

    config: neat.Config
    episodes: list[Episode]

    def first(self, count: int) -> Workload:
        """The same with only the first `count` episodes."""
        return self._replace(episodes=self.episodes[:count])

    def jobs(self) -> list[Job]:
        """The episodes with their genomes compiled."""
        return [
            Job(assemble(PLAN, [genome], feed_forward=SETTINGS.feed_forward), seeds) for genome, seeds in self.episodes
        ]


def open_runner(threads: int) -> Runner:
    """A runner of whole episodes: without early stopping and sensor noise."""
    return Runner(TASK, Noise(), Executor("threads", threads), training=False)


def find_workload(count: int) -> Workload:
    """The first `count` untrained genomes that do not fall, each in a world of its own.

    Raises:
        VerificationError: too few of the random genomes keep upright, or nothing is compiled here.
    """
    (shape,) = PLAN.subpopulation_shapes
    config = neat_config(SETTINGS, CANDIDATES, shape)
    genomes = Subpopulation(config, stream(ROOT_SEED, "evolution", 0)).genomes.values()
    candidates = [Episode(*pair) for pair in zip(genomes, shared_episodes("test", CANDIDATES), strict=True)]
    upright: list[Episode] = []
    with open_runner(threads=1) as runner:
        if not runner.compiled:
            raise VerificationError("compiled code cannot call MuJoCo here, so there is nothing to measure")
        for candidate in candidates:
            (outcome,) = runner.run(Workload(config, [candidate]).jobs())
            if outcome.steps == TASK.max_steps and not outcome.failed:
                upright.append(candidate)
            if len(upright) == count:
                return Workload(config, upright)
    raise VerificationError(f"expected {count} of {CANDIDATES} random genomes to keep upright, got {len(upright)}")
