"""The end of a run: the champion is chosen on validation episodes, and tested together with simpler agents."""

from __future__ import annotations

import numpy as np

from exneat_cli.algorithms import Team
from exneat_cli.brains import Brains, acting_by_rule, assemble, motionless
from exneat_cli.errors import ExneatError
from exneat_cli.records import (
    UNPERTURBED,
    Result,
    RobustnessRow,
    RunDirectory,
    Score,
    merge_robustness,
    write_csv,
    write_json,
)
from exneat_cli.records.champion import Champion, Genome, Scores, write_hall_of_fame
from exneat_cli.rollouts import Outcomes, Runner, Trace, is_compiled
from exneat_cli.runs.progress import Progress
from exneat_cli.runs.race import FIRST_ROUND, race
from exneat_cli.runs.settings import RunSettings
from exneat_cli.runs.training import Training
from exneat_cli.seeding import EpisodeSeeds, shared_episodes, stream
from exneat_cli.tasks import HasDistance, Task


def choose_champion(training: Training, directory: RunDirectory, progress: Progress) -> Result:
    """Validate the candidates, test the best one, and write both; returns the figures for the manifest.

    Under ``champion=thesis`` all candidates run all validation episodes (Zhang, 2025, section 3.3); else they race.

    Raises:
        ExneatError: there is no candidate.
    """
    settings, candidates = training.settings, training.search.candidates()
    if not candidates or training.first_generation is None:
        raise ExneatError("no team ever finished its episodes: every simulation or network exploded")
    last = training.history[-1]
    directory.update_manifest(budget_spent={key: last[key] for key in ("episodes", "env_steps", "wall_seconds")})
    progress.stage(f"validating {len(candidates)} teams")
    with Runner(settings.task, settings.noise, settings.executor, training=False) as runner:
        brains = [_compile(settings, candidate.team) for candidate in candidates]
        episodes = shared_episodes("validation", settings.validation_episodes)
        best, got = race(runner, brains, episodes, FIRST_ROUND if settings.champion == "race" else len(episodes))
        validation = [score for outcomes in got for score in score_all(outcomes)]
        first, tests = _compile(settings, training.first_generation), shared_episodes("test", settings.test_episodes)
        tested = score_all(runner.run([brains[best], _standing_still(settings), first], tests))
        trace = runner.trace(brains[best], tests[0])
    champion = candidates[best]
    scores = Scores(
        training={"fitness": champion.fitness, "generation": champion.generation + 1},
        validation=validation[best],
        test=tested[0],
    )
    write_hall_of_fame(directory.hall_of_fame, candidates, validation)
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
        (standing,) = score_all(
            runner.run([_standing_still(settings)], shared_episodes("test", settings.test_episodes))
        )
        trace = runner.trace(acting, episodes[0])
    _write_trace(settings, directory, trace)
    merge_robustness(directory.robustness, [robustness_row(settings, UNPERTURBED, 0.0, tested)])
    return Result(champion=tested, standing_still=standing)


def _compile(settings: RunSettings, team: Team) -> Brains:
    return assemble(settings.plan, [team.genomes], feed_forward=settings.evolution.feed_forward)


def _standing_still(settings: RunSettings) -> Brains:
    return motionless(settings.task.sensed_size, settings.task.resting_action)


def _champion(settings: RunSettings, team: Team, scores: Scores) -> Champion:
    return Champion(
        variant=settings.variant,
        task=settings.to_plain()["task"],
        sensors=settings.task.sensor_names,
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


def score_all(outcomes: Outcomes) -> list[Score]:
    """Summary of each brain's episodes."""
    return [
        Score(
            episodes=len(fitness),
            fitness_mean=float(fitness.mean()),
            fitness_std=float(fitness.std()),
            full_reward_mean=float(full_reward.mean()),
            full_reward_std=float(full_reward.std()),
            failed_episodes=int(failed.sum()),
            fitness=tuple(fitness.tolist()),
            steps_mean=float(steps.mean()),
        )
        for fitness, full_reward, steps, failed in zip(*outcomes[:4], strict=True)
    ]


def unseen_episodes(settings: RunSettings, episodes: int) -> list[EpisodeSeeds]:
    """The test episodes, the same for all runs and variants; random actions are drawn from the run's own stream."""
    tests = shared_episodes("test", episodes)
    if settings.algorithm.rule != "random":
        return tests
    return [each._replace(actions=stream(settings.seed, "random_actions", k)) for k, each in enumerate(tests)]


def robustness_row(settings: RunSettings, parameter: str, level: float, score: Score) -> RobustnessRow:
    """A run's score at one level of a sweep."""
    figures = (score.fitness_mean, score.fitness_std, score.full_reward_mean, score.full_reward_std)
    return RobustnessRow(settings.variant, settings.seed, parameter, float(level), score.episodes, *figures)


def summary_sentence(task: Task, result: Result) -> str:
    """What a run learned, in one sentence, from the `result` of its manifest; a second one if it is in plain Python.

    It says "Learned" only if the champion clearly beats both baselines and, where a task is about moving forward, moves
    forward in most episodes. Clearly: in the same test episodes, the mean difference exceeds twice its standard error.
    """
    champion, standing = result.champion, result.standing_still
    digits = task.fitness_decimals
    episodes, failed = f"on {champion.episodes} test episodes", champion.failed_episodes
    failures = f", {failed} of {champion.episodes} episodes failed" if failed else ""
    earned = (
        f"earned a {task.fitness_name} of {champion.fitness_mean:.{digits}f} on average "
        f"(sd {champion.fitness_std:.{digits}f}{failures}), "
        f"compared with {standing.fitness_mean:.{digits}f} for standing still"
    )
    first, way = result.first_generation, _way(task, champion)
    speed = "" if is_compiled(task) else f" task={task.name} runs in plain Python, which is slower than compiled tasks."
    if first is None:
        return f"No training: {episodes} the baseline {way}{earned}.{speed}"
    forward = not isinstance(task, HasDistance) or _moving_forward(champion) > champion.episodes / 2
    learned = forward and _clearly_better(champion, standing) and _clearly_better(champion, first)
    return (
        f"{'Learned' if learned else 'Nothing clearly learned'}: {episodes} the champion {way}{earned} "
        f"and {first.fitness_mean:.{digits}f} for the best team of the random first generation.{speed}"
    )


def _way(task: Task, score: Score) -> str:
    """How far it went, where the task tells, e.g. ``went 31.0 m in 50 s (0.62 m/s), forward in 20 of 20, and ``."""
    period = task.step_seconds
    if not isinstance(task, HasDistance) or score.steps_mean is None or period is None:
        return ""
    metres, seconds = task.metres_of(score.fitness_mean), score.steps_mean * period
    forward = f"forward in {_moving_forward(score)} of {score.episodes}"
    return f"went {metres:.1f} m in {seconds:.0f} s ({metres / seconds:.2f} m/s), {forward}, and "


def _moving_forward(score: Score) -> int:
    return sum(fitness > 0.0 for fitness in score.fitness)


def _clearly_better(one: Score, other: Score) -> bool:
    difference = np.array(one.fitness) - np.array(other.fitness)
    if len(difference) < 2:
        return False
    return bool(difference.mean() > 2.0 * difference.std(ddof=1) / np.sqrt(len(difference)))
