"""What every algorithm offers: its settings, and a search in ask/tell form."""

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
    """Genomes that are evaluated together, one from each subpopulation in their order.

    A team that meets the next generation intact keeps its `ids`, those of its genomes.
    """

    genomes: tuple[ArrayGenome, ...]
    ids: tuple[int, ...]


class Candidate(NamedTuple):
    """A team that may become the champion, its fitness in training and its generation, counted from 0."""

    team: Team
    fitness: float
    generation: int


class Results(NamedTuple):
    """What an algorithm is told of T teams in E episodes.

    Attributes:
        fitness: (T, E); the task's failure floor where an episode failed.
        failed: (T,) whether an episode of the team failed; such a team is nobody's best.
        sensed: of the sensor pins of each subpopulation, (pins,) and pooled over teams and modules that share
            it; only for algorithms that ask for it, see `Algorithm.wants_moments`. Pins that read modules count 0.
    """

    fitness: NDArray[np.float64]
    failed: NDArray[np.bool_]
    sensed: tuple[Moments, ...] = ()

    def means(self, teams: int) -> list[float]:
        """Mean fitness of each team.

        Raises:
            ValueError: there are not so many teams, or a mean is not finite.
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
    """What a search is about.

    Attributes:
        plan: who senses and drives what.
        evolution: how genomes begin, change and compete.
        population: teams per generation.
        episodes: of each team and generation.
        pairing: ``rank``, ``parents`` or ``index``, how subpopulations form teams.
        seed: root of all random streams.
        judging: ``last`` or ``mean``, which episodes of a team that survives count.
        champion: ``thesis`` or ``race``, which teams are candidates.
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
"""A search between two generations, as data: numbers, strings, lists and dicts, and columns of numbers by name."""


def finite(columns: Mapping[str, NDArray[Any]], name: str, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """A column of finite numbers of this shape, from a file of anyone's.

    Raises:
        KeyError, ValueError: there is none.
    """
    column = columns[name]
    if column.dtype != np.float64 or column.shape != shape or not np.isfinite(column).all():
        raise ValueError(f"{name}: expected finite numbers, {shape}, got {column.dtype} {column.shape}")
    return column


class Search(ABC):
    """An algorithm at work. A generation is one or more turns of `ask` and `tell`."""

    @abstractmethod
    def ask(self) -> tuple[Sequence[Team], int]:
        """The teams to evaluate next, and how many episodes each of them gets, the same ones for all.

        Raises:
            RuntimeError: the last ones were not told.
        """

    @abstractmethod
    def tell(self, results: Results) -> bool:
        """Take what the teams of the last `ask` got, in its order; returns whether the generation is over.

        Raises:
            RuntimeError: nothing was asked for.
            ValueError: the number of teams is wrong, or a fitness is not finite.
        """

    @abstractmethod
    def candidates(self) -> list[Candidate]:
        """Teams that it would hand over now, the best first; none of them failed."""

    @abstractmethod
    def state(self) -> State:
        """All that the rest of the search depends on, after a generation; taking it changes nothing."""

    def columns(self) -> dict[str, int | float]:
        """Its own columns of history.csv for the generation that is over."""
        return {}


class Algorithm(ABC):
    """An algorithm's settings, a frozen dataclass with range checks; the base of those that train modules.

    An algorithm that trains defines `start` and `restored`; one without training names a `rule`.
    """

    modular: bool = True
    """Whether geometry, linkage and wiring mean anything for it."""

    name: str
    """Its name in `conf/algorithm` and in run directories."""

    def wants_moments(self, evolution: EvolutionSettings) -> bool:
        """Whether it is told the statistics of what its networks sense, `Results.sensed`."""
        return False

    @property
    def rule(self) -> str | None:
        """What acts instead of trained networks, see `exneat_cli.brains.rules`; None where something is trained."""
        return None

    def plan(self, task: Task, geometry: Geometry, linkage: str, wiring: Wiring, evolution: EvolutionSettings) -> Plan:
        """Who senses and drives what.

        Raises:
            ConfigError: the combination makes no sense.
        """
        return plan_modules(task, geometry, linkage, wiring, hidden=evolution.module_hidden)

    def usual_evolution(self, evolution: EvolutionSettings) -> EvolutionSettings:
        """Settings of evolution where the user gives none, from those that suit the task."""
        return evolution

    def identity_of(self, evolution: EvolutionSettings) -> dict[str, Any]:
        """What its results depend on of these settings: what is hashed; two runs that differ elsewhere are the same."""
        return asdict(evolution)

    def check(self, problem: Problem) -> None:  # noqa: B027  # most take on any problem
        """Refuse a problem that it cannot take on; called before anything is written.

        Raises:
            ConfigError: a setting makes no sense for it.
        """

    def start(self, problem: Problem) -> Search:
        """Begin a search."""
        raise TypeError(f"{self.name} trains nothing")

    def restored(self, problem: Problem, state: State) -> Search:
        """The search of this `problem` that `state` was taken of: from `Search.state`, or from a file of anyone's.

        Raises:
            ArithmeticError, AttributeError, LookupError, TypeError, ValueError: it is none, or does not fit.
        """
        raise TypeError(f"{self.name} trains nothing")
