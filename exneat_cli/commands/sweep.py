"""`exneat sweep`: all runs of an experiment, through Hydra's multirun."""

from __future__ import annotations

import contextlib
import sys
import tempfile
import time
import traceback
from collections.abc import Sequence
from pathlib import Path

from hydra.core.hydra_config import HydraConfig
from omegaconf import DictConfig

from exneat_cli.commands.composition import configuration_directory, run_composed
from exneat_cli.commands.drawing import draw_what_is_missing
from exneat_cli.commands.experiments import Experiment, Job, budget_of, plan_jobs, read_experiment
from exneat_cli.commands.overrides import check_overrides
from exneat_cli.errors import ExneatError
from exneat_cli.interruption import signal_heard
from exneat_cli.records import DONE
from exneat_cli.runs import Progress, progress_for_terminal, run_robustness, train

_BASIC_LAUNCHER = "hydra._internal.core_plugins.basic_launcher.BasicLauncher"


def run(arguments: Sequence[str]) -> int:
    """Do what is missing of an experiment; returns 0 if all of it is there at the end, else 1.

    Raises:
        ExneatError: the experiment or a setting makes no sense; nothing was run then.
    """
    name, for_hydra, overrides = _sorted_arguments(arguments)
    check_overrides(for_hydra, configuration_directory())
    experiment = read_experiment(name)
    chosen, overrides = budget_of(overrides)
    budget = "quick" if chosen is None else chosen
    jobs = plan_jobs(experiment, budget, overrides)
    pending = [job for job in jobs if not (job.is_finished() and job.is_drawn())]
    done_before = len(jobs) - len(pending)
    print(f"{experiment.name}, budget {budget}: {len(jobs)} runs, {done_before} of them finished before", flush=True)
    with tempfile.TemporaryDirectory(prefix="exneat-") as notes:
        launch = Launch(jobs, pending, ["exneat", "sweep", *arguments], Path(notes))
        if pending:
            _launch(launch, for_hydra)
        return _summarise(experiment, launch, done_before)


def _launch(launch: Launch, for_hydra: Sequence[str]) -> None:
    names = ",".join(f"'{name}'" for name in launch.pending)
    try:
        run_composed("exneat sweep", ["--multirun", f"+job={names}", *for_hydra], launch)
    except ExneatError as error:
        if signal_heard() is not None or not any(job.is_finished() for job in launch.pending.values()):
            raise
        # A launcher gives up when one of its processes is killed: what was done by then counts.
        print(f"exneat: {error}", file=sys.stderr)


def _sorted_arguments(arguments: Sequence[str]) -> tuple[str, list[str], list[str]]:
    """The experiment's name, what is meant for Hydra itself, and overrides for all runs."""
    name, for_hydra, overrides = "", [], []
    for argument in arguments:
        key, _, value = argument.partition("=")
        if key == "experiment":
            name = value
        elif argument in ("-m", "--multirun"):
            continue
        elif key.lstrip("+~").startswith("hydra"):
            for_hydra.append(argument)
        elif key == "seed" and "," in value:
            raise ExneatError(f"{argument}: a sweep runs seeds of its own, {value.split(',')[0]} and on; set the first")
        elif argument.startswith(("-", "=")):
            raise ExneatError(f"{argument}: unknown flag; exneat sweep takes settings, written key=value")
        else:
            overrides.append(argument)
    if not name:
        raise ExneatError("experiment: expected a name or a YAML file, e.g. exneat sweep experiment=track_maze")
    return name, for_hydra, overrides


class Launch:
    """What Hydra calls for each job, here or in another process; failures stay with the job.

    Args:
        jobs: all of the experiment's.
        pending: those to be done.
        command: the command line, for manifests.
        notes: a directory where jobs note why they failed.
    """

    def __init__(self, jobs: Sequence[Job], pending: Sequence[Job], command: Sequence[str], notes: Path) -> None:
        self.jobs = jobs
        self.pending = {job.name: job for job in pending}
        self.command = command
        self.began = time.time()
        self.notes = notes

    def __call__(self, config: DictConfig) -> None:
        """Do the job that `config` names."""
        job = self.pending[config.job]
        in_turn = HydraConfig.get().launcher["_target_"] == _BASIC_LAUNCHER
        began = time.time()
        try:
            figure = self._do(job, show_bar=in_turn and sys.stderr.isatty())
        except Exception as error:
            if signal_heard() is not None:
                raise
            if isinstance(error, ExneatError):
                self._tell_failure(job, str(error))
            else:
                traceback.print_exc()
                self._tell_failure(job, f"{type(error).__name__}: {error}")
        else:
            done, left = self._done_and_left()
            print(f"{done} {job.name}: {figure} in {time.time() - began:.1f} s{left}", flush=True)

    def why_failed(self, job: Job) -> str | None:
        """What a job noted when it failed; None if it did not."""
        note = self._note(job)
        return note.read_text(encoding="utf-8") if note.exists() else None

    def _note(self, job: Job) -> Path:
        return self.notes / job.name.replace("/", " ")

    def _do(self, job: Job, *, show_bar: bool) -> str:
        settings, asked = job.settings, job.sweeps
        progress = progress_for_terminal() if show_bar else Progress()
        finished = train(settings, progress=progress, command=self.command, go_on=True)
        directory = finished.directory
        run_robustness(directory, asked.sweeps, episodes=asked.episodes, executor=settings.executor, progress=progress)
        draw_what_is_missing(directory, settings.task.fitness_name, asked.labels)
        champion = finished.result.champion
        return f"{settings.task.fitness_name} {champion.fitness_mean:.{settings.task.fitness_decimals}f}"

    def _tell_failure(self, job: Job, reason: str) -> None:
        with contextlib.suppress(OSError):  # on another machine the directory is not there
            self._note(job).write_text(reason, encoding="utf-8")
        print(f"{self._done_and_left()[0]} {job.name}: failed: {reason}", file=sys.stderr, flush=True)

    def _done_and_left(self) -> tuple[str, str]:
        finished = sum(job.is_finished() for job in self.jobs)
        left = len(self.jobs) - finished
        counted = f"[{finished:>{len(str(len(self.jobs)))}}/{len(self.jobs)}]"
        done = len(self.pending) - left
        if left == 0 or done <= 0:
            return counted, ""
        seconds = (time.time() - self.began) / done * left
        return counted, f", about {seconds / 60:.0f} min left" if seconds >= 90 else f", about {seconds:.0f} s left"


def _summarise(experiment: Experiment, launch: Launch, done_before: int) -> int:
    reasons = {job.name: launch.why_failed(job) or _unfinished_because(job) for job in launch.pending.values()}
    failed = {name: reason for name, reason in reasons.items() if reason}
    now = len(launch.pending) - len(failed)
    print(f"\n{experiment.name}: {now} runs done, {done_before} skipped as finished before, {len(failed)} failed")
    for name, reason in failed.items():
        print(f"  {name}: {reason}", file=sys.stderr)
    if failed:
        print("  the same command does what is missing", file=sys.stderr)
    return 1 if failed else 0


def _unfinished_because(job: Job) -> str:
    """Why a job is not finished, from what it left on disk; empty if it is finished."""
    directory = job.settings.directory
    if job.is_finished():
        return ""
    if not directory.is_there():
        return "it was not begun"
    try:
        manifest = directory.read_manifest()
    except ExneatError as error:
        return str(error)
    if manifest.status == DONE:
        return "it was trained, but not tested at every level"
    return str(manifest.error or f"it did not finish (status {manifest.status})")
