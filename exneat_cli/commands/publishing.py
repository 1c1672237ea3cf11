"""Publishing: the rows of an experiment's finished runs, in the order of its conditions, variants and seeds."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from exneat_cli.commands.jobs import BUDGETS, Job
from exneat_cli.records import PublishedRun, publish, published_run


@dataclass(frozen=True)
class Publisher:
    """Writes rows of jobs called ``<condition>/<variant>/<seed>`` into one file, from several processes if need be."""

    path: Path
    budget: str
    conditions: tuple[str, ...]
    variants: tuple[str, ...]

    def publish(self, jobs: Sequence[Job]) -> None:
        """Write the rows of finished jobs; those that are there already stay as they are.

        Raises:
            ExneatError: the file is damaged, or cannot be written.
        """
        if jobs:
            publish(self.path, list(map(self._row, jobs)), self._order)

    def _row(self, job: Job) -> PublishedRun:
        condition, variant, _ = job.name.split("/")
        levels = {(sweep.name, float(level)) for sweep in job.sweeps for level in sweep.levels}
        return published_run(job.settings.directory, (condition, variant, self.budget), levels, job.episodes)

    def _order(self, row: PublishedRun) -> tuple[Any, ...]:
        return (
            *_places((row.budget, BUDGETS), (row.condition, self.conditions), (row.variant, self.variants)),
            row.seed,
        )


def _places(*named: tuple[str, Sequence[str]]) -> Iterable[tuple[int, str]]:
    """The place of each name in its list; those that are not in it come last, by their letters."""
    for name, known in named:
        yield (known.index(name) if name in known else len(known)), name
