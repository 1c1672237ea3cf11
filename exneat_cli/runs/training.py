"""The training loop: ask, compile, run, tell, record."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exneat_cli.algorithms import Results, Search, State, Team, pack_teams, unpack_teams
from exneat_cli.brains import assemble
from exneat_cli.records import HISTORY_COLUMNS, HistoryRow
from exneat_cli.rollouts import Outcomes, Runner
from exneat_cli.runs.settings import RunSettings
from exneat_cli.seeding import training_episodes
from exneat_cli.wiring import pooled_by_pin

_FIRST = "first_generation"


@dataclass
class Training:
    """A training between two generations, with a row of history for each finished one; `advance` does the next.

    Attributes:
        first_generation: the best team of the first generation, which is random; None before it.
        began: clock time (s) at which an uninterrupted training would have begun.
    """

    settings: RunSettings
    search: Search
    history: list[HistoryRow] = field(default_factory=list)
    first_generation: Team | None = None
    began: float = field(default_factory=time.perf_counter)

    @classmethod
    def start(cls, settings: RunSettings) -> Training:
        """Begin with the first generation."""
        return cls(settings, settings.algorithm.start(settings.problem))

    @classmethod
    def resumed(cls, settings: RunSettings, checkpoints: Iterable[State | str], say: Callable[[str], None]) -> Training:
        """Continue from the first sound checkpoint, or else begin anew; the results are the same.

        The newest checkpoint comes first; in place of one that cannot be read comes a line, which is passed to `say`.
        """
        for checkpoint in checkpoints:
            if isinstance(checkpoint, str):
                say(checkpoint)
                continue
            generation = checkpoint[0]["generation"]
            try:
                training = cls._restored(settings, checkpoint)
            except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
                say(f"checkpoint of generation {generation}: damaged: {error!r}")
            else:
                say(f"continuing after generation {generation}")
                return training
        return cls.start(settings)

    @classmethod
    def _restored(cls, settings: RunSettings, checkpoint: State) -> Training:
        """The training from which `checkpoint` was taken; an error if that is damaged or of other settings."""
        problem, (plain, arrays) = settings.problem, checkpoint
        history = [_sound(number, row) for number, row in enumerate(plain["history"], start=1)]
        if not 1 <= len(history) == plain["generation"] <= settings.generations:
            raise ValueError(f"expected at most {settings.generations} generations, got {len(history)}")
        (first,) = unpack_teams(arrays, _FIRST, problem)
        search = settings.algorithm.restored(problem, (plain["search"], arrays))
        return cls(settings, search, history, first, time.perf_counter() - history[-1]["wall_seconds"])

    @property
    def is_over(self) -> bool:
        """Whether all generations are done."""
        return len(self.history) >= self.settings.generations

    def advance(self, runner: Runner) -> None:
        """Evaluate one generation, in as many turns as the algorithm requests, and record it."""
        settings, over = self.settings, False
        teams: list[Team] = []
        outcomes: list[Outcomes] = []
        while not over:
            asked, count = self.search.ask()
            genomes = [team.genomes for team in asked]
            brains = assemble(settings.plan, genomes, feed_forward=settings.evolution.feed_forward)
            done = sum(each.steps.shape[1] for each in outcomes)
            episodes = training_episodes(settings.seed, len(self.history), count, first=done)
            outcomes.append(runner.run(brains, episodes, moments=settings.wants_moments))
            teams += asked
            over = self.search.tell(_results(settings, outcomes[-1]))
        self._record(teams, outcomes)

    def _record(self, teams: Sequence[Team], outcomes: Sequence[Outcomes]) -> None:
        before = self.history[-1] if self.history else None
        fitness = [value for each in outcomes for value in each.fitness.mean(axis=1).tolist()]
        sound = np.flatnonzero(~np.concatenate([each.failed.any(axis=1) for each in outcomes])).tolist()
        best = max(sound or range(len(teams)), key=lambda k: fitness[k])
        if self.first_generation is None:
            self.first_generation = teams[best]
        shapes = self.settings.plan.subpopulation_shapes
        sizes = [genome.size() for genome in teams[best].genomes]
        self.history.append(
            {
                "generation": len(self.history) + 1,
                "best_fitness": fitness[best],
                "mean_fitness": float(np.mean(fitness)),
                "median_fitness": float(np.median(fitness)),
                "best_so_far": max(fitness[best], before["best_so_far"]) if before else fitness[best],
                "episodes": sum(each.steps.size for each in outcomes) + (before["episodes"] if before else 0),
                "env_steps": sum(int(each.steps.sum()) for each in outcomes) + (before["env_steps"] if before else 0),
                "connections": sum(connections for _, connections in sizes),
                "hidden_nodes": sum(n - outputs for (n, _), (_, _, outputs) in zip(sizes, shapes, strict=True)),
                "failed_episodes": sum(int(each.failed.sum()) for each in outcomes),
                **self.search.columns(),
                "wall_seconds": round(time.perf_counter() - self.began, 3),
            }
        )

    def checkpoint(self) -> State:
        """Everything on which the rest of the training depends; taking it changes nothing."""
        assert self.first_generation is not None
        search, arrays = self.search.state()
        plain = {"generation": len(self.history), "search": search, "history": self.history}
        return plain, {**arrays, **pack_teams([self.first_generation], _FIRST)}


def _sound(number: int, row: Mapping[str, Any]) -> HistoryRow:
    """A row of a checkpoint, checked to be that of generation `number`."""
    finite = all(isinstance(value, int | float) and math.isfinite(value) for value in row.values())
    if not finite or row["generation"] != number or not row.keys() >= set(HISTORY_COLUMNS):
        raise ValueError(f"expected the figures of generation {number}, got {row}")
    return dict(row)


def _results(settings: RunSettings, outcomes: Outcomes) -> Results:
    """What the algorithm is told; a team that failed once gets the failure floor in all of its episodes."""
    failed: NDArray[np.bool_] = np.any(outcomes.failed, axis=1)
    outcomes.fitness[failed] = settings.task.failure_floor
    sensed = () if outcomes.moments is None else pooled_by_pin(settings.plan, outcomes.moments)
    return Results(outcomes.fitness, failed, sensed)
