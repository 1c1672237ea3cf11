"""Augmented random search, version V2-t: the sum of the best random directions, each weighted by its gain.

Source: Mania, Guy and Recht, "Simple random search of static policies is competitive for reinforcement learning",
NeurIPS 2018, algorithm 2. Input normalisation ("V2") is in `evolution_strategy`; the choice of top directions ("-t")
and the scaling by the standard deviation of the rewards are here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.random import SeedSequence

from exneat_cli.algorithms.algorithm import Problem, State, finite
from exneat_cli.algorithms.evolution_strategy import LEAST, MirroredOptimiser, MirroredStrategy, Optimiser
from exneat_cli.algorithms.weight_vector import Vectors
from exneat_cli.errors import ConfigError, check_real, check_whole
from exneat_cli.seeding import generator_in

TOP_SHARE = 0.4
"""Default share of the directions that are used: 20 of 50, which learned to walk in trials on Ant."""


class RandomSearch(MirroredOptimiser):
    """The update of `ARS`; takes the same arguments, with `top` as a number."""

    def __init__(
        self, start: Vectors, population: int, seed: SeedSequence, step_size: float, noise: float, top: int
    ) -> None:
        super().__init__(start, population, seed, noise)
        self._step_size, self._top = step_size, top

    def tell(self, fitness: Vectors) -> None:
        """Move along the top directions, each by the difference between the fitness values on both sides."""
        plus, minus = fitness[: self._count], fitness[self._count :]
        # 1. The directions with the best fitness on either side.
        top = np.argsort(-np.maximum(plus, minus), kind="stable")[: self._top]
        # 2. The sd of all their fitness values, which makes the step independent of the unit of fitness.
        sd = np.std(np.concatenate([plus[top], minus[top]]))
        # 3. The step, summed direction by direction, in the same order on every machine.
        if sd > 0.0:
            gain = (plus - minus)[top, np.newaxis]
            self.centre = self.centre + self._step_size / (self._top * sd) * (gain * self._directions[top]).sum(axis=0)

    def state(self) -> State:
        """The centre, and the state of the random numbers."""
        return {"rng": dict(self._rng.bit_generator.state)}, {"centre": self.centre}

    def restore(self, state: State) -> None:
        """Continue from a state."""
        plain, columns = state
        self._rng = generator_in(plain["rng"])
        self.centre = finite(columns, "centre", self.centre.shape)


@dataclass(frozen=True)
class ARS(MirroredStrategy):
    """Settings of augmented random search.

    Attributes:
        step_size: length of an update, at least 1e-6.
        noise: sd of the difference between a sample's weights and the centre's, at least 1e-6.
        top: number of directions in an update, at most half the population; None takes two fifths of all directions.

    Raises:
        ConfigError: a value is out of range.
    """

    name: str = "ars"
    step_size: float = 0.015
    noise: float = 0.025
    top: int | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        check_real("algorithm.step_size", self.step_size, LEAST)
        check_real("algorithm.noise", self.noise, LEAST)
        if self.top is not None:
            check_whole("algorithm.top", self.top, 1)

    def check(self, problem: Problem) -> None:
        """Also refuse more top directions than there are directions."""
        super().check(problem)
        if self.top is not None and self.top > problem.population // 2:
            directions = problem.population // 2
            fix = f"population={problem.population} makes {directions} directions"
            raise ConfigError("algorithm.top", f"at most {directions}, or null", self.top, fix)

    def optimiser(self, start: Vectors, population: int, seed: SeedSequence) -> Optimiser:
        """Random search that starts at `start`."""
        top = math.ceil(TOP_SHARE * (population // 2)) if self.top is None else self.top
        return RandomSearch(start, population, seed, self.step_size, self.noise, top)
