"""ExNEAT and NEAT: subpopulations of NEAT genomes that evolve independently under a shared fitness.

Sources: Zhang, "ExNEAT - Separable network through coevolution of partially-dependent sub-modules", MEng thesis,
Imperial College London, 2025, section 3.1.2; Stanley and Miikkulainen, "Evolving neural networks through augmenting
topologies", Evolutionary Computation 10(2), 2002. NEAT is the case of one module and one subpopulation.

In a generation, `ask` reproduces every subpopulation based on the last fitness and pairs their genomes into teams;
`tell` gives every genome of a team the team's mean over its episodes. With ``judging=mean``, these are all episodes in
which the team was ever evaluated, and a second turn of `ask` and `tell` gives the best fifth further episodes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from exneat_cli.algorithms.algorithm import Algorithm, Candidate, Problem, Results, Search, State, Team, finite
from exneat_cli.algorithms.candidates import with_candidate, with_racers
from exneat_cli.algorithms.neat.conversion import Columns, pack_teams, unpack_teams
from exneat_cli.algorithms.neat.neat_python import neat_config
from exneat_cli.algorithms.neat.settings import EvolutionSettings
from exneat_cli.algorithms.neat.subpopulation import Subpopulation
from exneat_cli.algorithms.pairing import by_rank, with_siblings
from exneat_cli.errors import check_choice
from exneat_cli.seeding import generator, generator_in, stream
from exneat_cli.tasks import Task
from exneat_cli.wiring import Geometry, Moments, Plan, Wiring, plan_body, refuse_modules, with_sensed

JUDGINGS = ("last", "mean")
"""Whether a team competes by its mean over the episodes of this generation, or over all of its episodes so far."""
SECOND_LOOKS = 1 / 6
"""Share of a generation's budget that goes into further episodes for its best teams with ``judging=mean``: for the best
fifth of the remaining teams. Re-sampling of the teams that matter follows Flageat and Cully, "Uncertain
quality-diversity", IEEE Transactions on Evolutionary Computation, 2023."""
SURVIVORS = 0.1
"""Minimum share of the population that survives with ``judging=mean``: only survivors are judged by more episodes."""


class Record(NamedTuple):
    """The results of a team: mean fitness over its episodes, their number, and whether one of them failed."""

    mean: float = 0.0
    episodes: int = 0
    failed: bool = False

    def after(self, mean: float, episodes: int, *, failed: bool) -> Record:
        """The record after `episodes` further episodes with this mean."""
        if not self.episodes:
            return Record(mean, episodes, failed)
        total = self.episodes + episodes
        return Record(self.mean + (mean - self.mean) * episodes / total, total, self.failed or failed)


