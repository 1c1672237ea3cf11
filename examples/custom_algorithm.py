"""A custom algorithm: a (1 + lambda) evolution strategy that changes only weights.

    python examples/custom_algorithm.py train --config-dir examples/conf task=track_maze algorithm=hill_climber

This file is the program exneat with one additional algorithm; its settings are in conf/algorithm/hill_climber.yaml.
Source: Rechenberg, "Evolutionsstrategie", 1973, without adaptation of the step size.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from exneat_cli.algorithms import (
    ALGORITHMS,
    Algorithm,
    ArrayGenome,
    Candidate,
    ExNEAT,
    Problem,
    Results,
    Search,
    State,
    Team,
    pack_teams,
    unpack_teams,
)
from exneat_cli.errors import check_choice, check_real
from exneat_cli.main import main
from exneat_cli.seeding import generator, generator_in, stream


@dataclass(frozen=True)
class HillClimber(Algorithm):
    """Settings of the hill climber.

    Attributes:
        name: always ``hill_climber``.
        sigma: sd of the change that a child makes to each weight, at least 0.

    Raises:
        ConfigError: a value is out of range.
    """

    name: str = "hill_climber"
    sigma: float = 0.1

    def __post_init__(self) -> None:
        check_choice("algorithm.name", self.name, ["hill_climber"])
        check_real("algorithm.sigma", self.sigma, 0.0)

    def start(self, problem: Problem) -> Search:
        """Begin with one of the teams with which ExNEAT begins."""
        (first, *_), _ = ExNEAT().start(dataclasses.replace(problem, population=2)).ask()
        return Climb(problem, self.sigma, first)

    def restored(self, problem: Problem, state: State) -> Search:
        """Resume from a checkpoint."""
        plain, columns = state
        (parent,) = unpack_teams(columns, "parent", problem)
        climb = Climb(problem, self.sigma, parent)
        climb.rng = generator_in(plain["rng"])
        climb.generation = int(plain["generation"])
        climb.fitness = plain["fitness"]
        return climb


class Climb(Search):
    """Searches around the best team so far, by children with changed weights.

    Args:
        problem: what to search for, see `Problem`.
        sigma: see `HillClimber`.
        parent: the first team.
    """

    def __init__(self, problem: Problem, sigma: float, parent: Team) -> None:
        self.problem, self.sigma, self.parent = problem, sigma, parent
        self.rng = generator(stream(problem.seed, "evolution"))
        self.generation = 0
        self.fitness: float | None = None

    def ask(self) -> tuple[list[Team], int]:
        """The parent, evaluated again in the episodes of this generation, and its children."""
        self.teams = [self.parent, *(self._child(k) for k in range(1, self.problem.population))]
        return self.teams, self.problem.episodes

    def tell(self, results: Results) -> bool:
        """Continue from the best team; each call ends a generation."""
        if not results.failed.all():
            fitness = np.where(results.failed, -np.inf, results.fitness.mean(axis=1))
            best = int(fitness.argmax())
            self.parent, self.fitness = self.teams[best], float(fitness[best])
        self.generation += 1
        return True

    def candidates(self) -> list[Candidate]:
        """The last parent."""
        return [] if self.fitness is None else [Candidate(self.parent, self.fitness, self.generation - 1)]

    def state(self) -> State:
        """The parent, and the state of the random numbers."""
        plain = {"rng": self.rng.bit_generator.state, "generation": self.generation, "fitness": self.fitness}
        return plain, pack_teams([self.parent], "parent")

    def _child(self, number: int) -> Team:
        key = (self.generation + 1) * self.problem.population + number
        genomes = tuple(self._changed(genome, key) for genome in self.parent.genomes)
        return Team(genomes, (key,) * len(genomes))

    def _changed(self, genome: ArrayGenome, key: int) -> ArrayGenome:
        child = ArrayGenome(key)
        child.nodes, child.connections = genome.nodes, genome.connections.copy()
        child.connections["weight"] += self.sigma * self.rng.standard_normal(len(child.connections))
        return child


ALGORITHMS["hill_climber"] = HillClimber

if __name__ == "__main__":
    raise SystemExit(main())
