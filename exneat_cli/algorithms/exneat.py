"""ExNEAT and NEAT: subpopulations of NEAT genomes that evolve on their own under a fitness that they share.

Sources: Zhang, "ExNEAT - Separable network through coevolution of partially-dependent sub-modules", MEng thesis,
Imperial College London, 2025, section 3.1.2; Stanley and Miikkulainen, "Evolving neural networks through augmenting
topologies", Evolutionary Computation 10(2), 2002. NEAT is the case of one module with one subpopulation.

A generation: `ask` reproduces every subpopulation by the last fitness and pairs their genomes into teams; `tell`
gives every genome of a team the team's mean over its episodes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import neat
import numpy as np

from exneat_cli.algorithms.algorithm import Algorithm, Candidate, Problem, Results, Search, State, Team, Trials
from exneat_cli.algorithms.hall_of_fame import HallOfFame
from exneat_cli.algorithms.neat.packing import columns_of, pack, unpack
from exneat_cli.algorithms.neat.settings import EvolutionSettings, neat_config
from exneat_cli.algorithms.neat.subpopulation import Subpopulation
from exneat_cli.algorithms.teams import pack_teams, unpack_teams
from exneat_cli.errors import check_choice
from exneat_cli.seeding import generator, generator_in, stream
from exneat_cli.tasks import Task
from exneat_cli.wiring import Geometry, Plan, Wiring, plan_body, refuse_modules

PAIRINGS = ("rank", "index")
"""``rank`` lets survivors meet in the order of their teams' fitness, so that the best team stays together;
``index`` pairs in neat-python's own order."""


@dataclass(frozen=True)
class ExNEAT(Algorithm):
    """Settings of ExNEAT beside those of its genomes, see `EvolutionSettings`."""

    name: str = "exneat"

    def __post_init__(self) -> None:
        check_choice("algorithm.name", self.name, ["exneat"])

    def start(self, problem: Problem) -> Search:
        """Begin with random genomes."""
        return Coevolution(problem)

    def restored(self, problem: Problem, state: State) -> Search:
        """The co-evolution that `state` was taken of."""
        return Coevolution.restored(problem, state)


@dataclass(frozen=True)
class NEAT(ExNEAT):
    """Settings of NEAT: one network senses and drives everything."""

    name: str = "neat"
    modular = False

    def __post_init__(self) -> None:
        check_choice("algorithm.name", self.name, ["neat"])

    def plan(self, task: Task, geometry: Geometry, linkage: str, wiring: Wiring, evolution: EvolutionSettings) -> Plan:
        """One module, whatever the body."""
        refuse_modules(self.name, geometry, linkage, wiring)
        return plan_body(task, hidden=evolution.neat_hidden)


