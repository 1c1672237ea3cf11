"""Several jobs one after the other or side by side, and what is told of them: a line as each begins, and as it ends."""

from __future__ import annotations

import contextlib
import functools
import sys
import time
from collections.abc import Iterator, Sequence

from exneat_cli.commands.command_line import CommandLine
from exneat_cli.commands.jobs import Job
from exneat_cli.commands.launching import run_jobs, side_by_side
from exneat_cli.commands.publishing import Publisher
from exneat_cli.compiling import seconds_compiled
from exneat_cli.runs import Progress, progress_for_terminal


def unfinished(jobs: Sequence[Job]) -> list[Job]:
    """Those that are not done, tested and drawn; a damaged one is not."""
    return [job for job in jobs if not job.is_finished() or job.missing_figures(job.settings.directory)]


def do_jobs(
    jobs: Sequence[Job], pending: Sequence[Job], line: CommandLine, publisher: Publisher | None = None
) -> list[str]:
    """Do the `pending` ones of `jobs`, each published when done if there is a `publisher`.

    Returns why each of them failed, empty where it did not.

    Raises:
        ExneatError: see `run_jobs`.
    """
    if not pending:
        return []
    alone = not line.launcher and not side_by_side(pending)
    with contextlib.nullcontext() if alone else _told(jobs):
        work = functools.partial(_do, jobs, len(pending), time.time(), line, alone, publisher)
        return run_jobs(work, pending, line)


@contextlib.contextmanager
def _told(jobs: Sequence[Job]) -> Iterator[None]:
    """Tell now and then how many are done, where none of them tells what it is doing."""
    progress = Progress(sys.stderr, doing=lambda: f"{len(jobs) - _count_left(jobs)} of {len(jobs)} runs done; the rest")
    progress.start("", len(jobs))
    try:
        yield
    finally:
        progress.stop()


def _count_left(jobs: Sequence[Job]) -> int:
    return sum(not job.is_finished() for job in jobs)


def _do(
    jobs: Sequence[Job],
    pending: int,
    began: float,
    line: CommandLine,
    alone: bool,
    publisher: Publisher | None,
    job: Job,
) -> None:
    started, number = time.time(), 1 + [each.name for each in jobs].index(job.name)
    counted = f"[{number:>{len(str(len(jobs)))}}/{len(jobs)}] {job.name}"
    print(f"{counted} begins", flush=True)
    finished = job.do(progress_for_terminal(tenths=False) if alone else Progress(), line.words, go_on=True)
    if publisher:
        publisher.publish([job])
    left = _count_left(jobs)
    seconds = (time.time() - began - seconds_compiled()) / max(1, pending - left) * left
    when = f"about {seconds / 60:.0f} min" if seconds >= 90 else f"about {seconds:.0f} s"
    task = job.settings.task
    fitness = f"{task.fitness_name} {finished.result.champion.fitness_mean:.{task.fitness_decimals}f}"
    took = f"in {time.time() - started:.1f} s, {len(jobs) - left} of {len(jobs)} done" + (
        f", {when} left" if left else ""
    )
    print(f"{counted}: {fitness} {took}", flush=True)
