"""`exneat train`: one run, or with -m one run per combination of the settings that have several values."""

from __future__ import annotations

import functools
import sys
from collections.abc import Sequence

from exneat_cli.commands.command_line import CommandLine
from exneat_cli.commands.jobs import Job, read_job
from exneat_cli.commands.launching import run_jobs
from exneat_cli.errors import ExneatError
from exneat_cli.runs import Finished, progress_for_terminal
from exneat_cli.tasks.contract import check_worlds


def run(line: CommandLine) -> int:
    """Train; returns the exit code.

    Raises:
        ExneatError: the configuration or a run directory is unusable, in at least one job of a multirun.
    """
    if not line.multirun and not line.launcher:
        job = read_job("train", line)
        _tell(job.do(progress_for_terminal(), line.words, go_on=False))
        return 0
    jobs, failures = [], []
    for name, each in line.combinations().items():
        try:
            job = read_job(name or "train", each)
            check_worlds(job.settings.task)
            jobs.append(job)
        except ExneatError as error:
            failures.append(str(error))
            print(f"exneat: {name or 'train'}: {error}", file=sys.stderr)
    work = functools.partial(_train, line.words, go_on=line.multirun)
    failures += filter(None, run_jobs(work, jobs, line) if jobs else [])
    if failures:
        reason = failures[0].splitlines()[0]
        raise ExneatError(f"at least one job of the multirun failed; the first:\n  {reason}")
    return 0


def _train(command: Sequence[str], job: Job, *, go_on: bool) -> None:
    _tell(job.do(progress_for_terminal(), command, go_on=go_on))


def _tell(finished: Finished) -> None:
    directory = finished.directory
    if not finished.trained_now:
        print(f"{directory.path} is finished already; nothing was trained.")
    print("\nWritten:")
    for path in sorted(path for path in directory.path.rglob("*") if path.is_file()):
        print(f"  {path}")
    print(f"\n{finished.summary}")
