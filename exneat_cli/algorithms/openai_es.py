"""OpenAI's evolution strategy: the gradient of a Gaussian's mean fitness, estimated from ranks and climbed by Adam.

Source: Salimans, Ho, Chen, Sidor and Sutskever, "Evolution strategies as a scalable alternative to reinforcement
learning", 2017 (arXiv 1703.03864), algorithm 2: mirrored sampling, ranks in place of rewards, weight decay.
Adam: Kingma and Ba, "Adam: a method for stochastic optimization", ICLR 2015, algorithm 1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import SeedSequence

from exneat_cli.algorithms.algorithm import State, finite
from exneat_cli.algorithms.evolution_strategy import LEAST, MirroredOptimiser, MirroredStrategy, Optimiser
from exneat_cli.algorithms.weight_vector import Vectors
from exneat_cli.errors import check_real
from exneat_cli.seeding import generator_in

BETA_1, BETA_2, EPSILON = 0.9, 0.999, 1e-8
"""Adam's constants (Kingma and Ba, 2015)."""


class RankedGradient(MirroredOptimiser):
    """The update of `OpenAIES`; takes the same arguments."""

    def __init__(
        self, start: Vectors, population: int, seed: SeedSequence, step_size: float, noise: float, weight_decay: float
    ) -> None:
        super().__init__(start, population, seed, noise)
        self._step_size, self._weight_decay = step_size, weight_decay
        self._updates = 0
        self._first, self._second = np.zeros((2, len(start)))  # Adam's moments of the gradient

    def tell(self, fitness: Vectors) -> None:
        """Follow the gradient of the ranks, with weight decay."""
        # 1. Gradient: directions weighted by ranks, summed direction by direction, in the same order on every machine.
        ranks = centred_ranks(fitness)
        gain = (ranks[: self._count] - ranks[self._count :])[:, np.newaxis]
        gradient = (gain * self._directions).sum(axis=0) / (2 * self._count * self._noise)
        gradient -= self._weight_decay * self.centre
        # 2. Adam.
        self._updates += 1
        self._first = BETA_1 * self._first + (1.0 - BETA_1) * gradient
        self._second = BETA_2 * self._second + (1.0 - BETA_2) * gradient**2
        first = self._first / (1.0 - BETA_1**self._updates)
        second = self._second / (1.0 - BETA_2**self._updates)
        self.centre = self.centre + self._step_size * first / (np.sqrt(second) + EPSILON)

    def state(self) -> State:
        """The centre, Adam's moments, and the state of the random numbers."""
        columns = {"centre": self.centre, "first": self._first, "second": self._second}
        return {"rng": dict(self._rng.bit_generator.state), "updates": self._updates}, columns

    def restore(self, state: State) -> None:
        """Continue from a state."""
        plain, columns = state
        self._rng, self._updates = generator_in(plain["rng"]), int(plain["updates"])
        names = ("centre", "first", "second")
        self.centre, self._first, self._second = (finite(columns, name, self.centre.shape) for name in names)
        if self._updates < 0 or (self._second < 0.0).any():
            raise ValueError("expected a number of updates and squares that are at least 0")


def centred_ranks(fitness: Vectors) -> Vectors:
    """Ranks from -0.5 for the lowest to 0.5 for the highest; equal values get the mean of their ranks."""
    _, place, counts = np.unique(fitness, return_inverse=True, return_counts=True)
    ranks = np.cumsum(counts) - 0.5 * (counts + 1)
    return np.asarray(ranks[place] / (len(fitness) - 1) - 0.5)


@dataclass(frozen=True)
class OpenAIES(MirroredStrategy):
    """Settings of OpenAI's evolution strategy; the defaults are the paper's for MuJoCo.

    Attributes:
        step_size: Adam's step size, at least 1e-6.
        noise: sd of the difference between a sample's weights and the centre's, at least 1e-6.
        weight_decay: share of each weight that is subtracted from the gradient, at least 0.

    Raises:
        ConfigError: a value is out of range.
    """

    name: str = "openai_es"
    step_size: float = 0.01
    noise: float = 0.02
    weight_decay: float = 0.005

    def __post_init__(self) -> None:
        super().__post_init__()
        check_real("algorithm.step_size", self.step_size, LEAST)
        check_real("algorithm.noise", self.noise, LEAST)
        check_real("algorithm.weight_decay", self.weight_decay, 0.0)

    def optimiser(self, start: Vectors, population: int, seed: SeedSequence) -> Optimiser:
        """A gradient ascent that starts at `start`."""
        return RankedGradient(start, population, seed, self.step_size, self.noise, self.weight_decay)
