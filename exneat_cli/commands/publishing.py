"""Publishing: the rows of an experiment's finished runs, in the order of its conditions, variants and seeds."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from exneat_cli.commands.jobs import BUDGETS, Job
from exneat_cli.records import PublishedRun, publish, published_run


def publish_jobs(
    path: Path, budget: str, conditions: Sequence[str], variants: Sequence[str], jobs: Sequence[Job]
) -> None:
    """Write the rows of finished jobs, called ``<condition>/<variant>/<seed>``; rows of other runs are kept.

    Several processes may do so at once.

    Raises:
        ExneatError: the file is damaged, or cannot be written.
    """

    def order(row: PublishedRun) -> tuple[Any, ...]:
        return (*_places((row.budget, BUDGETS), (row.condition, conditions), (row.variant, variants)), row.seed)

    if jobs:
        publish(path, [_row(job, budget) for job in jobs], order)


def _row(job: Job, budget: str) -> PublishedRun:
    condition, variant, _ = job.name.split("/")
    levels = {(sweep.name, float(level)) for sweep in job.sweeps for level in sweep.levels}
    return published_run(job.settings.directory, (condition, variant, budget), levels, job.episodes)


def _places(*named: tuple[str, Sequence[str]]) -> Iterable[tuple[int, str]]:
    """The place of each name in its list; names that are not in it come last, in alphabetical order."""
    for name, known in named:
        yield (known.index(name) if name in known else len(known)), name
