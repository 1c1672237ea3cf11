"""Training on Ant as a user of neat-python would write it: its population and processes, Gymnasium's Ant-v5."""

from __future__ import annotations

import functools
import math
import time
from typing import Any, NamedTuple

import gymnasium
import neat
import numpy as np
from numpy.random import SeedSequence

from exneat_cli.algorithms import neat_config
from exneat_cli.runs import RunSettings
from exneat_cli.seeding import generator, training_episodes
from exneat_cli.tasks import AntTask

TRUNK_BODY = 1


class Fitness(float):
    """Forward reward of an episode, which also tells how many steps it took."""

    steps: int = 0


def evaluate_genome(genome: neat.DefaultGenome, config: neat.Config) -> Fitness:
    """One training episode, which ends early like ours; called in neat-python's processes.

    Args:
        genome: of neat-python's own.
        config: besides neat-python's own, `config.task` and the seed of the episode's world, `config.world_seed`.
    """
    task, env = config.task, _environment()
    network = neat.nn.FeedForwardNetwork.create(genome, config)
    ant: Any = env.unwrapped
    ant.np_random = generator(config.world_seed)
    observation, _ = env.reset()
    position = ant.data.xpos[TRUNK_BODY]
    mark, stuck_steps, steps, total, over = position[0], 0, 0, 0.0, False
    while not over:
        observation, _, terminated, truncated, info = env.step(np.array(network.activate(observation)))
        total += info["reward_forward"]
        steps += 1
        stuck_steps += 1
        if position[0] >= mark + task.progress:
            mark, stuck_steps = position[0], 0
        over = terminated or truncated or 0 < task.patience <= stuck_steps or steps >= task.max_steps
    fitness = Fitness(total if math.isfinite(total) else task.failure_floor)
    fitness.steps = steps
    return fitness


@functools.cache
def _environment() -> gymnasium.Env[Any, Any]:
    """One per process."""
    return gymnasium.make("Ant-v5")


class Generation(NamedTuple):
    """What a generation took.

    Attributes:
        steps: environment steps of all genomes.
        seconds: wall seconds.
        evaluation: part of them that was spent on episodes; the rest is evolution.
    """

    steps: int
    seconds: float
    evaluation: float


class NeatTraining:
    """A training that is driven generation by generation; a context manager that ends its processes.

    Args:
        settings: of NEAT on Ant; the genomes must be neat-python's own.
        processes: that evaluate genomes.

    Attributes:
        config: neat-python's, with what `evaluate_genome` needs; at first for the first generation.
    """

    def __init__(self, settings: RunSettings, processes: int) -> None:
        assert isinstance(settings.task, AntTask)
        self._settings = settings
        self.config = self._configure()
        self._evaluator = neat.ParallelEvaluator(processes, evaluate_genome)
        self._population: neat.Population | None = None
        self._steps = 0
        self._evaluation = 0.0

    def __enter__(self) -> NeatTraining:
        return self

    def __exit__(self, *exception: object) -> None:
        self._evaluator.close()

    def warm_up(self) -> None:
        """Let the processes make their environments, before anything is timed."""
        config = self._configure()
        genomes = neat.Population(config, seed=self._settings.seed).population
        self._evaluator.evaluate(list(genomes.items())[: self._settings.population // 5], config)

    def advance(self) -> Generation:
        """One generation: episodes, reproduction, speciation; before the first, the population is made."""
        self._steps, self._evaluation = 0, 0.0
        began = time.perf_counter()
        if self._population is None:
            self._population = neat.Population(self.config, seed=self._settings.seed)
        self.config.world_seed = self._world_seed(self._population.generation)
        self._population.run(self._evaluate, 1)
        return Generation(self._steps, time.perf_counter() - began, self._evaluation)

    def _evaluate(self, genomes: list[tuple[int, neat.DefaultGenome]], config: neat.Config) -> None:
        began = time.perf_counter()
        self._evaluator.evaluate(genomes, config)
        self._evaluation += time.perf_counter() - began
        self._steps += sum(genome.fitness.steps for _, genome in genomes)

    def _configure(self) -> neat.Config:
        (shape,) = self._settings.plan.subpopulation_shapes
        config = neat_config(self._settings.evolution, self._settings.population, shape)
        config.task, config.world_seed = self._settings.task, self._world_seed(generation=0)
        return config

    def _world_seed(self, generation: int) -> SeedSequence:
        """Of the one episode that all genomes of a generation (from 0) face, the same as ours."""
        (seeds,) = training_episodes(self._settings.seed, generation, 1)
        return seeds[0]
