"""The training loop: ask, compile, run, tell, record."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exneat_cli.algorithms import (
    Candidate,
    Problem,
    Results,
    Search,
    State,
    Team,
    pack_teams,
    unpack_teams,
)
from exneat_cli.brains import assemble_all
from exneat_cli.errors import ExneatError
from exneat_cli.records import Checkpoint, HistoryRow
from exneat_cli.rollouts import Outcomes, Runner
from exneat_cli.runs.settings import RunSettings
from exneat_cli.seeding import training_episodes
from exneat_cli.wiring import pooled_by_pin

_FIRST = "first_generation"


class Trained(NamedTuple):
    """What training leaves behind.

    Attributes:
        candidates: teams that may become the champion, best first; never empty.
        first_generation: the best team of the first generation, which is random.
        history: one row per generation.
    """

    candidates: list[Candidate]
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
    training = _begin_or_go_on(settings, checkpoints, say)
    search, history = training.search, training.history
    while len(history) < settings.generations:
        turns: list[_Turn] = []
        over = False
        while not over:
            trials = search.ask()
            genomes = [team.genomes for team in trials.teams]
            brains = assemble_all(settings.plan, genomes, feed_forward=settings.evolution.feed_forward)
            first = sum(turn.outcomes.steps.shape[1] for turn in turns)
            episodes = training_episodes(settings.seed, len(history), trials.episodes, first)
            outcomes = runner.run(brains, episodes, moments=settings.algorithm.wants_moments)
            turns.append(_Turn(trials.teams, outcomes, _results(settings, outcomes)))
            over = search.tell(turns[-1].results)
        training.record(turns)
        report(history)
        done = len(history)
        if save is not None and (done % settings.checkpoint_every == 0 or done == settings.generations):
            save(training.checkpoint())
    candidates = search.candidates()
    if not candidates:
        raise ExneatError("no team ever finished its episodes: every simulation or network exploded")
    assert training.first_generation is not None
    return Trained(candidates, training.first_generation, history)


class _Turn(NamedTuple):
    """Teams of one `ask`, what came out of their episodes, and what the algorithm was told."""

    teams: Sequence[Team]
    outcomes: Outcomes
    results: Results


@dataclass
class _Training:
    """The state that a generation hands to the next."""

    settings: RunSettings
    search: Search
    history: list[HistoryRow]
    first_generation: Team | None
    began: float

    def record(self, turns: Sequence[_Turn]) -> None:
        """Add the row of a generation that is over."""
        before = self.history[-1] if self.history else None
        teams = [team for turn in turns for team in turn.teams]
        fitness = [value for turn in turns for value in turn.results.fitness.mean(axis=1).tolist()]
        failed = [bool(value) for turn in turns for value in turn.results.failed]
        sound = [k for k, value in enumerate(failed) if not value]
        best = max(sound or range(len(teams)), key=lambda k: fitness[k])
        if self.first_generation is None:
            self.first_generation = teams[best]
        shapes = self.settings.plan.subpopulation_shapes
        sizes = [genome.size() for genome in teams[best].genomes]
        outcomes = [turn.outcomes for turn in turns]
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

    def checkpoint(self) -> Checkpoint:
        """All that the rest of the training depends on; taking it changes nothing."""
        assert self.first_generation is not None
        state = self.search.state()
        plain = {"search": state.plain, "history": self.history}
        arrays = {**state.arrays, **pack_teams([self.first_generation], _FIRST)}
        return Checkpoint(len(self.history), plain, arrays)


def _begin_or_go_on(
    settings: RunSettings, checkpoints: Iterable[Checkpoint | str], say: Callable[[str], None]
) -> _Training:
    problem = Problem(
        plan=settings.plan,
        evolution=settings.evolution,
        population=settings.population,
        episodes=settings.episodes,
        pairing=settings.pairing,
        seed=settings.seed,
    )
    for checkpoint in checkpoints:
        if isinstance(checkpoint, str):
            say(checkpoint)
            continue
        try:
            training = _restored(settings, problem, checkpoint)
        except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
            say(f"checkpoint of generation {checkpoint.generation}: damaged: {error!r}")
        else:
            say(f"going on after generation {checkpoint.generation}")
            return training
    return _Training(settings, settings.algorithm.start(problem), [], None, time.perf_counter())


def _restored(settings: RunSettings, problem: Problem, checkpoint: Checkpoint) -> _Training:
    """The training that `checkpoint` was taken of, or one that goes on just as it would have."""
    plain: Mapping[str, Any] = checkpoint.plain
    history = [_row(number, row) for number, row in enumerate(plain["history"], start=1)]
    if not 1 <= len(history) == checkpoint.generation <= settings.generations:
        raise ValueError(f"expected at most {settings.generations} generations, got {len(history)}")
    (first,) = unpack_teams(checkpoint.arrays, _FIRST, problem)
    search = settings.algorithm.restored(problem, State(plain["search"], checkpoint.arrays))
    return _Training(settings, search, history, first, time.perf_counter() - history[-1]["wall_seconds"])


def _row(number: int, row: Mapping[str, Any]) -> HistoryRow:
    sound = all(isinstance(value, int | float) and math.isfinite(value) for value in row.values())
    if not sound or row["generation"] != number:
        raise ValueError(f"expected the figures of generation {number}, got {row}")
    return dict(row)


def _results(settings: RunSettings, outcomes: Outcomes) -> Results:
    """What the algorithm is told; a team that failed once has the failure floor in all of its episodes."""
    failed: NDArray[np.bool_] = np.any(outcomes.failed, axis=1)
    outcomes.fitness[failed] = settings.task.failure_floor
    sensed = () if outcomes.moments is None else pooled_by_pin(settings.plan, outcomes.moments)
    return Results(outcomes.fitness, failed, sensed)
