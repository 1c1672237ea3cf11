"""One run from settings to a finished directory."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from typing import Any

import numpy as np
import yaml

from exneat_cli.algorithms import Team
from exneat_cli.brains import Brain, RandomActions, assemble, motionless
from exneat_cli.errors import ExneatError
from exneat_cli.interruption import signal_heard
from exneat_cli.records import (
    DONE,
    FAILED,
    INTERRUPTED,
    MANIFEST_FORMAT,
    RUNNING,
    UNPERTURBED,
    Champion,
    Checkpoint,
    Claim,
    HistoryRow,
    RunDirectory,
    merge_robustness,
    provenance,
    read_checkpoints,
    write_champion,
    write_checkpoint,
    write_csv,
    write_hall_of_fame,
    write_history,
)
from exneat_cli.rollouts import Runner, Trace, keep_clusters
from exneat_cli.runs.progress import Progress, Silence
from exneat_cli.runs.scores import baseline, robustness_row, score_all, score_brains, summary_sentence, unseen_episodes
from exneat_cli.runs.settings import RunSettings
from exneat_cli.runs.training import Trained, evolve
from exneat_cli.seeding import STREAMS, shared_episodes
from exneat_cli.wiring import UNTRAINED


@dataclass(frozen=True)
class Finished:
    """A run that is done.

    Attributes:
        directory: where its files are.
        result: test figures of champion, standing still and first generation; see the manifest.
        summary: the same in one sentence.
        trained_now: False if it was found finished.
    """

    directory: RunDirectory
    result: dict[str, Any]
    summary: str
    trained_now: bool


@keep_clusters()
def train(
    settings: RunSettings,
    *,
    progress: Progress | None = None,
    command: Sequence[str] = (),
    go_on: bool = False,
) -> Finished:
    """Do one run, or find it done.

    Args:
        settings: see there.
        progress: told what happens; nothing is shown without it.
        command: the command line that asked for it, for the manifest.
        go_on: go on with an unfinished run also without `settings.resume`, which alone makes a finished one longer.

    Raises:
        ExneatError: the directory is unusable or holds something else, or no team survived.
    """
    settings.executor.check_installed()
    directory = settings.directory
    asked = {**settings.to_plain(), "generations": settings.trained_generations}
    resume, lengthen = settings.resume or go_on, settings.resume
    with directory.claimed(settings.full_hash, asked, resume=resume, lengthen=lengthen) as claim:
        if claim is not Claim.FINISHED:
            _train_in(directory, settings, progress or Silence(), command)
        result = directory.read_result()
    trained_now = claim is not Claim.FINISHED
    return Finished(directory, result, summary_sentence(settings.task, result), trained_now=trained_now)


def _train_in(directory: RunDirectory, settings: RunSettings, progress: Progress, command: Sequence[str]) -> None:
    before = directory.read_manifest() if directory.is_there() else {}
    manifest = _first_manifest(settings, command)
    if before:
        _tell_other_versions(before, progress)
        manifest |= {"started": before.get("started"), "resumed": [*before.get("resumed", []), _now()]}
        directory.forget_what_was_derived()
    try:
        directory.begin(yaml.safe_dump(settings.to_plain(), sort_keys=False), manifest)
        result = _do(settings, directory, progress)
        directory.update_manifest(status=DONE, finished=_now(), result=result)
    except (Exception, KeyboardInterrupt) as error:
        _mark_unfinished(directory, error)
        raise
    finally:
        progress.stop()


def _mark_unfinished(directory: RunDirectory, error: BaseException) -> None:
    interrupted = isinstance(error, KeyboardInterrupt) or signal_heard() is not None
    with contextlib.suppress(ExneatError):  # a full disk must not hide the reason
        if directory.read_manifest().get("status") != RUNNING:
            return
        if interrupted:
            directory.update_manifest(status=INTERRUPTED)
        else:
            directory.update_manifest(status=FAILED, error=f"{type(error).__name__}: {error}")


def _tell_other_versions(before: Mapping[str, Any], progress: Progress) -> None:
    now, then = provenance.versions(), dict(before.get("versions") or {})
    changed = [name for name in now if then.get(name) != now[name]]
    if changed:
        names = ", ".join(f"{name} {then.get(name)} then, {now[name]} now" for name in changed)
        progress.say(f"{names}: results may differ from those of an undisturbed run")


def _first_manifest(settings: RunSettings, command: Sequence[str]) -> dict[str, object]:
    return {
        "format": MANIFEST_FORMAT,
        "status": RUNNING,
        "process": os.getpid(),
        "variant": settings.variant,
        "task": settings.task.name,
        "seed": settings.seed,
        "configuration_hash": settings.full_hash,
        "generations": settings.trained_generations,
        "command": list(command),
        "started": _now(),
        "seeds": {"root": settings.seed, "streams": STREAMS},
        "versions": provenance.versions(),
        "processor": provenance.processor(),
        "cores": os.cpu_count(),
        "git_commit": provenance.git_commit(),
    }


def _do(settings: RunSettings, directory: RunDirectory, progress: Progress) -> dict[str, Any]:
    progress.start(directory.path.name, settings.generations)
    _tell_simulator(settings, directory, progress)
    if settings.algorithm in UNTRAINED:
        return _test_baseline(settings, directory)

    def report(history: list[HistoryRow]) -> None:
        if signal_heard() is not None:  # Python drops the exception that comes up in a callback of a weak reference
            raise KeyboardInterrupt
        write_history(directory.history, history)
        progress.generation(history[-1])

    def save(checkpoint: Checkpoint) -> None:
        write_checkpoint(directory.path, checkpoint, settings.full_hash)

    checkpoints = read_checkpoints(directory.path, settings.full_hash)
    with Runner(settings.task, settings.noise, settings.executor, training=True) as runner:
        trained = evolve(settings, runner, report, checkpoints=checkpoints, say=progress.say, save=save)
    last = trained.history[-1]
    spent = {"episodes": last.episodes, "env_steps": last.env_steps, "wall_seconds": last.wall_seconds}
    directory.update_manifest(budget_spent=spent)
    progress.say(f"validating {len(trained.hall_of_fame)} teams of the hall of fame")
    return _choose_champion(settings, directory, trained)


def _tell_simulator(settings: RunSettings, directory: RunDirectory, progress: Progress) -> None:
    compiled = settings.task.open(training=False, reset_scale=settings.noise.reset_scale).compiled
    directory.update_manifest(simulator="compiled" if compiled else "gymnasium")
    if not compiled:
        progress.say("MuJoCo cannot be called from compiled code here: running over Gymnasium, which is slower")


def _choose_champion(settings: RunSettings, directory: RunDirectory, trained: Trained) -> dict[str, Any]:
    entries = trained.hall_of_fame
    with Runner(settings.task, settings.noise, settings.executor, training=False) as runner:
        brains = [_compile(settings, entry.team) for entry in entries]
        validation = score_brains(runner, brains, "validation", settings.validation_episodes)
        best = max(range(len(entries)), key=lambda k: validation[k].fitness_mean)
        first = _compile(settings, trained.first_generation)
        tested = score_brains(runner, [brains[best], _standing_still(settings), first], "test", settings.test_episodes)
        trace = runner.trace(brains[best], shared_episodes("test", 1)[0])
    scores = {
        "training": {"fitness": entries[best].fitness, "generation": entries[best].generation + 1},
        "validation": asdict(validation[best]),
        "test": asdict(tested[0]),
    }
    write_hall_of_fame(directory.hall_of_fame, entries, [each.fitness_mean for each in validation])
    write_champion(directory.champion, _champion(settings, entries[best].team, scores))
    _write_trace(settings, directory, trace)
    names = ("champion", "standing_still", "first_generation")
    training = {"training": trained.history[-1].best_so_far, "validation": validation[best].fitness_mean}
    return {**training, **{name: asdict(each) for name, each in zip(names, tested, strict=True)}}


def _test_baseline(settings: RunSettings, directory: RunDirectory) -> dict[str, Any]:
    acting = baseline(settings.task, settings.algorithm)
    episodes = unseen_episodes(settings, settings.test_episodes)
    with Runner(settings.task, settings.noise, settings.executor, training=False) as runner:
        (tested,) = score_all(runner.run(acting, episodes))
        (standing,) = score_brains(runner, [_standing_still(settings)], "test", settings.test_episodes)
        trace = runner.trace(acting if isinstance(acting, RandomActions) else acting[0], episodes[0])
    _write_trace(settings, directory, trace)
    merge_robustness(directory.robustness, [robustness_row(settings, UNPERTURBED, 0.0, tested)])
    return {"champion": asdict(tested), "standing_still": asdict(standing)}


def _compile(settings: RunSettings, team: Team) -> Brain:
    return assemble(settings.plan, team.genomes, feed_forward=settings.evolution.feed_forward)


def _standing_still(settings: RunSettings) -> Brain:
    return motionless(settings.task.observation_size, settings.task.resting_action)


def _champion(settings: RunSettings, team: Team, scores: dict[str, Any]) -> Champion:
    return Champion(
        variant=settings.variant,
        task=settings.to_plain()["task"],
        actuators=settings.task.actuator_names,
        feed_forward=settings.evolution.feed_forward,
        plan=settings.plan,
        genomes=team.genomes,
        scores=scores,
    )


def _write_trace(settings: RunSettings, directory: RunDirectory, trace: Trace) -> None:
    columns = ("step", *settings.task.trace_columns, *settings.task.terms)
    write_csv(directory.trace, columns, [(step, *row) for step, row in enumerate(trace.steps.tolist())])
    if trace.tiles is not None:
        tiles = [(*place, *trace.tiles[place].tolist()) for place in np.ndindex(trace.tiles.shape[:2])]
        write_csv(directory.tiles, ("row", "column", "path", "channel_1", "channel_2"), tiles)


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
