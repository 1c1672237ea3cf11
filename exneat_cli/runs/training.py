"""The training loop: ask, compile, run, tell, record."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from exneat_cli.algorithms import Coevolution, Entry, HallOfFame, Team, check_genome, neat_config
from exneat_cli.brains import assemble_all
from exneat_cli.errors import ExneatError
from exneat_cli.records import Checkpoint, HistoryRow
from exneat_cli.rollouts import Outcomes, Runner
from exneat_cli.runs.saved_training import SavedTraining
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


def evolve(
    settings: RunSettings,
    runner: Runner,
    report: Callable[[list[HistoryRow]], None],
    *,
    checkpoints: Iterable[Checkpoint | str] = (),
    say: Callable[[str], None] = lambda _: None,
    save: Callable[[Checkpoint], None] | None = None,
) -> Trained:
    """Train one variant.

    Args:
        settings: of the run.
        runner: runs training episodes.
        report: called with all rows so far after each generation.
        checkpoints: the newest first, with a line in place of each that cannot be read; training goes on from the
            first one that is sound, else from the beginning, with the same results.
        say: told what it goes on from.
        save: called with a checkpoint every `settings.checkpoint_every` generations, and after the last.

    Raises:
        ExneatError: not a single team ever finished its episodes.
    """
    training = _begin_or_go_on(settings, runner, checkpoints, say)
    while (done := len(training.history)) < settings.generations:
        training.advance()
        report(training.history)
        if save is not None and ((done + 1) % settings.checkpoint_every == 0 or done + 1 == settings.generations):
            save(training.checkpoint())
    if not training.hall_of_fame.entries:
        raise ExneatError("no team ever finished its episodes: every simulation or network exploded")
    assert training.first_generation is not None
    return Trained(training.hall_of_fame.entries, training.first_generation, training.history)


def _begin_or_go_on(
    settings: RunSettings, runner: Runner, checkpoints: Iterable[Checkpoint | str], say: Callable[[str], None]
) -> _Training:
    for checkpoint in checkpoints:
        if isinstance(checkpoint, str):
            say(checkpoint)
            continue
        try:
            training = _Training.restored(settings, runner, checkpoint)
        except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
            say(f"checkpoint of generation {checkpoint.generation}: damaged: {error!r}")
        else:
            say(f"going on after generation {checkpoint.generation}")
            return training
    return _Training(settings, runner)


def _failed_last(fitness: Sequence[float], sound: Sequence[int]) -> list[float]:
    """The fitness that evolution is told: failed teams rank behind sound ones, also behind those below the floor."""
    if not sound:
        return list(fitness)
    behind = math.nextafter(min(fitness[k] for k in sound), -math.inf)
    passed = set(sound)
    return [value if k in passed else min(value, behind) for k, value in enumerate(fitness)]


def _configs(settings: RunSettings) -> list[Any]:
    shapes = settings.plan.subpopulation_shapes
    return [neat_config(settings.evolution, settings.population, shape) for shape in shapes]


class _Training:
    """The state that a generation hands to the next."""

    def __init__(self, settings: RunSettings, runner: Runner) -> None:
        self._settings = settings
        self._runner = runner
        self._plan = settings.plan
        configs = _configs(settings)
        self._coevolution = Coevolution(
            configs,
            [stream(settings.seed, "evolution", index) for index in range(len(configs))],
            stream(settings.seed, "pairing"),
            settings.pairing,
        )
        self._began = time.perf_counter()
        self.hall_of_fame = HallOfFame()
        self.history: list[HistoryRow] = []
        self.first_generation: Team | None = None

    @classmethod
    def restored(cls, settings: RunSettings, runner: Runner, checkpoint: Checkpoint) -> _Training:
        """The training that `checkpoint` was taken of, or one that goes on just as it would have."""
        configs = _configs(settings)
        saved = SavedTraining.read(checkpoint, len(configs))
        if not 1 <= len(saved.history) == checkpoint.generation <= settings.generations:
            raise ValueError(f"expected at most {settings.generations} generations, got {len(saved.history)}")
        for team in (saved.first_generation, *(entry.team for entry in saved.hall_of_fame)):
            for genome, (inputs, _, outputs) in zip(team.genomes, settings.plan.subpopulation_shapes, strict=True):
                check_genome(genome, inputs, outputs, feed_forward=settings.evolution.feed_forward)
        training = cls.__new__(cls)
        training._settings, training._runner, training._plan = settings, runner, settings.plan
        training._coevolution = Coevolution.restored(configs, saved.coevolution, settings.pairing)
        training.hall_of_fame = HallOfFame(saved.hall_of_fame)
        training.history = saved.history
        training.first_generation = saved.first_generation
        training._began = time.perf_counter() - saved.history[-1].wall_seconds
        return training

    def checkpoint(self) -> Checkpoint:
        """What `restored` needs; taking it changes nothing."""
        assert self.first_generation is not None
        saved = SavedTraining(
            self._coevolution.snapshot(), self.hall_of_fame.entries, self.first_generation, self.history
        )
        return saved.as_checkpoint()

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
