"""What evolution strategies share: they move one vector, all weights and biases of a team, by the fitness of samples.

The team consists of the initial genome of each of the plan's subpopulations, so geometry, linkage, frame and central
module mean the same as for ExNEAT; its structure is fixed. An `Optimiser` holds the vector and knows nothing about
networks; this file turns its samples into teams, whose inputs `Layout` normalises.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.random import SeedSequence

from exneat_cli.algorithms.algorithm import Algorithm, Candidate, Problem, Results, Search, State, Team, finite
from exneat_cli.algorithms.candidates import RACERS
from exneat_cli.algorithms.neat.settings import EvolutionSettings
from exneat_cli.algorithms.weight_vector import Layout, Vectors, has_biases
from exneat_cli.errors import ConfigError, check_choice, check_flag
from exneat_cli.seeding import generator, stream
from exneat_cli.tasks import Task
from exneat_cli.wiring import Geometry, Moments, Plan, Wiring, plan_body, refuse_modules, with_sensed

INITIAL_SD = 0.03
"""Initial sd of weights if there are hidden nodes, which could not learn from weights of 0. Without hidden nodes,
weights start at 0, as in Mania et al. (2018)."""
LEAST = 1e-6
"""Minimum of step sizes and noise: smaller ones have no visible effect on a network."""
_STARTS = ("full_direct", "full_nodirect")


class Optimiser(ABC):
    """A search for the vector of highest fitness, in turns of `ask` and `tell`.

    Attributes:
        centre: (n,) the current vector, replaced by a new array in each update.
    """

    centre: Vectors

    @abstractmethod
    def ask(self) -> Vectors:
        """Samples around the centre, (population, n)."""

    @abstractmethod
    def tell(self, fitness: Vectors) -> None:
        """Move according to the fitness of the last samples, (population,), finite and to be maximised."""

    @abstractmethod
    def state(self) -> State:
        """Everything on which later updates depend, between `tell` and `ask`."""

    @abstractmethod
    def restore(self, state: State) -> None:
        """Bring a new optimiser with the same arguments into this state.

        Raises:
            ArithmeticError, LookupError, TypeError, ValueError: the state is invalid or does not fit.
        """


class MirroredOptimiser(Optimiser):
    """An optimiser whose samples come in pairs: a step along each of several random directions, and one against it.

    Args:
        start: (n,) the initial centre.
        population: number of samples, even.
        seed: seed of the directions.
        noise: factor of a step along a direction of standard normal numbers.
    """

    def __init__(self, start: Vectors, population: int, seed: SeedSequence, noise: float) -> None:
        self.centre = start
        self._count, self._noise, self._rng = population // 2, noise, generator(seed)

    def ask(self) -> Vectors:
        """Samples one step along each direction, then one step against each."""
        self._directions = self._rng.standard_normal((self._count, len(self.centre)))
        steps = self._noise * self._directions
        return np.concatenate([self.centre + steps, self.centre - steps])


@dataclass(frozen=True)
class EvolutionStrategy(Algorithm):
    """Settings shared by all evolution strategies.

    Attributes:
        name: its name.
        modular: whether each part has a module, as in ExNEAT; False means one module for everything, as in NEAT.
        normalise: whether inputs are normalised; None means yes if networks have biases.

    Raises:
        ConfigError: a value is out of range.
    """

    name: str = ""
    modular: bool = True
    normalise: bool | None = None

    def __post_init__(self) -> None:
        check_choice("algorithm.name", self.name, [type(self).name])
        check_flag("algorithm.modular", self.modular)
        if self.normalise is not None:
            check_flag("algorithm.normalise", self.normalise)

    def wants_moments(self, evolution: EvolutionSettings) -> bool:
        """Whether inputs may be normalised."""
        return self.normalise is not False

    def usual_evolution(self, evolution: EvolutionSettings) -> EvolutionSettings:
        """Linear networks, whose outputs are clipped to [-1, 1]."""
        start = replace(evolution, initial_connection="full_direct", neat_hidden=0, module_hidden=0)
        return replace(start, output_activation="clamped")

    def identity_of(self, evolution: EvolutionSettings) -> dict[str, Any]:
        """The settings that determine the networks; those of mutation and selection have no effect here."""
        names = ("feed_forward", "activation_default", "output_activation", "initial_connection")
        hidden = evolution.module_hidden if self.modular else evolution.neat_hidden
        return {name: getattr(evolution, name) for name in names} | {"hidden": hidden, "biases": has_biases(evolution)}

    def plan(self, task: Task, geometry: Geometry, linkage: str, wiring: Wiring, evolution: EvolutionSettings) -> Plan:
        """The plan of ExNEAT, or that of NEAT if the algorithm is not `modular`."""
        if self.modular:
            return super().plan(task, geometry, linkage, wiring, evolution)
        refuse_modules(f"{self.name} algorithm.modular=false", geometry, linkage, wiring)
        return plan_body(task, hidden=evolution.neat_hidden)

    def check(self, problem: Problem) -> None:
        """Refuse what an evolution strategy cannot do.

        Raises:
            ConfigError: networks do not start fully connected, inputs are to be normalised without biases, `pairing` is
                not ``rank``, or `judging` is not ``last``.
        """
        start = problem.evolution.initial_connection
        if start not in _STARTS:
            fix = f"algorithm={self.name} only changes weights, so all connections must exist at the start"
            raise ConfigError("evolution.initial_connection", " or ".join(_STARTS), start, fix)
        if self.normalise and not has_biases(problem.evolution):
            fix = "a network holds the mean of its inputs in its biases: set evolution.bias_init_stdev above 0"
            raise ConfigError("algorithm.normalise", "false for networks without biases", True, fix)
        if problem.pairing != "rank":
            fix = f"algorithm={self.name} has one team, so there is nothing to pair"
            raise ConfigError("pairing", "rank, its default", problem.pairing, fix)
        if problem.judging != "last":
            fix = f"algorithm={self.name} asks for new teams in every generation, which have no earlier episodes"
            raise ConfigError("judging", "last", problem.judging, fix)

    @abstractmethod
    def optimiser(self, start: Vectors, population: int, seed: SeedSequence) -> Optimiser:
        """An optimiser that starts at the vector `start`, (n,), with `population` samples per update."""

    def start(self, problem: Problem) -> Search:
        """Start a search at weights of 0, or at small ones if there are hidden nodes."""
        return StrategySearch(problem, self)

    def restored(self, problem: Problem, state: State) -> Search:
        """The search in `state`."""
        search = StrategySearch(problem, self)
        search.restore(state)
        return search


class MirroredStrategy(EvolutionStrategy):
    """An evolution strategy whose samples come in pairs, on both sides of the centre."""

    def check(self, problem: Problem) -> None:
        """Also refuse an odd population."""
        super().check(problem)
        if problem.population % 2:
            fix = f"the samples of algorithm={self.name} come in pairs, one on each side of the centre"
            raise ConfigError("population", "an even number", problem.population, fix)


class StrategySearch(Search):
    """The optimisation of a team's weights; a generation is one update.

    Candidates are the centres after updates, each with the mean fitness of the samples of its update: a mean over many
    episodes, not one lucky episode, at no extra cost. At most `RACERS` are kept, always including the latest.
    """

    def __init__(self, problem: Problem, strategy: EvolutionStrategy) -> None:
        self._problem, self._layout = problem, Layout(problem)
        self._normalises = self._layout.with_biases if strategy.normalise is None else strategy.normalise
        shapes, start = problem.plan.subpopulation_shapes, np.zeros(self._layout.size)
        if any(hidden for _, hidden, _ in shapes):
            draws = generator(stream(problem.seed, "evolution", len(shapes)))
            start = INITIAL_SD * draws.standard_normal(len(start))
        self._optimiser = strategy.optimiser(start, problem.population, stream(problem.seed, "evolution"))
        self._moments = [Moments(*np.zeros((3, pins))) for pins, _, _ in shapes]
        self._waiting = False
        self._generation = 0
        self._centres: list[tuple[float, int, Vectors]] = []  # fitness, generation, folded vector; the best first

    def ask(self) -> tuple[list[Team], int]:
        """The teams of the samples around the centre."""
        if self._waiting:
            raise RuntimeError("ask: the last teams have no fitness yet; expected tell(results) before it")
        self._waiting = True
        folded = self._layout.folded(self._optimiser.ask(), self._moments)
        first = self._generation * (self._problem.population + 1)  # the last id of a generation is its centre's
        return self._layout.teams(folded, range(first, first + len(folded))), self._problem.episodes

    def tell(self, results: Results) -> bool:
        """Update; a team that failed counts as the worst."""
        if not self._waiting:
            raise RuntimeError("tell: no teams are waiting for a fitness; expected ask() before it")
        fitness = np.array(results.means(self._problem.population))
        self._waiting = False
        self._optimiser.tell(np.where(results.failed, fitness.min(), fitness))
        if self._normalises:
            self._moments = with_sensed(self._moments, results.sensed)
        if not results.failed.all():
            (centre,) = self._layout.folded(self._optimiser.centre[np.newaxis], self._moments)
            self._remember(float(fitness[~results.failed].mean()), centre)
        self._generation += 1
        return True

    def _remember(self, fitness: float, centre: Vectors) -> None:
        latest = (fitness, self._generation, centre)
        self._centres = sorted([*self._centres, latest], key=lambda entry: (-entry[0], entry[1]))
        if len(self._centres) > RACERS:
            worst = self._centres[-1] is latest
            del self._centres[-2 if worst else -1]

    def candidates(self) -> list[Candidate]:
        """The best centres, see the class."""
        if not self._centres:
            return []
        fitness, generations, centres = zip(*self._centres, strict=True)
        ids = [(generation + 1) * (self._problem.population + 1) - 1 for generation in generations]
        teams = self._layout.teams(np.array(centres), ids)
        return [Candidate(*entry) for entry in zip(teams, fitness, generations, strict=True)]

    def state(self) -> State:
        """The optimiser, the statistics of the inputs, and the centres.

        Raises:
            RuntimeError: there is no generation yet, or the last teams have no fitness.
        """
        if self._waiting or not self._generation:
            raise RuntimeError("state: expected ask() and tell(results) before it")
        plain, arrays = self._optimiser.state()
        columns = {f"optimiser.{name}": column for name, column in arrays.items()}
        columns |= {f"moments.{index}": np.array(moments) for index, moments in enumerate(self._moments)}
        columns["centres"] = np.array([centre for _, _, centre in self._centres])
        entries = [[fitness, generation] for fitness, generation, _ in self._centres]
        return {"generation": self._generation, "optimiser": plain, "centres": entries}, columns

    def restore(self, state: State) -> None:
        """Bring a new search into this state.

        Raises:
            ArithmeticError, LookupError, TypeError, ValueError: the state is invalid or does not fit.
        """
        plain, columns = state
        self._generation = int(plain["generation"])
        own = {name.removeprefix("optimiser."): column for name, column in columns.items()}
        self._optimiser.restore((plain["optimiser"], own))
        self._moments = [
            Moments(*finite(columns, f"moments.{index}", (3, pins)))
            for index, (pins, _, _) in enumerate(self._problem.plan.subpopulation_shapes)
        ]
        entries = plain["centres"]
        centres = finite(columns, "centres", (len(entries), self._layout.folded_size)) if entries else ()
        for (fitness, generation), centre in zip(entries, centres, strict=True):
            if not np.isfinite(fitness) or not 0 <= generation < self._generation:
                raise ValueError(f"expected a finite fitness in a generation before now, got {fitness}, {generation}")
            self._centres.append((float(fitness), int(generation), centre))
