"""The training loop: ask, compile, run, tell, record."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from exneat_cli.brains import assemble_all
from exneat_cli.errors import ExneatError
from exneat_cli.evolution import Coevolution, Entry, HallOfFame, Team, neat_config
from exneat_cli.records import HistoryRow
from exneat_cli.rollouts import Outcomes, Runner
from exneat_cli.runs.settings import RunSettings
from exneat_cli.seeding import stream, training_episodes


@dataclass(frozen=True)
class Trained:
    """What training leaves behind.

    Attributes:
        hall_of_fame: best first; never empty.
        first_generation: the best team of the first generation, which is random.
        history: one row per generation.
    """

    hall_of_fame: list[Entry]
    first_generation: Team
    history: list[HistoryRow]


def evolve(settings: RunSettings, runner: Runner, report: Callable[[list[HistoryRow]], None]) -> Trained:
    """Train one arm.

    Args:
        settings: of the run.
        runner: runs training episodes.
        report: called with all rows so far after each generation.

    Raises:
        ExneatError: not a single team ever finished its episodes.
    """
    training = _Training(settings, runner)
    for _ in range(settings.generations):
        training.advance()
        report(training.history)
    if not training.hall_of_fame.entries:
        raise ExneatError("no team ever finished its episodes: every simulation or network exploded")
    assert training.first_generation is not None
    return Trained(training.hall_of_fame.entries, training.first_generation, training.history)


def _failed_last(fitness: Sequence[float], sound: Sequence[int]) -> list[float]:
    """The fitness that evolution is told: failed teams rank behind sound ones, also behind those below the floor."""
    if not sound:
        return list(fitness)
    behind = math.nextafter(min(fitness[k] for k in sound), -math.inf)
    passed = set(sound)
    return [value if k in passed else min(value, behind) for k, value in enumerate(fitness)]


class _Training:
    """The state that a generation hands to the next."""

    def __init__(self, settings: RunSettings, runner: Runner) -> None:
        self._settings = settings
        self._runner = runner
        self._plan = settings.plan
        shapes = self._plan.subpopulation_shapes
        self._coevolution = Coevolution(
            [neat_config(settings.evolution, settings.population, shape) for shape in shapes],
            [stream(settings.seed, "evolution", index) for index in range(len(shapes))],
            stream(settings.seed, "pairing"),
            settings.pairing,
        )
        self._began = time.perf_counter()
        self.hall_of_fame = HallOfFame()
        self.history: list[HistoryRow] = []
        self.first_generation: Team | None = None

    def advance(self) -> None:
        """Evaluate and record one generation."""
        generation = len(self.history)
        teams = self._coevolution.ask()
        outcomes = self._evaluate(teams, generation)
        failed = outcomes.failed.any(axis=1)
        means = outcomes.fitness.mean(axis=1)
        fitness = np.where(failed, self._settings.task.failure_floor, means).tolist()
        sound = np.flatnonzero(~failed).tolist()
        self._coevolution.tell(_failed_last(fitness, sound))
        for k in sound:
            self.hall_of_fame.add(teams[k], fitness[k], generation)
        best = max(sound or range(len(teams)), key=lambda k: fitness[k])
        if self.first_generation is None:
            self.first_generation = teams[best]
        self._record(teams[best], fitness, fitness[best], outcomes)

    def _evaluate(self, teams: Sequence[Team], generation: int) -> Outcomes:
        settings = self._settings
        seeds = training_episodes(settings.seed, generation, settings.episodes)
        genomes = [team.genomes for team in teams]
        brains = assemble_all(self._plan, genomes, feed_forward=settings.evolution.feed_forward)
        return self._runner.run(brains, seeds)

    def _record(self, best_team: Team, fitness: Sequence[float], best_fitness: float, outcomes: Outcomes) -> None:
        before = self.history[-1] if self.history else None
        genomes = list(zip(best_team.genomes, self._plan.subpopulation_shapes, strict=True))
        self.history.append(
            HistoryRow(
                generation=len(self.history) + 1,
                best_fitness=best_fitness,
                mean_fitness=float(np.mean(fitness)),
                median_fitness=float(np.median(fitness)),
                best_so_far=max(best_fitness, before.best_so_far) if before else best_fitness,
                episodes=outcomes.steps.size + (before.episodes if before else 0),
                env_steps=int(outcomes.steps.sum()) + (before.env_steps if before else 0),
                species=self._coevolution.species_count,
                connections=sum(genome.size()[1] for genome, _ in genomes),
                hidden_nodes=sum(genome.size()[0] - outputs for genome, (_, _, outputs) in genomes),
                failed_episodes=int(outcomes.failed.sum()),
                extinctions=self._coevolution.extinctions,
                wall_seconds=round(time.perf_counter() - self._began, 3),
            )
        )