class Coevolution(Search):
    """One NEAT subpopulation for each that the plan names, paired into teams.

    Args:
        problem: see there.
    """

    def __init__(self, problem: Problem) -> None:
        self._begin(problem)
        self._subpopulations = [
            Subpopulation(config, stream(problem.seed, "evolution", index))
            for index, config in enumerate(_configs(problem))
        ]

    def _begin(self, problem: Problem) -> None:
        self._problem = problem
        self._pairing_rng = generator(stream(problem.seed, "pairing"))
        self._rank: list[dict[int, int]] = [{} for _ in problem.plan.subpopulation_shapes]
        self._teams: list[Team] | None = None
        self._told: list[float] | None = None
        self._generation = 0
        self._extinctions = 0
        self._hall_of_fame = HallOfFame()

    def ask(self) -> Trials:
        """The teams of the next generation; the first call gives the first one."""
        if self._teams is not None and self._told is None:
            raise RuntimeError("ask: the last teams have no fitness yet; expected tell(results) before it")
        if self._told is not None:
            self._advance()
        orders = [self._order(index) for index in range(len(self._subpopulations))]
        self._teams = [self._team(ids) for ids in zip(*orders, strict=True)]
        return Trials(list(self._teams), self._problem.episodes)

    def tell(self, results: Results) -> bool:
        """Give every team its mean fitness; the generation is over then."""
        if self._teams is None or self._told is not None:
            raise RuntimeError("tell: no teams are waiting for a fitness; expected ask() before it")
        if len(results.fitness) != len(self._teams):
            raise ValueError(f"tell: expected {len(self._teams)} fitness values, got {len(results.fitness)}")
        fitness = results.fitness.mean(axis=1).tolist()
        for index, value in enumerate(fitness):
            if not math.isfinite(value):
                raise ValueError(f"tell: expected finite fitness values, got {value!r} for team {index}")
        sound = np.flatnonzero(~results.failed).tolist()
        for k in sound:
            self._hall_of_fame.add(Candidate(self._teams[k], fitness[k], self._generation))
        self._told = failed_last(fitness, sound)
        self._generation += 1
        return True

    def candidates(self) -> list[Candidate]:
        """Teams within a tenth of the best fitness so far."""
        return self._hall_of_fame.entries

    def columns(self) -> dict[str, int | float]:
        """Species, summed over subpopulations, and how many of these were created anew for this generation."""
        species = sum(subpopulation.species_count for subpopulation in self._subpopulations)
        return {"species": species, "extinctions": self._extinctions}

    def state(self) -> State:
        """Subpopulations, teams and hall of fame.

        Raises:
            RuntimeError: the teams that were asked for were not told their fitness.
        """
        if self._teams is None or self._told is None:
            raise RuntimeError("state: expected ask() and tell(results) before it")
        entries = self._hall_of_fame.entries
        plain = {
            "subpopulations": [subpopulation.state() for subpopulation in self._subpopulations],
            "pairing": dict(self._pairing_rng.bit_generator.state),
            "teams": [list(team.ids) for team in self._teams],
            "fitness": self._told,
            "generation": self._generation,
            "hall_of_fame": [[entry.fitness, entry.generation] for entry in entries],
        }
        arrays = pack_teams([entry.team for entry in entries], "hall_of_fame")
        for index, subpopulation in enumerate(self._subpopulations):
            columns = pack(list(subpopulation.genomes.values()))
            arrays |= {f"current.{index}.{name}": column for name, column in columns.items()}
        return State(plain, arrays)

    @classmethod
    def restored(cls, problem: Problem, state: State) -> Coevolution:
        """The co-evolution that `state` was taken of; see `Algorithm.restored`."""
        plain = state.plain
        search = cls.__new__(cls)
        search._begin(problem)
        search._subpopulations = [
            Subpopulation.restored(
                config, own, unpack(columns_of(state.arrays, f"current.{index}"), config.genome_type)
            )
            for index, (config, own) in enumerate(zip(_configs(problem), plain["subpopulations"], strict=True))
        ]
        search._pairing_rng = generator_in(plain["pairing"])
        search._teams = [search._team(tuple(int(key) for key in ids)) for ids in plain["teams"]]
        for index, subpopulation in enumerate(search._subpopulations):
            if sorted(team.ids[index] for team in search._teams) != sorted(subpopulation.genomes):
                raise ValueError("expected every genome in one team")
        search._told = [float(value) for value in plain["fitness"]]
        if len(search._told) != len(search._teams) or not all(map(math.isfinite, search._told)):
            raise ValueError("expected a finite fitness of every team")
        search._generation = int(plain["generation"])
        teams = unpack_teams(state.arrays, "hall_of_fame", problem)
        search._hall_of_fame = HallOfFame(
            [
                _candidate(team, values, search._generation)
                for team, values in zip(teams, plain["hall_of_fame"], strict=True)
            ]
        )
        return search

    def _team(self, ids: tuple[int, ...]) -> Team:
        return Team(tuple(s.in_arrays(key) for s, key in zip(self._subpopulations, ids, strict=True)), ids)

    def _advance(self) -> None:
        """Reproduce every subpopulation."""
        assert self._teams is not None
        assert self._told is not None
        ranking = best_first(self._told)
        shared = separate_ties(self._told) if len(self._subpopulations) > 1 else self._told
        self._extinctions = 0
        for index, subpopulation in enumerate(self._subpopulations):
            self._rank[index] = {self._teams[team].ids[index]: rank for rank, team in enumerate(ranking)}
            ids_to_fitness = {team.ids[index]: shared[i] for i, team in enumerate(self._teams)}
            self._extinctions += subpopulation.advance(ids_to_fitness)
        self._told = None

    def _order(self, index: int) -> list[int]:
        """Ids of a subpopulation's genomes in the order of the teams that they join."""
        ids = list(self._subpopulations[index].genomes)
        if self._problem.pairing == "index":
            return ids
        rank = self._rank[index]
        survivors = sorted((key for key in ids if key in rank), key=lambda key: rank[key])
        offspring = [key for key in ids if key not in rank]
        return survivors + [offspring[i] for i in self._pairing_rng.permutation(len(offspring))]


def _configs(problem: Problem) -> list[neat.Config]:
    """A neat-python configuration for each subpopulation: two must not share one."""
    return [neat_config(problem.evolution, problem.population, shape) for shape in problem.plan.subpopulation_shapes]


def _candidate(team: Team, values: Sequence[Any], generations: int) -> Candidate:
    fitness, generation = values
    candidate = Candidate(team, float(fitness), int(generation))
    if not math.isfinite(candidate.fitness) or not 0 <= candidate.generation < generations:
        raise ValueError(f"expected a finite fitness in one of {generations} generations, got {candidate[1:]}")
    return candidate


def failed_last(fitness: Sequence[float], sound: Sequence[int]) -> list[float]:
    """The same values, but for failed teams, which rank behind all sound ones, also behind those below the floor.

    Args:
        fitness: of every team.
        sound: indices of those that did not fail.
    """
    if not sound:
        return list(fitness)
    behind = math.nextafter(min(fitness[k] for k in sound), -math.inf)
    passed = set(sound)
    return [value if k in passed else min(value, behind) for k, value in enumerate(fitness)]


def best_first(fitness: Sequence[float]) -> list[int]:
    """Indices from the highest fitness to the lowest; of equals, the lower index comes first."""
    return sorted(range(len(fitness)), key=lambda index: -fitness[index])


def separate_ties(fitness: Sequence[float]) -> list[float]:
    """The same values, pushed down by the least amounts that make them all differ.

    Of equal values the one with the lower index stays the higher. Without this, neat-python breaks ties
    by genome id, and two subpopulations would keep the genomes of different teams.
    """
    separated = list(fitness)
    above = math.inf
    for index in best_first(fitness):
        if separated[index] >= above:
            separated[index] = math.nextafter(above, -math.inf)
        above = separated[index]
    return separated
