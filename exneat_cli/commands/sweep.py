"""`exneat sweep`: all runs of an experiment, one after the other or by a launcher of Hydra's."""

from __future__ import annotations

import functools
import sys
import time
from collections.abc import Sequence

from exneat_cli.commands.command_line import CommandLine
from exneat_cli.commands.experiments import plan_jobs, read_experiment
from exneat_cli.commands.jobs import Job
from exneat_cli.commands.launching import run_jobs
from exneat_cli.errors import ConfigError, ExneatError
from exneat_cli.interruption import signal_heard
from exneat_cli.records import DONE
from exneat_cli.runs import Progress, progress_for_terminal


def run(line: CommandLine) -> int:
    """Do what is missing of an experiment; returns 0 if all of it is there at the end, else 1.

    Raises:
        ExneatError: the experiment or a setting makes no sense; nothing was run then.
    """
    asked = line.compose("experiment", "budget")
    if not asked["experiment"]:
        raise ConfigError("experiment", "a name or a YAML file, e.g. experiment=track_maze", asked["experiment"])
    experiment = read_experiment(asked["experiment"])
    jobs = plan_jobs(experiment, asked["budget"], line, ("experiment",))
    pending = [job for job in jobs if not (job.is_finished() and job.is_drawn())]
    before = len(jobs) - len(pending)
    counted = f"{len(jobs)} runs, {before} of them finished before"
    print(f"{experiment.name}, budget {asked['budget']}: {counted}", flush=True)
    reasons = [""] * len(pending)
    try:
        if pending:
            reasons = run_jobs(functools.partial(_do, jobs, len(pending), time.time(), line), pending, line)
    except ExneatError as error:
        if signal_heard() is not None or not any(job.is_finished() for job in pending):
            raise
        # A launcher gives up when one of its processes is killed: what was done by then counts.
        print(f"exneat: {error}", file=sys.stderr)
    reasons = [reason or _unfinished_because(job) for job, reason in zip(pending, reasons, strict=True)]
    failed = {job.name: reason for job, reason in zip(pending, reasons, strict=True) if reason}
    done = len(pending) - len(failed)
    print(f"\n{experiment.name}: {done} runs done, {before} skipped as finished before, {len(failed)} failed")
    for name, reason in failed.items():
        print(f"  {name}: {reason}", file=sys.stderr)
    if failed:
        print("  the same command does what is missing", file=sys.stderr)
    return 1 if failed else 0


def _do(jobs: Sequence[Job], pending: int, began: float, line: CommandLine, job: Job) -> None:
    """Do one job, and tell how far the sweep is."""
    started = time.time()
    shown = sys.stderr.isatty() and not line.launcher
    finished = job.do(progress_for_terminal() if shown else Progress(), line.words, go_on=True)
    left = sum(not each.is_finished() for each in jobs)
    seconds = (time.time() - began) / max(1, pending - left) * left
    when = f"about {seconds / 60:.0f} min" if seconds >= 90 else f"about {seconds:.0f} s"
    task = job.settings.task
    fitness = f"{task.fitness_name} {finished.result.champion.fitness_mean:.{task.fitness_decimals}f}"
    counted = f"[{len(jobs) - left:>{len(str(len(jobs)))}}/{len(jobs)}]"
    took = f"in {time.time() - started:.1f} s" + (f", {when} left" if left else "")
    print(f"{counted} {job.name}: {fitness} {took}", flush=True)


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
    return manifest.error or f"it did not finish (status {manifest.status})"
