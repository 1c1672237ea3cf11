"""Doing several jobs one after another or side by side, with a line when each begins and when it ends."""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from exneat_cli.commands.command_line import CommandLine
from exneat_cli.commands.jobs import Job
from exneat_cli.commands.launching import run_jobs, side_by_side
from exneat_cli.compiling import seconds_compiled
from exneat_cli.runs import Progress, progress_for_terminal

Publish = Callable[[Sequence[Job]], None]
"""Writes rows of finished jobs; picklable, for a launcher's workers."""


def unfinished(jobs: Sequence[Job]) -> list[Job]:
    """The jobs that are not trained, tested and drawn; one with a damaged run is among them."""
    return [job for job in jobs if not job.is_finished() or job.missing_figures(job.settings.directory)]


def do_jobs(
    jobs: Sequence[Job], pending: Sequence[Job], line: CommandLine, publish: Publish | None = None
) -> list[str]:
    """Do those of `jobs` that are `pending`, and `publish` each when it is done.

    Returns why each of them failed, empty if it did not.

    Raises:
        ExneatError: see `run_jobs`.
    """
    if not pending:
        return []
    alone = not line.launcher and not side_by_side(pending)
    series = _Series([job.name for job in jobs], list(jobs), len(pending), time.time(), line.words, alone, publish)
    with contextlib.nullcontext() if alone else series.told():
        return run_jobs(series.do, pending, line)


@dataclass
class _Series:
    """What all jobs share; each of a launcher's workers has a copy."""

    names: list[str]
    left: list[Job]  # those not yet found to be finished
    pending: int  # how many were to be done at the beginning
    began: float
    words: tuple[str, ...]  # as typed, for manifests
    alone: bool  # whether each reports its own progress
    publish: Publish | None

    @contextlib.contextmanager
    def told(self) -> Iterator[None]:
        """Report now and then how many jobs are done, for jobs that do not report their own progress."""
        progress = Progress(sys.stderr, doing=lambda: f"{self._count_done()} of {len(self.names)} runs done")
        progress.start("", len(self.names))
        try:
            yield
        finally:
            progress.stop()

    def _count_done(self) -> int:
        self.left = [job for job in self.left if not job.is_finished()]
        return len(self.names) - len(self.left)

    def do(self, job: Job) -> None:
        """Do one job, with a line before it and one after it."""
        started, count = time.time(), len(self.names)
        counted = f"[{1 + self.names.index(job.name):>{len(str(count))}}/{count}] {job.name}"
        print(f"{counted} begins", flush=True)
        finished = job.do(progress_for_terminal(tenths=False) if self.alone else Progress(), self.words, go_on=True)
        if self.publish:
            self.publish([job])
        done = self._count_done()
        left = count - done
        seconds = (time.time() - self.began - seconds_compiled()) / max(1, self.pending - left) * left
        when = f"about {seconds / 60:.0f} min" if seconds >= 90 else f"about {seconds:.0f} s"
        task = job.settings.task
        fitness = f"{task.fitness_name} {finished.result.champion.fitness_mean:.{task.fitness_decimals}f}"
        took = f"in {time.time() - started:.1f} s, {done} of {count} done" + (f", {when} left" if left else "")
        print(f"{counted}: {fitness} {took}", flush=True)
