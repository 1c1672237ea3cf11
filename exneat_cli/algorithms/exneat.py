"""Co-evolution of subpopulations that share one fitness, in ask/tell form.

Source: Zhang (2025), section 3.1.2. The ask/tell shape lets the caller evaluate teams as it likes; a
`tell` without an `ask` is refused, so no fitness can reach the wrong generation.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import neat
from numpy.random import SeedSequence

from exneat_cli.algorithms.neat.genome import ArrayGenome
from exneat_cli.algorithms.neat.packing import Columns, pack, unpack
from exneat_cli.algorithms.neat.subpopulation import Subpopulation
from exneat_cli.seeding import generator, generator_in

PAIRINGS = ("rank", "index")


class Snapshot(NamedTuple):
    """A co-evolution between two generations.

    Attributes:
        plain: numbers, strings, lists and dicts.
        genomes: of each subpopulation, packed.
    """

    plain: dict[str, Any]
    genomes: list[Columns]


class Team(NamedTuple):
    """One genome from each subpopulation, evaluated together.

    Attributes:
        genomes: in the order of the subpopulations.
        ids: their ids; a team that meets the next generation intact keeps them.
    """

    genomes: tuple[ArrayGenome, ...]
    ids: tuple[int, ...]


class Coevolution:
    """Subpopulations that evolve on their own under a fitness that they share.

    Args:
        configs: one neat-python configuration per subpopulation, all of the same population size.
        seeds: one per subpopulation.
        pairing_seed: of the shuffle that pairs offspring.
        pairing: ``rank`` lets survivors meet in the order of their teams' fitness, so the best team stays
            together; ``index`` pairs in neat-python's own order.
    """

    def __init__(
        self,
        configs: Sequence[neat.Config],
        seeds: Sequence[SeedSequence],
        pairing_seed: SeedSequence,
        pairing: str = "rank",
    ) -> None:
        self._subpopulations = [Subpopulation(c, seed) for c, seed in zip(configs, seeds, strict=True)]
        self._pairing = pairing
        self._pairing_rng = generator(pairing_seed)
        self._rank: list[dict[int, int]] = [{} for _ in configs]
        self._teams: list[Team] | None = None
        self._told: list[float] | None = None
        self.extinctions = 0

    def snapshot(self) -> Snapshot:
        """All that the next generation depends on; taking it changes nothing.

        Raises:
            RuntimeError: the teams that were asked for were not told their fitness.
        """
        if self._teams is None or self._told is None:
            raise RuntimeError("snapshot: expected ask() and tell(fitness) before it")
        plain = {
            "subpopulations": [subpopulation.state() for subpopulation in self._subpopulations],
            "pairing": dict(self._pairing_rng.bit_generator.state),
            "teams": [list(team.ids) for team in self._teams],
            "fitness": self._told,
        }
        return Snapshot(plain, [pack(list(each.genomes.values())) for each in self._subpopulations])

    @classmethod
    def restored(cls, configs: Sequence[neat.Config], snapshot: Snapshot, pairing: str = "rank") -> Coevolution:
        """The co-evolution that `snapshot` was taken of.

        Args:
            configs: as new, and as they were.
            snapshot: from `snapshot`, or from a file of anyone's.
            pairing: as it was.

        Raises:
            AttributeError, KeyError, OverflowError, TypeError, ValueError: it is none, or does not fit.
        """
        plain = snapshot.plain
        coevolution = cls.__new__(cls)
        coevolution._subpopulations = [
            Subpopulation.restored(config, state, unpack(columns, config.genome_type))
            for config, state, columns in zip(configs, plain["subpopulations"], snapshot.genomes, strict=True)
        ]
        coevolution._pairing = pairing
        coevolution._pairing_rng = generator_in(plain["pairing"])
        coevolution._rank = [{} for _ in configs]
        coevolution._teams = [coevolution._team(tuple(ids)) for ids in plain["teams"]]
        coevolution._told = None
        coevolution.extinctions = 0
        for index, subpopulation in enumerate(coevolution._subpopulations):
            if sorted(team.ids[index] for team in coevolution._teams) != sorted(subpopulation.genomes):
                raise ValueError("expected every genome in one team")
        coevolution.tell([float(value) for value in plain["fitness"]])
        return coevolution

    @property
    def species_count(self) -> int:
        """Species of the current generation, summed over subpopulations."""
        return sum(subpopulation.species_count for subpopulation in self._subpopulations)

    def ask(self) -> list[Team]:
        """The teams of the next generation; the first call gives the first one.

        `extinctions` then tells how many subpopulations had to be created anew for it.

        Raises:
            RuntimeError: the teams that were asked for before were not told their fitness.
        """
        if self._teams is not None and self._told is None:
            raise RuntimeError("ask: the last teams have no fitness yet; expected tell(fitness) before it")
        if self._told is not None:
            self._advance()
        orders = [self._order(index) for index in range(len(self._subpopulations))]
        self._teams = [self._team(ids) for ids in zip(*orders, strict=True)]
        return list(self._teams)

    def _team(self, ids: tuple[int, ...]) -> Team:
        return Team(tuple(s.in_arrays(key) for s, key in zip(self._subpopulations, ids, strict=True)), ids)

    def tell(self, fitness: Sequence[float]) -> None:
        """Give every team of the last `ask` its fitness, in the same order.

        Raises:
            RuntimeError: there was no `ask` before.
            ValueError: the number of values is wrong, or one is not finite.
        """
        if self._teams is None or self._told is not None:
            raise RuntimeError("tell: no teams are waiting for a fitness; expected ask() before it")
        if len(fitness) != len(self._teams):
            raise ValueError(f"tell: expected {len(self._teams)} fitness values, got {len(fitness)}")
        for index, value in enumerate(fitness):
            if not math.isfinite(value):
                raise ValueError(f"tell: expected finite fitness values, got {value!r} for team {index}")
        self._told = list(fitness)

    def _advance(self) -> None:
        assert self._teams is not None
        assert self._told is not None
        ranking = best_first(self._told)
        shared = separate_ties(self._told) if len(self._subpopulations) > 1 else self._told
        self.extinctions = 0
        for index, subpopulation in enumerate(self._subpopulations):
            self._rank[index] = {self._teams[team].ids[index]: rank for rank, team in enumerate(ranking)}
            ids_to_fitness = {team.ids[index]: shared[i] for i, team in enumerate(self._teams)}
            self.extinctions += subpopulation.advance(ids_to_fitness)
        self._told = None

    def _order(self, index: int) -> list[int]:
        ids = list(self._subpopulations[index].genomes)
        if self._pairing == "index":
            return ids
        rank = self._rank[index]
        survivors = sorted((key for key in ids if key in rank), key=lambda key: rank[key])
        offspring = [key for key in ids if key not in rank]
        return survivors + [offspring[i] for i in self._pairing_rng.permutation(len(offspring))]


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
