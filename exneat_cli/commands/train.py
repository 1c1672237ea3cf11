"""`exneat train`: one run, or with -m one run per combination of the settings that have several values."""

from __future__ import annotations

import sys

from exneat_cli.commands.command_line import CommandLine
from exneat_cli.commands.jobs import read_job
from exneat_cli.commands.run_table import ListedRun, print_runs, sorted_runs
from exneat_cli.commands.series import do_jobs, unfinished
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
        try:
            finished = job.do(progress_for_terminal(), line.words, go_on=False)
        except (Exception, KeyboardInterrupt) as error:
            if job.settings.directory.is_there():
                error.add_note(job.resuming(line.words))
            raise
        tell(finished)
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
    pending = unfinished(jobs)
    if not line.launcher:
        print(f"{len(jobs)} runs, {len(jobs) - len(pending)} of them already finished", flush=True)
    failures += filter(None, do_jobs(jobs, pending, line))
    listed = [ListedRun.read(run) for job in jobs if (run := job.settings.directory).is_there()]
    if listed:
        print()
        print_runs(sorted_runs(listed, "fitness"))
    if failures:
        reason = failures[0].splitlines()[0]
        raise ExneatError(f"at least one job of the multirun failed; the first reason:\n  {reason}")
    return 0


def tell(finished: Finished) -> None:
    """Print what one run wrote and learned."""
    directory = finished.directory
    if not finished.trained_now:
        print(f"{directory.path} is finished already; nothing was trained.")
    print("\nWritten:")
    for path in sorted(path for path in directory.path.rglob("*") if path.is_file()):
        print(f"  {path}")
    print(f"\n{finished.summary}")
