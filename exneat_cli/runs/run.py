"""One run from settings to a finished directory."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from exneat_cli.errors import ExneatError
from exneat_cli.interruption import signal_heard
from exneat_cli.records import (
    DONE,
    FAILED,
    INTERRUPTED,
    MANIFEST_FORMAT,
    RUNNING,
    Manifest,
    Result,
    RunDirectory,
    as_yaml,
    provenance,
    write_history,
)
from exneat_cli.records.checkpoint import read_checkpoints, write_checkpoint
from exneat_cli.rollouts import Runner, keep_workers
from exneat_cli.runs.progress import Progress
from exneat_cli.runs.scores import choose_champion, measure_baseline, summary_sentence
from exneat_cli.runs.settings import RunSettings
from exneat_cli.runs.trackers import Tracking, check_trackers, tracked
from exneat_cli.runs.training import Training
from exneat_cli.seeding import STREAMS
from exneat_cli.tasks.contract import check_worlds


@dataclass(frozen=True)
class Finished:
    """A run that is done: its figures, the same in one sentence, and whether it was trained now or found finished."""

    directory: RunDirectory
    result: Result
    summary: str
    trained_now: bool


@keep_workers()
def train(
    settings: RunSettings,
    *,
    progress: Progress | None = None,
    command: Sequence[str] = (),
    go_on: bool = False,
    tracking: Tracking | None = None,
) -> Finished:
    """Do one run, or find it done; `progress`, if given, shows how it goes, and `command` is recorded in the manifest.

    An unfinished run is continued with `go_on` or `settings.resume`; a finished one is extended with `settings.resume`
    only. A caller that passes the settings' trackers as `tracking` may tell them more, and must close them.

    Raises:
        ExneatError: the directory is unusable or holds something else than this run, or every team failed.
    """
    settings.executor.check_installed()
    check_trackers(settings.trackers)
    check_worlds(settings.task)  # before anything is written
    progress = progress or Progress()
    directory = settings.directory
    asked = {**settings.to_plain(), "generations": settings.trained_generations}
    resume = settings.resume or go_on
    if resume and not directory.is_there():
        _refuse_changed_files(settings, asked)
    with directory.claimed(settings.full_hash, asked, resume=resume, lengthen=settings.resume) as was_done:
        if not was_done:
            with (
                _recorded(directory, settings, progress, command),
                contextlib.nullcontext(tracking) if tracking else tracked(settings.trackers) as told,
            ):
                result = _do(settings, directory, progress, told)
                directory.update_manifest(status=DONE, finished=_now(), result=result)
                told.result(result)
        result = directory.read_result()
    summary = summary_sentence(settings.task, result) + _told_of_backend(settings, result)
    return Finished(directory, result, summary, trained_now=not was_done)


def _do(settings: RunSettings, directory: RunDirectory, progress: Progress, told: Tracking) -> Result:
    """Train and choose the champion, or test the baseline."""
    if settings.algorithm.rule:
        told.begin(directory, settings.to_plain(), ())
        return measure_baseline(settings, directory)
    checkpoints = read_checkpoints(directory.path, settings.full_hash)
    training = Training.resumed(settings, checkpoints, progress.say)
    told.begin(directory, settings.to_plain(), training.history)
    with Runner(settings.task, settings.noise, settings.executor, training=True) as runner:
        while not training.is_over:
            training.advance(runner)
            _save(directory, training)
            progress.generation(training.history[-1])
            told.generation(training.history[-1])
    return choose_champion(training, directory, progress)


def _told_of_backend(settings: RunSettings, result: Result) -> str:
    """What to add about a run that was trained in another precision than it was tested in."""
    if settings.executor.name != "warp" or result.training is None:
        return ""
    device, digits = settings.executor.device_name, settings.task.fitness_decimals
    earned = f"the best team earned {result.training:.{digits}f} in a training episode"
    return f" These figures are from the CPU in float64; on {device} in float32, {earned}."


def _refuse_changed_files(settings: RunSettings, asked: Mapping[str, Any]) -> None:
    """Refuse to start a new run in place of one to be resumed because a file of the task has changed."""
    siblings = settings.directory.path.parent.glob(f"{settings.variant}-s{settings.seed}-*")
    for path in sorted(siblings) if settings.task.files() else ():
        if RunDirectory(path).is_alike(asked):
            fix = f"use the copy in {path / 'model'}, or leave out resume=true for a new run"
            raise ExneatError(f"{path}: the task's files have changed since this run began\n  {fix}")


def _save(directory: RunDirectory, training: Training) -> None:
    """Save the generation that is done."""
    if signal_heard() is not None:  # a library may have swallowed the exception
        raise KeyboardInterrupt
    write_history(directory.history, training.history)
    if training.is_over or len(training.history) % training.settings.checkpoint_every == 0:
        write_checkpoint(directory.path, training.checkpoint(), training.settings.full_hash)


@contextlib.contextmanager
def _recorded(
    directory: RunDirectory, settings: RunSettings, progress: Progress, command: Sequence[str]
) -> Iterator[None]:
    """Keep the manifest up to date: how the run began, and how it ended if it has no result."""
    before = directory.read_manifest() if directory.is_there() else None
    manifest = _manifest(settings, command, before)
    if before:
        _tell_other_versions(before, progress)
        directory.forget_what_was_derived()
    try:
        directory.begin(as_yaml(settings.to_plain()), manifest, settings.task.files())
        progress.start(directory.path.name, settings.generations)
        if settings.geometry.name == "auto" and settings.algorithm.modular:
            vector = settings.geometry.subpopulations(settings.task.parts)
            parts = zip(settings.task.parts, vector, strict=True)
            progress.say(f"geometry=auto, genomes by likeness: {', '.join(f'{part.name} {n}' for part, n in parts)}")
        yield
    except (Exception, KeyboardInterrupt) as error:
        _mark_unfinished(directory, error)
        raise
    finally:
        progress.stop()


def _mark_unfinished(directory: RunDirectory, error: BaseException) -> None:
    interrupted = isinstance(error, KeyboardInterrupt) or signal_heard() is not None
    ended = {"status": INTERRUPTED} if interrupted else {"status": FAILED, "error": f"{type(error).__name__}: {error}"}
    with contextlib.suppress(ExneatError):  # a full disk must not hide the reason
        if directory.is_there() and directory.read_manifest().status == RUNNING:
            directory.update_manifest(**ended)


def _tell_other_versions(before: Manifest, progress: Progress) -> None:
    now, then = provenance.versions(), before.versions
    changed = [f"{name} {then.get(name)} then, {now[name]} now" for name in now if then.get(name) != now[name]]
    if changed:
        progress.say(f"{', '.join(changed)}: results may differ from those of an uninterrupted run")


def _manifest(settings: RunSettings, command: Sequence[str], before: Manifest | None) -> Manifest:
    """The manifest of a run that begins now, or continues where the one `before` ended."""
    return Manifest(
        format=MANIFEST_FORMAT,
        status=RUNNING,
        process=os.getpid(),
        variant=settings.variant,
        task=settings.task.name,
        seed=settings.seed,
        configuration_hash=settings.full_hash,
        generations=settings.trained_generations,
        command=tuple(command),
        started=before.started if before else _now(),
        resumed=(*before.resumed, _now()) if before else (),
        seeds={"root": settings.seed, "streams": STREAMS},
        versions=provenance.versions(),
        processor=provenance.processor(),
        cores=os.cpu_count(),
        git_commit=provenance.git_commit(),
    )


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
