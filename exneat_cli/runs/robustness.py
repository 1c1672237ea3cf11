"""Robustness of a finished run: its champion, or its baseline, under perturbations.

Source of the protocol: Zhang (2025), section 3.4; every run's champion at every level, in worlds that are
the same for all variants.
"""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence

from exneat_cli.brains import Brains, acting_by_rule
from exneat_cli.errors import ConfigError, ExneatError, check_section, check_whole
from exneat_cli.records import DONE, RunDirectory, Score, merge_robustness, read_robustness, read_yaml
from exneat_cli.records.champion import Champion, read_champion
from exneat_cli.rollouts import Executor, Runner, Sweep, keep_workers, perturbed
from exneat_cli.runs.progress import Progress
from exneat_cli.runs.scores import robustness_row, score_all, unseen_episodes
from exneat_cli.runs.settings import RunSettings
from exneat_cli.tasks import TASKS
from exneat_cli.tasks.contract import check_worlds


def load_settings(directory: RunDirectory) -> RunSettings:
    """The settings of a finished run, see `read_settings`.

    Raises:
        ExneatError: it is not finished, or as for `read_settings`.
    """
    settings = read_settings(directory)
    manifest = directory.read_manifest()
    if manifest.status != DONE:
        fix = f"finish it first: exneat resume run={directory.path}"
        raise ExneatError(f"run={directory.path}: expected a finished run, got status {manifest.status!r}\n  {fix}")
    return settings


def read_settings(directory: RunDirectory) -> RunSettings:
    """The settings of a run, from its own config.yaml.

    Raises:
        ExneatError: there is no run, it is of another format, or its configuration is damaged.
    """
    if not directory.is_there():
        raise ExneatError(f"run={directory.path}: there is no such run; exneat inspect without run= lists all runs")
    manifest = directory.read_manifest()
    try:
        plain = dict(read_yaml(directory.config))
        task = TASKS.get(str(check_section("task", plain.get("task")).get("name")))
        if task is not None:
            plain["task"] = task.found_in(plain["task"], directory.model)
        settings = RunSettings.from_plain(plain)
    except ConfigError as error:
        raise ExneatError(f"{directory.config}: {error}") from error
    if (manifest.configuration_hash, manifest.generations) != (settings.full_hash, settings.trained_generations):
        raise ExneatError(f"{directory.config}: does not describe this run: its hash differs from the manifest's")
    return settings


def is_finished(settings: RunSettings, sweeps: Sequence[Sweep], episodes: int) -> bool:
    """Whether the run of these settings is done and was tested at every level of `sweeps`."""
    directory = settings.directory
    is_trained = directory.is_finished(settings.full_hash, settings.trained_generations)
    return is_trained and not any(missing_levels(directory, sweep, episodes) for sweep in sweeps)


def missing_levels(directory: RunDirectory, sweep: Sweep, episodes: int) -> tuple[float, ...]:
    """The levels that robustness.csv does not hold yet with that many episodes."""
    there = {(row.parameter, row.level, row.episodes) for row in read_robustness(directory.robustness)}
    return tuple(level for level in sweep.levels if (sweep.name, float(level), episodes) not in there)


def check_sweeps(settings: RunSettings, sweeps: Sequence[Sweep], episodes: int) -> None:
    """Refuse what could not be run before anything is run.

    Raises:
        ConfigError: a sweep does not fit the task, a level is out of range, or there are no episodes.
    """
    check_whole("sweep.episodes", episodes, 1)
    for sweep in sweeps:
        for level in sweep.levels:
            try:
                perturbed(settings.task, settings.noise, sweep, level)
            except ConfigError as error:
                key, expected, came, fix = error.args
                if key != "sweep":
                    fix = f"level {level:g} of sweep {sweep.name} sets it; choose other levels with sweep.levels=[...]"
                raise ConfigError(key, expected, came, fix) from error


@keep_workers()
def run_robustness(
    directory: RunDirectory,
    sweeps: Sequence[Sweep],
    *,
    episodes: int,
    executor: Executor,
    progress: Progress | None = None,
) -> int:
    """Test a finished run at every level that is not in its robustness.csv yet; returns how many levels it tested.

    Each level gets `episodes` test episodes, the same ones at all levels and for all runs.

    Raises:
        ExneatError: the run is not usable, is being written by another process, or a level makes no sense.
    """
    executor.check_installed()
    load_settings(directory)  # before trying to hold a directory that does not exist
    progress, done = progress or Progress(), 0
    with directory.held(), contextlib.ExitStack() as ending:
        settings = load_settings(directory)
        check_sweeps(settings, sweeps, episodes)
        check_worlds(settings.task)
        acting = _acting(directory, settings)
        missing = {sweep: levels for sweep in sweeps if (levels := missing_levels(directory, sweep, episodes))}
        if missing:
            directory.check_writable()
            progress.start(directory.path.name, sum(map(len, missing.values())), "level")
            ending.callback(progress.stop)
        for sweep, levels in missing.items():
            seeds, scores = unseen_episodes(settings, episodes), {}
            for level in levels:
                changed = perturbed(settings.task, settings.noise, sweep, level)
                with Runner(*changed, executor, training=False) as runner:
                    (scores[level],) = score_all(runner.run(acting, seeds))
                done += 1
                progress.advance(done, f"{sweep.name} {level:g}: {scores[level].fitness_mean:.4g}")
            _write(directory, settings, sweep, scores)
    return done


def _write(directory: RunDirectory, settings: RunSettings, sweep: Sweep, scores: Mapping[float, Score]) -> None:
    rows = [robustness_row(settings, sweep.name, level, each) for level, each in scores.items()]
    # Failures are counted first: after a kill in between, the levels are tested and counted once more, not skipped.
    failed = directory.read_manifest().failed_robustness_episodes
    for row, score in zip(rows, scores.values(), strict=True):
        failed[f"{sweep.name}={row.level!r}, {row.episodes} episodes"] = score.failed_episodes
    directory.update_manifest(failed_robustness_episodes={key: count for key, count in failed.items() if count})
    merge_robustness(directory.robustness, rows)


def _acting(directory: RunDirectory, settings: RunSettings) -> Brains | None:
    if settings.algorithm.rule is not None:
        return acting_by_rule(settings.algorithm.rule, settings.task)
    return load_champion(directory, settings).brain()


def load_champion(directory: RunDirectory, settings: RunSettings) -> Champion:
    """The champion of a finished run with these settings.

    Raises:
        ExneatError: it has none, since it is a baseline, or its champion is damaged, unreadable or of another run.
    """
    if settings.algorithm.rule is not None:
        raise ExneatError(f"run={directory.path}: has no champion: {settings.variant} is a baseline without networks")
    champion = read_champion(directory.champion)
    if champion.variant != settings.variant:
        variants = f"expected a champion of {settings.variant}, got {champion.variant}"
        raise ExneatError(f"{directory.champion}: {variants}")
    if champion.plan != settings.plan or champion.feed_forward != settings.evolution.feed_forward:
        raise ExneatError(f"{directory.champion}: its wiring is not the one that config.yaml beside it describes")
    return champion
