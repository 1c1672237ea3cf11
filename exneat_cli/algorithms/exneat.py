"""ExNEAT and NEAT: subpopulations of NEAT genomes that evolve on their own under a fitness that they share.

Sources: Zhang, "ExNEAT - Separable network through coevolution of partially-dependent sub-modules", MEng thesis,
Imperial College London, 2025, section 3.1.2; Stanley and Miikkulainen, "Evolving neural networks through augmenting
topologies", Evolutionary Computation 10(2), 2002. NEAT is the case of one module with one subpopulation.

A generation: `ask` reproduces every subpopulation by the last fitness and pairs their genomes into teams; `tell`
gives every genome of a team the team's mean over its episodes. The champion is chosen from the hall of fame.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from exneat_cli.algorithms.algorithm import Algorithm, Candidate, Problem, Results, Search, State, Team
from exneat_cli.algorithms.neat.conversion import Columns, pack_teams, unpack_teams
from exneat_cli.algorithms.neat.neat_python import neat_config
from exneat_cli.algorithms.neat.settings import EvolutionSettings
from exneat_cli.algorithms.neat.subpopulation import Subpopulation
from exneat_cli.errors import check_choice
from exneat_cli.seeding import generator, generator_in, stream
from exneat_cli.tasks import Task
from exneat_cli.wiring import Geometry, Plan, Wiring, plan_body, refuse_modules

PAIRINGS = ("rank", "index")
"""``rank`` lets survivors meet in the order of their teams' fitness, so that the best team stays together;
``index`` pairs in neat-python's own order."""
MARGIN = 0.1
"""A team is in the hall of fame while its fitness is at least best - MARGIN * |best|."""
CAPACITY = 20


class Coevolution(Search):
    """One NEAT subpopulation for each that the plan names, paired into teams; begins at random or goes on from a state.

    Raises:
        ArithmeticError, AttributeError, LookupError, TypeError, ValueError: the state is none, or does not fit.
    """

    def __init__(self, problem: Problem, state: State | None = None) -> None:
        self._problem = problem
        self._pairing_rng = generator(stream(problem.seed, "pairing"))
        self._teams: list[Team] = []
        self._fitness: list[float] = []  # of the teams, as they compete; empty while they wait for it
        self._generation = self._extinctions = 0
        self._hall_of_fame: list[Candidate] = []
        shapes = problem.plan.subpopulation_shapes
        configs = [neat_config(problem.evolution, problem.population, shape) for shape in shapes]
        if state is None:
            seeds = [stream(problem.seed, "evolution", index) for index in range(len(shapes))]
            self._subpopulations = [Subpopulation(*own) for own in zip(configs, seeds, strict=True)]
        else:
            plain, arrays = state
            self._subpopulations = [
                Subpopulation.restored(config, (own, arrays), f"current.{index}")
                for index, (config, own) in enumerate(zip(configs, plain["subpopulations"], strict=True))
            ]
            self._restore(plain, arrays)

    def ask(self) -> tuple[list[Team], int]:
        """The teams of the next generation; the first call gives the first one."""
        if self._teams and not self._fitness:
            raise RuntimeError("ask: the last teams have no fitness yet; expected tell(results) before it")
        ranked = [self._teams[k].ids for k in best_first(self._fitness)]
        self._extinctions = 0
        if self._fitness:
            shared = separate_ties(self._fitness) if len(self._subpopulations) > 1 else self._fitness
            for index, subpopulation in enumerate(self._subpopulations):
                fitness = {team.ids[index]: value for team, value in zip(self._teams, shared, strict=True)}
                self._extinctions += subpopulation.advance(fitness)
        orders = [
            self._order(list(subpopulation.genomes), [ids[index] for ids in ranked])
            for index, subpopulation in enumerate(self._subpopulations)
        ]
        self._teams, self._fitness = [self._team(ids) for ids in zip(*orders, strict=True)], []
        return list(self._teams), self._problem.episodes

    def tell(self, results: Results) -> bool:
        """Give every team its mean fitness; the generation is over then."""
        if not self._teams or self._fitness:
            raise RuntimeError("tell: no teams are waiting for a fitness; expected ask() before it")
        if len(results.fitness) != len(self._teams):
            raise ValueError(f"tell: expected {len(self._teams)} fitness values, got {len(results.fitness)}")
        fitness = results.fitness.mean(axis=1).tolist()
        for index, value in enumerate(fitness):
            if not math.isfinite(value):
                raise ValueError(f"tell: expected finite fitness values, got {value!r} for team {index}")
        sound = np.flatnonzero(~results.failed).tolist()
        for k in sound:
            candidate = Candidate(self._teams[k], fitness[k], self._generation)
            self._hall_of_fame = with_candidate(self._hall_of_fame, candidate)
        self._fitness = failed_last(fitness, sound)
        self._generation += 1
        return True

    def _order(self, ids: list[int], ranked: list[int]) -> list[int]:
        """One subpopulation's `ids` as teams take them: survivors in the order of `ranked`, then offspring shuffled."""
        if self._problem.pairing == "index":
            return ids
        there, before = set(ids), set(ranked)
        offspring = [key for key in ids if key not in before]
        shuffled = [offspring[i] for i in self._pairing_rng.permutation(len(offspring))]
        return [key for key in ranked if key in there] + shuffled

    def _team(self, ids: tuple[int, ...]) -> Team:
        return Team(tuple(s.in_arrays(key) for s, key in zip(self._subpopulations, ids, strict=True)), ids)

    def candidates(self) -> list[Candidate]:
        """Teams within a tenth of the best fitness so far, see `with_candidate`."""
        return list(self._hall_of_fame)

    def columns(self) -> dict[str, int | float]:
        """Species, summed over subpopulations, and how many of these were created anew for this generation."""
        species = sum(subpopulation.species_count for subpopulation in self._subpopulations)
        return {"species": species, "extinctions": self._extinctions}

    def state(self) -> State:
        """Subpopulations, teams and hall of fame.

        Raises:
            RuntimeError: the teams that were asked for were not told their fitness.
        """
        if not self._fitness:
            raise RuntimeError("state: expected ask() and tell(results) before it")
        states = [each.state(f"current.{index}") for index, each in enumerate(self._subpopulations)]
        plain = {
            "subpopulations": [own for own, _ in states],
            "pairing": dict(self._pairing_rng.bit_generator.state),
            "teams": [list(team.ids) for team in self._teams],
            "fitness": self._fitness,
            "generation": self._generation,
            "hall_of_fame": [[entry.fitness, entry.generation] for entry in self._hall_of_fame],
        }
        arrays = pack_teams([entry.team for entry in self._hall_of_fame], "hall_of_fame")
        for _, columns in states:
            arrays |= columns
        return plain, arrays

    def _restore(self, plain: Mapping[str, Any], arrays: Columns) -> None:
        """Bring all but the subpopulations into the state that `state` gave."""
        self._pairing_rng = generator_in(plain["pairing"])
        self._teams = [self._team(tuple(int(key) for key in ids)) for ids in plain["teams"]]
        for index, subpopulation in enumerate(self._subpopulations):
            if sorted(team.ids[index] for team in self._teams) != sorted(subpopulation.genomes):
                raise ValueError("expected every genome in one team")
        self._fitness = [float(value) for value in plain["fitness"]]
        if len(self._fitness) != len(self._teams) or not all(map(math.isfinite, self._fitness)):
            raise ValueError("expected a finite fitness of every team")
        self._generation = int(plain["generation"])
        teams = unpack_teams(arrays, "hall_of_fame", self._problem)
        for team, (fitness, generation) in zip(teams, plain["hall_of_fame"], strict=True):
            if not math.isfinite(fitness) or not 0 <= generation < self._generation:
                raise ValueError(f"expected a finite fitness in a generation before now, got {fitness}, {generation}")
            self._hall_of_fame.append(Candidate(team, float(fitness), int(generation)))


