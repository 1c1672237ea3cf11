"""What a run hands over at its end: the champion, chosen on validation episodes and measured on test episodes."""

from __future__ import annotations

import numpy as np

from exneat_cli.algorithms import Team
from exneat_cli.brains import Brains, acting_by_rule, assemble, motionless
from exneat_cli.errors import ExneatError
from exneat_cli.records import (
    UNPERTURBED,
    Champion,
    Genome,
    Result,
    RunDirectory,
    Scores,
    merge_robustness,
    write_csv,
    write_hall_of_fame,
    write_json,
)
from exneat_cli.rollouts import Runner, Trace
from exneat_cli.runs.progress import Progress
from exneat_cli.runs.scores import robustness_row, score_all, score_brains, unseen_episodes
from exneat_cli.runs.settings import RunSettings
from exneat_cli.runs.training import Training
from exneat_cli.seeding import shared_episodes


def choose_champion(training: Training, directory: RunDirectory, progress: Progress) -> Result:
    """Validate the candidates, test the best, write both; returns the figures for the manifest.

    Source of the rule: Zhang (2025), section 3.3.

    Raises:
        ExneatError: there is no candidate.
    """
    settings, candidates = training.settings, training.search.candidates()
    if not candidates or training.first_generation is None:
        raise ExneatError("no team ever finished its episodes: every simulation or network exploded")
    last = training.history[-1]
    directory.update_manifest(budget_spent={key: last[key] for key in ("episodes", "env_steps", "wall_seconds")})
    progress.say(f"validating {len(candidates)} teams of the hall of fame")
    with Runner(settings.task, settings.noise, settings.executor, training=False) as runner:
        brains = [_compile(settings, candidate.team) for candidate in candidates]
        validation = score_brains(runner, brains, "validation", settings.validation_episodes)
        best = max(range(len(candidates)), key=lambda k: validation[k].fitness_mean)
        first = _compile(settings, training.first_generation)
        tested = score_brains(runner, [brains[best], _standing_still(settings), first], "test", settings.test_episodes)
        trace = runner.trace(brains[best], shared_episodes("test", 1)[0])
    champion = candidates[best]
    scores = Scores(
        training={"fitness": champion.fitness, "generation": champion.generation + 1},
        validation=validation[best],
        test=tested[0],
    )
    write_hall_of_fame(directory.hall_of_fame, candidates, [each.fitness_mean for each in validation])
    write_json(directory.champion, _champion(settings, champion.team, scores))
    _write_trace(settings, directory, trace)
    return Result(
        training=last["best_so_far"],
        validation=validation[best].fitness_mean,
        champion=tested[0],
        standing_still=tested[1],
        first_generation=tested[2],
    )


def measure_baseline(settings: RunSettings, directory: RunDirectory) -> Result:
    """Test an agent that follows a rule; returns the figures for the manifest."""
    assert settings.algorithm.rule is not None
    acting = acting_by_rule(settings.algorithm.rule, settings.task)
    episodes = unseen_episodes(settings, settings.test_episodes)
    with Runner(settings.task, settings.noise, settings.executor, training=False) as runner:
        (tested,) = score_all(runner.run(acting, episodes))
        (standing,) = score_brains(runner, [_standing_still(settings)], "test", settings.test_episodes)
        trace = runner.trace(acting, episodes[0])
    _write_trace(settings, directory, trace)
    merge_robustness(directory.robustness, [robustness_row(settings, UNPERTURBED, 0.0, tested)])
    return Result(champion=tested, standing_still=standing)


def _compile(settings: RunSettings, team: Team) -> Brains:
    return assemble(settings.plan, team.genomes, feed_forward=settings.evolution.feed_forward)


def _standing_still(settings: RunSettings) -> Brains:
    return motionless(settings.task.sensed_size, settings.task.resting_action)


def _champion(settings: RunSettings, team: Team, scores: Scores) -> Champion:
    return Champion(
        variant=settings.variant,
        task=settings.to_plain()["task"],
        actuators=settings.task.actuator_names,
        feed_forward=settings.evolution.feed_forward,
        plan=settings.plan,
        genomes=tuple(map(Genome.of, team.genomes)),
        scores=scores,
    )


def _write_trace(settings: RunSettings, directory: RunDirectory, trace: Trace) -> None:
    columns, (steps, tiles) = ("step", *settings.task.trace_columns, *settings.task.terms), trace
    write_csv(directory.trace, columns, [(step, *row) for step, row in enumerate(steps.tolist())])
    if tiles is not None:
        rows = [(*place, *tiles[place].tolist()) for place in np.ndindex(tiles.shape[:2])]
        write_csv(directory.tiles, ("row", "column", "path", "channel_1", "channel_2"), rows)
