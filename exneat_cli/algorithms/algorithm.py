"""The interface of every algorithm: its settings, and a search in ask/tell form."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exneat_cli.algorithms.neat.genome import ArrayGenome
from exneat_cli.algorithms.neat.settings import EvolutionSettings
from exneat_cli.tasks import Task
from exneat_cli.wiring import Geometry, Moments, Plan, Wiring, plan_modules


class Team(NamedTuple):
    """Genomes that are evaluated together, one from each subpopulation, in order.

    `ids` are those of its genomes; a team that enters the next generation unchanged keeps them.
    """

    genomes: tuple[ArrayGenome, ...]
    ids: tuple[int, ...]


class Candidate(NamedTuple):
    """A team that may become the champion, its fitness in training and its generation, counted from 0."""

    team: Team
    fitness: float
    generation: int


class Results(NamedTuple):
    """The results of T teams in E episodes, as told to an algorithm.

    Attributes:
        fitness: (T, E); the task's failure floor for failed episodes.
        failed: (T,) whether an episode of the team failed; such a team cannot become the champion.
        sensed: moments of each subpopulation's sensor pins, (pins,), pooled over teams and the modules that share it;
            only for algorithms that ask for them, see `Algorithm.wants_moments`. Pins that read modules have a count
            of 0.
    """

    fitness: NDArray[np.float64]
    failed: NDArray[np.bool_]
    sensed: tuple[Moments, ...] = ()

    def means(self, teams: int) -> list[float]:
        """Mean fitness of each team.

        Raises:
            ValueError: the number of teams is not `teams`, or a mean is not finite.
        """
        if len(self.fitness) != teams:
            raise ValueError(f"tell: expected {teams} fitness values, got {len(self.fitness)}")
        means: list[float] = self.fitness.mean(axis=1).tolist()
        for index, value in enumerate(means):
            if not math.isfinite(value):
                raise ValueError(f"tell: expected finite fitness values, got {value!r} for team {index}")
        return means


@dataclass(frozen=True)
class Problem:
    """The problem that a search is to solve.

    Attributes:
        plan: what each module senses and drives.
        evolution: how genomes start, change and compete.
        population: teams per generation.
        episodes: episodes per team and generation.
        pairing: ``rank``, ``parents`` or ``index``: how genomes form teams.
        seed: root of all random streams.
        judging: ``last`` or ``mean``: which episodes of a surviving team count.
        champion: ``thesis`` or ``race``: which teams are candidates.
    """

    plan: Plan
    evolution: EvolutionSettings
    population: int
    episodes: int
    pairing: str
    seed: int
    judging: str = "last"
    champion: str = "thesis"


State = tuple[dict[str, Any], dict[str, NDArray[Any]]]
"""The state of a search between generations, as data: numbers, strings, lists and dicts, and arrays by name."""


def finite(columns: Mapping[str, NDArray[Any]], name: str, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """A column of finite numbers of this shape, from an untrusted file.

    Raises:
        KeyError, ValueError: there is no such column.
    """
    column = columns[name]
    if column.dtype != np.float64 or column.shape != shape or not np.isfinite(column).all():
        raise ValueError(f"{name}: expected finite numbers, {shape}, got {column.dtype} {column.shape}")
    return column


class Search(ABC):
    """A run of an algorithm. A generation takes one or more turns of `ask` and `tell`."""

    @abstractmethod
    def ask(self) -> tuple[Sequence[Team], int]:
        """The teams to evaluate next, and the number of episodes, which are the same for all of them.

        Raises:
            RuntimeError: the results of the last teams have not been told.
        """

    @abstractmethod
    def tell(self, results: Results) -> bool:
        """Take the results of the teams of the last `ask`, in its order; returns whether the generation is over.

        Raises:
            RuntimeError: no teams have been asked for.
            ValueError: the number of teams is wrong, or a fitness is not finite.
        """

    @abstractmethod
    def candidates(self) -> list[Candidate]:
        """The current candidates for the champion, the best first; none of them failed."""

    @abstractmethod
    def state(self) -> State:
        """Everything on which the rest of the search depends, after a generation; has no side effects."""

    def columns(self) -> dict[str, int | float]:
        """The algorithm's own columns of history.csv for the last generation."""
        return {}


class Algorithm(ABC):
    """An algorithm's settings, as a frozen dataclass with range checks; the base class of all algorithms.

    An algorithm that trains defines `start` and `restored`; one without training names a `rule`.
    """

    modular: bool = True
    """Whether geometry, linkage and wiring apply to it."""

    name: str
    """Its name in `conf/algorithm` and in run directories."""

    def wants_moments(self, evolution: EvolutionSettings) -> bool:
        """Whether it needs the statistics of the sensed values, `Results.sensed`."""
        return False

    @property
    def rule(self) -> str | None:
        """The rule that acts in place of trained networks, see `exneat_cli.brains.rules`; None if it trains."""
        return None

    def plan(self, task: Task, geometry: Geometry, linkage: str, wiring: Wiring, evolution: EvolutionSettings) -> Plan:
        """The plan of what each module senses and drives.

        Raises:
            ConfigError: the combination makes no sense.
        """
        return plan_modules(task, geometry, linkage, wiring, hidden=evolution.module_hidden)

    def usual_evolution(self, evolution: EvolutionSettings) -> EvolutionSettings:
        """The defaults of the settings of evolution, derived from those of the task."""
        return evolution

    def identity_of(self, evolution: EvolutionSettings) -> dict[str, Any]:
        """Those of these settings on which its results depend, and which are therefore part of a run's hash."""
        return asdict(evolution)

    def check(self, problem: Problem) -> None:  # noqa: B027  # most accept any problem
        """Refuse a problem that it cannot solve; called before anything is written.

        Raises:
            ConfigError: a setting makes no sense for this algorithm.
        """

    def start(self, problem: Problem) -> Search:
        """Start a search."""
        raise TypeError(f"{self.name} trains nothing")

    def restored(self, problem: Problem, state: State) -> Search:
        """The search for this `problem` in `state`, which comes from `Search.state` or from an untrusted file.

        Raises:
            ArithmeticError, AttributeError, LookupError, TypeError, ValueError: the state is invalid or does not fit.
        """
        raise TypeError(f"{self.name} trains nothing")