@dataclass(frozen=True)
class ExNEAT(Algorithm):
    """Settings of ExNEAT beside those of its genomes, see `EvolutionSettings`."""

    name: str = "exneat"

    def __post_init__(self) -> None:
        check_choice("algorithm.name", self.name, [type(self).name])

    def start(self, problem: Problem) -> Search:
        """Begin with random genomes."""
        return Coevolution(problem)

    def restored(self, problem: Problem, state: State) -> Search:
        """The co-evolution that `state` was taken of."""
        return Coevolution(problem, state)


@dataclass(frozen=True)
class NEAT(ExNEAT):
    """Settings of NEAT: one network senses and drives everything."""

    name: str = "neat"
    modular = False

    def plan(self, task: Task, geometry: Geometry, linkage: str, wiring: Wiring, evolution: EvolutionSettings) -> Plan:
        """One module, whatever the body."""
        refuse_modules(self.name, geometry, linkage, wiring)
        return plan_body(task, hidden=evolution.neat_hidden)


def with_candidate(hall_of_fame: Sequence[Candidate], offered: Candidate) -> list[Candidate]:
    """The hall of fame after a team that did not fail was offered to it, which enters if it is good enough.

    There are at most `CAPACITY` teams close to the best fitness so far, unique by the ids of their genomes, with the
    best fitness that each ever had; the best first, of equals the earlier one first.
    """
    entries = {entry.team.ids: entry for entry in hall_of_fame}
    known = entries.get(offered.team.ids)
    if known is None or offered.fitness > known.fitness:
        entries[offered.team.ids] = offered
    ranked = sorted(entries.values(), key=lambda entry: (-entry.fitness, entry.generation))
    threshold = ranked[0].fitness - MARGIN * abs(ranked[0].fitness)
    return [entry for entry in ranked if entry.fitness >= threshold][:CAPACITY]


def failed_last(fitness: Sequence[float], sound: Sequence[int]) -> list[float]:
    """The same values, but for teams not in `sound`, which rank behind those, also behind those below the floor."""
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