class Coevolution(Search):
    """The plan's NEAT subpopulations, paired into teams; starts at random or continues from a state.

    Raises:
        ArithmeticError, AttributeError, LookupError, TypeError, ValueError: the state is invalid or does not fit.
    """

    def __init__(self, problem: Problem, state: State | None = None) -> None:
        self._problem = problem
        self._pairing_rng = generator(stream(problem.seed, "pairing"))
        self._by_mean = problem.judging == "mean"
        self._looks = int(problem.population * SECOND_LOOKS) if self._by_mean else 0
        self._teams: list[Team] = []
        self._asked: list[int] = []  # indices of the teams that wait for a fitness
        self._records: dict[tuple[int, ...], Record] = {}  # of the teams, by their ids
        self._fitness: list[float] = []  # by which the teams compete; empty until the generation is over
        self._generation = self._extinctions = 0
        self._hall_of_fame: list[Candidate] = []
        shapes, safe = problem.plan.subpopulation_shapes, problem.evolution.safe_mutation
        self._sensed = [Moments(*np.zeros((3, pins))) for pins, _, _ in shapes] if safe else []
        teams = problem.population - self._looks
        survivors = math.ceil(SURVIVORS * teams) if self._by_mean else 0
        configs = [neat_config(problem.evolution, teams, shape, survivors) for shape in shapes]
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
        """The teams of the next generation, or those of this one that get further episodes."""
        if self._asked:
            raise RuntimeError("ask: the last teams have no fitness yet; expected tell(results) before it")
        if self._teams and not self._fitness:
            self._asked = best_first(self._judged())[: self._looks]
        else:
            self._reproduce()
            self._asked = list(range(len(self._teams)))
        return [self._teams[k] for k in self._asked], self._problem.episodes

    def _reproduce(self) -> None:
        ranked = [self._teams[k].ids for k in best_first(self._fitness)]
        self._extinctions = 0
        if self._fitness:
            shared = separate_ties(self._fitness) if len(self._subpopulations) > 1 else self._fitness
            for index, subpopulation in enumerate(self._subpopulations):
                fitness = {team.ids[index]: value for team, value in zip(self._teams, shared, strict=True)}
                self._extinctions += subpopulation.advance(fitness, self._sensed[index] if self._sensed else None)
        orders = [list(subpopulation.genomes) for subpopulation in self._subpopulations]
        if self._problem.pairing != "index":
            orders = by_rank(orders, ranked, self._pairing_rng)
        if self._problem.pairing == "parents":
            orders = with_siblings(orders, ranked, [each.first_parents for each in self._subpopulations])
        self._teams, self._fitness = [self._team(ids) for ids in zip(*orders, strict=True)], []
        known = self._records if self._by_mean else {}
        self._records = {team.ids: known.get(team.ids, Record()) for team in self._teams}

    def tell(self, results: Results) -> bool:
        """Take the results of the teams; the generation is over once the best have had their further episodes."""
        if not self._asked:
            raise RuntimeError("tell: no teams are waiting for a fitness; expected ask() before it")
        means, episodes = results.means(len(self._asked)), results.fitness.shape[1]
        for k, mean, failed in zip(self._asked, means, results.failed.tolist(), strict=True):
            ids = self._teams[k].ids
            self._records[ids] = self._records[ids].after(mean, episodes, failed=failed)
        if self._problem.evolution.safe_mutation:
            self._sensed = with_sensed(self._sensed, results.sensed)
        is_over = self._looks == 0 or len(self._asked) < len(self._teams)
        self._asked = []
        if is_over:
            self._remember()
            self._fitness = self._judged()
            self._generation += 1
        return is_over

    def _judged(self) -> list[float]:
        """The fitness by which the teams compete."""
        records = [self._records[team.ids] for team in self._teams]
        return failed_last([each.mean for each in records], [k for k, each in enumerate(records) if not each.failed])

    def _remember(self) -> None:
        """Offer the teams that did not fail as candidates."""
        offered = [
            Candidate(team, self._records[team.ids].mean, self._generation)
            for team in self._teams
            if not self._records[team.ids].failed
        ]
        if self._problem.champion == "race":
            best = [offered[k] for k in best_first([each.fitness for each in offered])]
            self._hall_of_fame = with_racers(self._hall_of_fame, best[: math.ceil(SURVIVORS * len(self._teams))])
            return
        for candidate in offered:
            self._hall_of_fame = with_candidate(self._hall_of_fame, candidate)

    def _team(self, ids: tuple[int, ...]) -> Team:
        return Team(tuple(s.in_arrays(key) for s, key in zip(self._subpopulations, ids, strict=True)), ids)

    def candidates(self) -> list[Candidate]:
        """The hall of fame, see `with_candidate` and `with_racers`."""
        return list(self._hall_of_fame)

    def columns(self) -> dict[str, int | float]:
        """Species, summed over subpopulations, and how many subpopulations were created anew for this generation.

        With ``judging=mean``, also the best judged fitness; with adaptive mutation, also the mean mutation power.
        """
        species = sum(subpopulation.species_count for subpopulation in self._subpopulations)
        columns: dict[str, int | float] = {"species": species, "extinctions": self._extinctions}
        if self._by_mean and self._fitness:
            columns["judged_fitness"] = max(self._fitness)
        powers = [genome.power for team in self._teams for genome in team.genomes if genome.power is not None]
        return columns | ({"mutate_power": float(np.mean(powers))} if powers else {})

    def state(self) -> State:
        """Subpopulations, teams and hall of fame.

        Raises:
            RuntimeError: there is no generation yet, or the last teams have no fitness.
        """
        if not self._fitness:
            raise RuntimeError("state: expected ask() and tell(results) before it")
        states = [each.state(f"current.{index}") for index, each in enumerate(self._subpopulations)]
        plain = {
            "subpopulations": [own for own, _ in states],
            "pairing": dict(self._pairing_rng.bit_generator.state),
            "teams": [list(team.ids) for team in self._teams],
            "fitness": self._fitness,
            **({"records": [list(self._records[team.ids]) for team in self._teams]} if self._by_mean else {}),
            "generation": self._generation,
            "hall_of_fame": [[entry.fitness, entry.generation] for entry in self._hall_of_fame],
        }
        arrays = pack_teams([entry.team for entry in self._hall_of_fame], "hall_of_fame")
        for _, columns in states:
            arrays |= columns
        arrays |= {f"sensed.{index}": np.array(moments) for index, moments in enumerate(self._sensed)}
        return plain, arrays

    def _restore(self, plain: Mapping[str, Any], arrays: Columns) -> None:
        """Restore everything but the subpopulations from a state."""
        self._pairing_rng = generator_in(plain["pairing"])
        self._teams = [self._team(tuple(int(key) for key in ids)) for ids in plain["teams"]]
        for index, subpopulation in enumerate(self._subpopulations):
            if sorted(team.ids[index] for team in self._teams) != sorted(subpopulation.genomes):
                raise ValueError("expected every genome in one team")
        self._fitness = [float(value) for value in plain["fitness"]]
        if len(self._fitness) != len(self._teams) or not all(map(math.isfinite, self._fitness)):
            raise ValueError("expected a finite fitness of every team")
        if self._by_mean:
            told = [Record(float(mean), int(count), bool(failed)) for mean, count, failed in plain["records"]]
            if not all(math.isfinite(each.mean) and each.episodes > 0 for each in told):
                raise ValueError("expected finite means over at least one episode of every team")
            self._records = {team.ids: each for team, each in zip(self._teams, told, strict=True)}
        if self._problem.evolution.safe_mutation:
            shapes = enumerate(self._problem.plan.subpopulation_shapes)
            self._sensed = [Moments(*finite(arrays, f"sensed.{index}", (3, pins))) for index, (pins, _, _) in shapes]
        self._generation = int(plain["generation"])
        teams = unpack_teams(arrays, "hall_of_fame", self._problem)
        for team, (fitness, generation) in zip(teams, plain["hall_of_fame"], strict=True):
            if not math.isfinite(fitness) or not 0 <= generation < self._generation:
                raise ValueError(f"expected a finite fitness in a generation before now, got {fitness}, {generation}")
            self._hall_of_fame.append(Candidate(team, float(fitness), int(generation)))


