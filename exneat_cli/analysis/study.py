"""What a report is made from: the planned runs of experiments, what their files hold, and what their training cost.

A study is one experiment at one budget. Its runs are found in the directories that its settings lead to or, if they are
not there, among the published rows with the same hash of settings; so runs with other settings are never included.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import pandas as pd

from exneat_cli.errors import ExneatError
from exneat_cli.records import HISTORY_COLUMNS, Manifest, PublishedRun, RobustnessRow, RunDirectory, read_robustness

BEST = 5
"""How many runs of each variant the thesis tests: those best on validation; Zhang (2025), table 5.5."""
ENOUGH_RUNS = 10
_REACHED = ("training", "validation", "test", "full_reward")
_SPENT = ("episodes", "env_steps", "wall_seconds")


class MissingRunsError(ExneatError):
    """Runs that a figure or table needs are missing; says which, and the command that makes them."""


@dataclass(frozen=True)
class PlannedRun:
    """One run of an experiment, finished or not.

    Attributes:
        condition, variant, seed: its place in the experiment.
        directory: where its files are, or will be.
        generations: how long it is trained; None accepts any length.
        configuration_hash: that of its settings, by which its published row is recognised.
    """

    condition: str
    variant: str
    seed: int
    directory: RunDirectory
    generations: int | None = None
    configuration_hash: str | None = None


@dataclass(frozen=True)
class Study:
    """One experiment at one budget.

    Attributes:
        experiment: its name.
        budget: ``paper``, ``quick`` or ``smoke``.
        claim: what it is meant to show, in one sentence.
        command: the command line that makes its missing runs.
        fitness_name: what the task's fitness is, in words.
        has_full_reward: whether the task has a second score.
        variants: name -> label, in the order of legends; the first is what others are compared with.
        baselines: names of the variants that are not trained.
        conditions: name -> label.
        sweeps: name of a robustness sweep -> label of its axis, with unit.
        runs: all of them.
        references: variant -> the one that it is compared with, for those that are not compared with the first.
        levels: sweep -> the planned levels; None accepts all levels.
        sweep_episodes: the planned test episodes per level; None accepts any number.
        rows: published runs of the experiment, of any budget and settings.
        trained: condition -> sweep -> the level at which all of its runs were trained, where there is one.
    """

    experiment: str
    budget: str
    claim: str
    command: str
    fitness_name: str
    has_full_reward: bool
    variants: Mapping[str, str]
    baselines: tuple[str, ...]
    conditions: Mapping[str, str]
    sweeps: Mapping[str, str]
    runs: tuple[PlannedRun, ...]
    references: Mapping[str, str] = field(default_factory=dict)
    levels: Mapping[str, tuple[float, ...]] | None = None
    sweep_episodes: int | None = None
    rows: tuple[PublishedRun, ...] = ()
    trained: Mapping[str, Mapping[str, float]] = field(default_factory=dict)

    @property
    def first_variant(self) -> str:
        """The variant that the others are compared with, unless they have a reference of their own."""
        return next(iter(self.variants))

    def reference_of(self, variant: str) -> str:
        """The variant that this one is compared with; itself if others are compared with it."""
        own = variant == self.first_variant or variant in self.references.values()
        return variant if own else self.references.get(variant, self.first_variant)

    @property
    def trained_variants(self) -> tuple[str, ...]:
        """Names of the variants that are trained."""
        return tuple(name for name in self.variants if name not in self.baselines)

    def only(self, trained: Collection[str]) -> Study:
        """The same study with only these trained variants, and its baselines."""
        kept = {name: label for name, label in self.variants.items() if name in trained or name in self.baselines}
        references = {name: other for name, other in self.references.items() if {name, other} <= set(kept)}
        runs = tuple(run for run in self.runs if run.variant in kept)
        return replace(self, variants=kept, references=references, runs=runs)

    @functools.cached_property
    def finished(self) -> Mapping[PlannedRun, Manifest]:
        """The runs that are done, with their manifests."""
        done = [run for run in self.runs if run.directory.is_finished(generations=run.generations)]
        return {run: run.directory.read_manifest() for run in done}

    @functools.cached_property
    def published(self) -> Mapping[PlannedRun, PublishedRun]:
        """The runs that are not finished here, but have a published row with the same settings."""
        rows = {row.place: row for row in self.rows}
        known = {run: rows.get((run.condition, run.variant, run.seed, self.budget)) for run in self.runs}
        return {
            run: row
            for run, row in known.items()
            if row is not None and run not in self.finished and row.configuration_hash == run.configuration_hash
            if run.generations in (None, row.generations)
        }

    @functools.cached_property
    def reached(self) -> tuple[PlannedRun, ...]:
        """The runs that are finished or published, in their order."""
        return tuple(run for run in self.runs if run in self.finished or run in self.published)

    def on_disk(self) -> Study:
        """The same study without published rows, which lack champions and the axes of episodes and steps."""
        return replace(self, rows=())

    def of(self, condition: str, variant: str) -> tuple[PlannedRun, ...]:
        """Runs of one variant in one condition that are finished or published, in the order of their seeds."""
        return tuple(run for run in self.reached if (run.condition, run.variant) == (condition, variant))

    def require(self, condition: str, variants: Iterable[str]) -> None:
        """Check that every one of `variants` has a finished run in `condition`.

        Raises:
            MissingRunsError: one has none.
        """
        missing = [self.variants[variant] for variant in variants if not self.of(condition, variant)]
        if missing:
            raise self.lacking(condition, f"no finished run of {', '.join(missing)}")

    def lacking(self, condition: str, what: str) -> MissingRunsError:
        """The error that says what `condition` lacks, and the command that makes it."""
        return MissingRunsError(f"{self.experiment}, {condition}, budget {self.budget}: {what}\n  {self.command}")

    @functools.cached_property
    def results(self) -> pd.DataFrame:
        """One row per finished or published run: what it reached, and what its training cost.

        Columns: condition, variant, seed; training (final best so far), validation, test and full_reward (the
        champion's means over episodes); episodes, env_steps and wall_seconds of training. NaN for what a run lacks:
        baselines have only test figures.
        """
        rows: list[tuple[Any, ...]] = []
        for run in self.reached:
            place = (run.condition, run.variant, run.seed)
            if run in self.published:
                row = self.published[run]
                reached = (row.training, row.validation, row.test_mean, row.full_reward_mean)
                rows.append((*place, *reached, row.episodes, row.env_steps, row.wall_seconds))
            else:
                result, spent = self.finished[run].result, self.finished[run].budget_spent
                assert result is not None
                test = result.champion
                reached = (result.training, result.validation, test.fitness_mean, test.full_reward_mean)
                rows.append((*place, *reached, *(spent.get(name) for name in _SPENT)))
        table = pd.DataFrame(rows, columns=["condition", "variant", "seed", *_REACHED, *_SPENT])
        return table.astype(dict.fromkeys((*_REACHED, *_SPENT), float))

    def spent_in(self, condition: str, variants: Collection[str]) -> pd.DataFrame:
        """What training took in one condition: a row per run with the variant's label, episodes and env_steps."""
        results = self.results[self.results["condition"] == condition]
        here = results[results["variant"].isin(list(variants))]
        return here.assign(variant=here["variant"].map(self.variants))[["variant", "episodes", "env_steps"]].dropna()

    def best_first(self, condition: str, variant: str) -> list[PlannedRun]:
        """Finished runs, the best on validation first; equal ones by seed, those without such a figure last."""
        validation = dict(zip(self.reached, self.results["validation"].fillna(-math.inf), strict=True))
        return sorted(self.of(condition, variant), key=validation.__getitem__, reverse=True)

    def best_seeds(self, condition: str, variant: str, among: Collection[Any]) -> list[int]:
        """Seeds of the `BEST` runs (or fewer) that are best on validation, of those whose seeds are in `among`."""
        return [run.seed for run in self.best_first(condition, variant) if run.seed in among][:BEST]

    def history(self, condition: str) -> pd.DataFrame:
        """history.csv of all trained runs in one table, with columns ``variant`` and ``seed``.

        Published runs have only ``generation`` and ``best_so_far``.
        """
        tables = [
            pd.DataFrame({"generation": range(1, row.generations + 1), "best_so_far": row.best_so_far}).assign(
                variant=run.variant, seed=run.seed
            )
            for run, row in self.published.items()
            if run.condition == condition and run.variant not in self.baselines
        ]
        tables += [
            read_csv(run.directory.history, HISTORY_COLUMNS).assign(variant=run.variant, seed=run.seed)
            for run in self.finished
            if run.condition == condition and run.variant not in self.baselines
        ]
        nothing = pd.DataFrame(columns=[*HISTORY_COLUMNS, "variant", "seed"], dtype=float)
        return pd.concat(tables or [nothing], ignore_index=True)

    def robustness(self, condition: str) -> pd.DataFrame:
        """The planned rows of robustness.csv of all runs, with columns ``variant`` and ``seed``.

        Published runs have no standard deviations. Rows of tests at other levels or with other numbers of
        episodes are left out.
        """
        nan = math.nan
        rows: list[tuple[Any, ...]] = [
            (*row._replace(variant=run.variant), run.seed)
            for run in self.finished
            if run.condition == condition
            for row in read_robustness(run.directory.robustness)
            if self.levels is None or row.level in self.levels.get(row.parameter, ())
            if self.sweep_episodes in (None, row.episodes)
        ]
        for run, published in self.published.items():
            if run.condition == condition and self.sweep_episodes in (None, published.sweep_episodes):
                rows += [
                    (run.variant, run.seed, sweep, level, published.sweep_episodes, fitness, nan, full, nan, run.seed)
                    for sweep, level, fitness, full in published.levels
                    if self.levels is None or level in self.levels.get(sweep, ())
                ]
        return pd.DataFrame(rows, columns=[*RobustnessRow._fields, "seed"])


def read_csv(path: Path, columns: Sequence[str] = ()) -> pd.DataFrame:
    """Read a table of numbers that somebody may have edited; `columns` are those that it must have.

    Raises:
        ExneatError: the file is missing or damaged.
    """
    try:
        with path.open(encoding="utf-8") as file:
            table = pd.read_csv(file)
    except OSError as error:
        raise ExneatError(f"{path}: cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise ExneatError(f"{path}: damaged: {str(error).strip().splitlines()[-1]}") from error
    for column in columns:
        if column not in table or not pd.api.types.is_numeric_dtype(table[column]):
            raise ExneatError(f"{path}: damaged: expected numbers in a column {column}")
    return table


def few_runs_sentence(groups: Iterable[int]) -> str:
    """Warn if the smallest of the compared groups of runs has fewer than ten; else say nothing."""
    if min(groups, default=ENOUGH_RUNS) >= ENOUGH_RUNS:
        return ""
    return f"Intervals are too narrow below {ENOUGH_RUNS} runs, and a single run has none."


def budget_sentence(places: Sequence[pd.DataFrame]) -> str:
    """Say whether variants had equal budgets, and how many environment steps each took.

    Variants are compared within each of `places`, tables of `Study.spent_in`. Episodes are what a budget sets; steps
    follow from how long a variant's episodes last, so variants with equal budgets may differ in them.
    """
    spent = pd.concat(places) if places else pd.DataFrame()
    if spent.empty:
        return "No run has spent anything on training."
    by_variant = spent.groupby("variant", sort=False)
    compared = [place["episodes"].nunique() for place in places if place["variant"].nunique() > 1]
    if not compared:
        verdict = "No two variants have finished runs of the same condition, so there are no budgets to compare"
    elif max(compared) == 1:
        verdict = f"All variants had equal budgets of {number_range(spent['episodes'])} training episodes per run"
    else:
        each = "; ".join(f"{variant} {number_range(counts)}" for variant, counts in by_variant["episodes"])
        verdict = f"The variants had unequal budgets of training episodes per run ({each})"
    means = "; ".join(f"{variant} {steps:,.0f}" for variant, steps in by_variant["env_steps"].mean().items())
    return f"{verdict}; environment steps per run, on average: {means}."


def number_range(counts: Iterable[float]) -> str:
    """The lowest and the highest as whole numbers, e.g. ``3 to 10``; one number where they are equal."""
    low, high = min(counts), max(counts)
    return f"{low:,.0f}" if low == high else f"{low:,.0f} to {high:,.0f}"
