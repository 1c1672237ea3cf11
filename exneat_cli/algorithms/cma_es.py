"""CMA-ES: samples a normal distribution whose mean, step size and covariance follow the best samples.

Sources: Hansen, "The CMA evolution strategy: a tutorial", 2016 (arXiv 1604.00772); for the separable kind, whose
covariance is diagonal and whose cost is linear in the number of weights, Ros and Hansen, "A simple modification in
CMA-ES achieving linear time and space complexity", PPSN 2008. The updates are those of the library cmaes (Nomura and
Shibata, "cmaes: a simple yet practical Python library for CMA-ES", arXiv 2402.01373): both kinds need only NumPy.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.random import SeedSequence

from exneat_cli.algorithms.algorithm import Problem, State, finite
from exneat_cli.algorithms.evolution_strategy import LEAST, EvolutionStrategy, Optimiser
from exneat_cli.algorithms.weight_vector import Layout, Vectors
from exneat_cli.errors import ConfigError, check_choice, check_real

LARGEST_FULL = 300
"""Number of weights above which a full covariance matrix costs more than the episodes."""
LEAST_POPULATION = 4
_KINDS = ("full", "separable")


class CovarianceAdaptation(Optimiser):
    """The library's update; takes the arguments of `CMAES`.

    The library's state is internal: a resumed search starts from the same seed and is told all earlier fitness again.
    """

    def __init__(self, start: Vectors, population: int, seed: SeedSequence, sigma: float, *, full: bool) -> None:
        from cmaes import CMA, SepCMA  # takes a second, which should only cost those who use it

        kind: Any = CMA if full else SepCMA
        number = int(seed.generate_state(1)[0])
        self._library = kind(mean=start.copy(), sigma=float(sigma), population_size=population, seed=number)
        self._told: list[Vectors] = []

    @property
    def centre(self) -> Vectors:  # type: ignore[override]
        """The mean of the distribution."""
        return np.array(self._library.mean)

    def ask(self) -> Vectors:
        """Samples drawn by the library, (population, n)."""
        self._samples = np.array([self._library.ask() for _ in range(self._library.population_size)])
        return self._samples

    def tell(self, fitness: Vectors) -> None:
        """Pass the fitness to the library, which minimises, with its sign reversed."""
        self._told.append(fitness)
        self._library.tell(list(zip(self._samples, (-fitness).tolist(), strict=True)))

    def state(self) -> State:
        """All fitness values so far."""
        return {"updates": len(self._told)}, {"told": np.array(self._told)}

    def restore(self, state: State) -> None:
        """Repeat all updates."""
        plain, columns = state
        for fitness in finite(columns, "told", (int(plain["updates"]), self._library.population_size)):
            self.ask()
            self.tell(fitness)


@dataclass(frozen=True)
class CMAES(EvolutionStrategy):
    """Settings of CMA-ES.

    Attributes:
        sigma: the initial step size, the sd of the difference between a sample's weights and the mean, at least 1e-6.
        covariance: ``full``, for at most 300 weights and biases, or ``separable``; None takes ``full`` if possible.

    Raises:
        ConfigError: a value is out of range.
    """

    name: str = "cma_es"
    sigma: float = 0.05
    covariance: str | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        check_real("algorithm.sigma", self.sigma, LEAST)
        if self.covariance is not None:
            check_choice("algorithm.covariance", self.covariance, _KINDS)

    def check(self, problem: Problem) -> None:
        """Also refuse populations that are too small, and full matrices that are too large."""
        super().check(problem)
        if problem.population < LEAST_POPULATION:
            raise ConfigError("population", f"at least {LEAST_POPULATION} for cma_es", problem.population)
        if self.covariance == "full" and (size := Layout(problem).size) > LARGEST_FULL:
            fix = f"these networks have {size} weights and biases: use algorithm.covariance=separable"
            raise ConfigError("algorithm.covariance", f"full for at most {LARGEST_FULL} weights", "full", fix)

    def optimiser(self, start: Vectors, population: int, seed: SeedSequence) -> Optimiser:
        """CMA-ES that starts at `start`."""
        full = len(start) <= LARGEST_FULL if self.covariance is None else self.covariance == "full"
        return CovarianceAdaptation(start, population, seed, self.sigma, full=full)