@dataclass(frozen=True)
class ExNEAT(Algorithm):
    """Settings of ExNEAT, apart from those of its genomes; see `EvolutionSettings`."""

    name: str = "exneat"

    def __post_init__(self) -> None:
        check_choice("algorithm.name", self.name, [type(self).name])

    def wants_moments(self, evolution: EvolutionSettings) -> bool:
        """Whether mutations are safe, see `EvolutionSettings`."""
        return evolution.safe_mutation

    def start(self, problem: Problem) -> Search:
        """Start with random genomes."""
        return Coevolution(problem)

    def restored(self, problem: Problem, state: State) -> Search:
        """The co-evolution in `state`."""
        return Coevolution(problem, state)


@dataclass(frozen=True)
class NEAT(ExNEAT):
    """Settings of NEAT: one network senses and drives everything."""

    name: str = "neat"
    modular = False

    def plan(self, task: Task, geometry: Geometry, linkage: str, wiring: Wiring, evolution: EvolutionSettings) -> Plan:
        """One module for the whole body."""
        refuse_modules(self.name, geometry, linkage, wiring)
        return plan_body(task, hidden=evolution.neat_hidden)


def failed_last(fitness: Sequence[float], sound: Sequence[int]) -> list[float]:
    """The same values, except that teams not in `sound` rank behind the others, even those below the failure floor."""
    if not sound:
        return list(fitness)
    behind = math.nextafter(min(fitness[k] for k in sound), -math.inf)
    passed = set(sound)
    return [value if k in passed else min(value, behind) for k, value in enumerate(fitness)]


def best_first(fitness: Sequence[float]) -> list[int]:
    """Indices from the highest fitness to the lowest; of equals, the lower index comes first."""
    return sorted(range(len(fitness)), key=lambda index: -fitness[index])


def separate_ties(fitness: Sequence[float]) -> list[float]:
    """The same values, lowered by the smallest amounts that make them all different.

    Of equal values, the one with the lower index stays higher. Without this, neat-python breaks ties
    by genome id, and two subpopulations would keep the genomes of different teams.
    """
    separated = list(fitness)
    above = math.inf
    for index in best_first(fitness):
        if separated[index] >= above:
            separated[index] = math.nextafter(above, -math.inf)
        above = separated[index]
    return separated
