"""`exneat train`: one run, or with -m one run per combination of the settings that have several values."""

from __future__ import annotations

import functools
import sys
from collections.abc import Sequence

from exneat_cli.commands.command_line import CommandLine
from exneat_cli.commands.jobs import Job, read_job
from exneat_cli.commands.launching import run_jobs
from exneat_cli.errors import ExneatError
from exneat_cli.runs import progress_for_terminal


def run(line: CommandLine) -> int:
    """Train; returns the exit code.

    Raises:
        ExneatError: the configuration or a run directory is unusable, in at least one job of a multirun.
    """
    if not line.multirun and not line.launcher:
        _train(line.words, read_job("train", line.compose()), go_on=False)
        return 0
    jobs, failures = [], []
    for name, each in line.combinations().items():
        try:
            jobs.append(read_job(name or "train", each.compose()))
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
    finished = job.do(progress_for_terminal(), command, go_on=go_on)
    directory = finished.directory
    if not finished.trained_now:
        print(f"{directory.path} is finished already; nothing was trained.")
    print("\nWritten:")
    for path in sorted(path for path in directory.path.rglob("*") if path.is_file()):
        print(f"  {path}")
    print(f"\n{finished.summary}")
