"""What a report is made from: the planned runs of experiments, and their CSV files as tables.

A study is one experiment at one budget. Its runs are found by the directories that its settings lead to, so
runs with other settings never slip in, whatever else lies in the same folder.
"""

from __future__ import annotations

import functools
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace

import pandas as pd

from exneat_cli.analysis.csv_files import read_csv
from exneat_cli.errors import ExneatError
from exneat_cli.records import HISTORY_COLUMNS, Result, RobustnessRow, RunDirectory


class MissingRunsError(ExneatError):
    """What is asked for needs runs that are not there; says which, and the command that makes them."""


@dataclass(frozen=True)
class PlannedRun:
    """One run of an experiment, finished or not.

    Attributes:
        condition, variant, seed: its place in the experiment.
        directory: where its files are, or will be.
        generations: how long it is trained; None takes any length.
    """

    condition: str
    variant: str
    seed: int
    directory: RunDirectory
    generations: int | None = None


@dataclass(frozen=True)
class Study:
    """One experiment at one budget.

    Attributes:
        experiment: its name.
        budget: ``paper``, ``quick`` or ``smoke``.
        claim: what it is to show, in one sentence.
        command: the command line that makes what is missing.
        fitness_name: what the task's fitness is, in words.
        has_full_reward: whether the task has a second figure.
        variants: name -> label, in the order of legends; the first is what others are compared with.
        baselines: names of those variants that nothing trains.
        conditions: name -> label.
        sweeps: name of a robustness sweep -> label of its axis, with unit.
        runs: all of them.
        levels: sweep -> the planned levels; None takes whatever levels there are.
        sweep_episodes: the planned test episodes per level; None takes any number.
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
    levels: Mapping[str, tuple[float, ...]] | None = None
    sweep_episodes: int | None = None

    @property
    def trained_variants(self) -> tuple[str, ...]:
        """Names of the variants that learn."""
        return tuple(name for name in self.variants if name not in self.baselines)

    def only(self, trained: Collection[str]) -> Study:
        """The same study with these trained variants alone, and its baselines."""
        kept = {
            variant: label
            for variant, label in self.variants.items()
            if variant in trained or variant in self.baselines
        }
        return replace(self, variants=kept, runs=tuple(run for run in self.runs if run.variant in kept))

    @functools.cached_property
    def finished(self) -> tuple[PlannedRun, ...]:
        """The runs that are done."""
        return tuple(run for run in self.runs if run.directory.is_finished(generations=run.generations))

    def of(self, condition: str, variant: str) -> tuple[PlannedRun, ...]:
        """Finished runs of one variant in one condition, in the order of their seeds."""
        return tuple(run for run in self.finished if (run.condition, run.variant) == (condition, variant))

    def require(self, condition: str, variants: Iterable[str]) -> None:
        """Check that every one of `variants` has a finished run in `condition`.

        Raises:
            MissingRunsError: one has none.
        """
        missing = [self.variants[variant] for variant in variants if not self.of(condition, variant)]
        if missing:
            what = f"{self.experiment}, {condition}, budget {self.budget}: no finished run of {', '.join(missing)}"
            raise MissingRunsError(f"{what}\n  {self.command}")

    def history(self, condition: str, variant: str) -> pd.DataFrame:
        """history.csv of all finished runs, one under another, with a column ``seed``; may be empty."""
        return _stacked(
            [(run, read_csv(run.directory.history, HISTORY_COLUMNS)) for run in self.of(condition, variant)]
        )

    def robustness(self, condition: str, variant: str) -> pd.DataFrame:
        """The planned rows of robustness.csv of all finished runs, with a column ``seed``; may be empty.

        Rows that somebody tested besides, at other levels or with other numbers of episodes, are left out.
        """
        runs = [run for run in self.of(condition, variant) if run.directory.robustness.exists()]
        table = _stacked([(run, read_csv(run.directory.robustness, RobustnessRow._fields)) for run in runs])
        return table if table.empty else table[self._is_planned(table)].reset_index(drop=True)

    def _is_planned(self, table: pd.DataFrame) -> pd.Series[bool]:
        planned = pd.Series(True, index=table.index)
        if self.sweep_episodes is not None:
            planned &= table["episodes"] == self.sweep_episodes
        if self.levels is not None:
            wanted = {(sweep, float(level)) for sweep, levels in self.levels.items() for level in levels}
            keys = zip(table["parameter"], table["level"].astype(float), strict=True)
            planned &= pd.Series([key in wanted for key in keys], index=table.index)
        return planned

    def results(self, condition: str, variant: str) -> pd.DataFrame:
        """One row per finished run: seed, training (final best so far), validation, test, full_reward."""
        rows = [{"seed": run.seed, **_result(run.directory.read_result())} for run in self.of(condition, variant)]
        return pd.DataFrame(rows, columns=["seed", "training", "validation", "test", "full_reward"])


def _result(result: Result) -> dict[str, float]:
    return {
        "training": float("nan") if result.training is None else result.training,
        "validation": float("nan") if result.validation is None else result.validation,
        "test": result.champion.fitness_mean,
        "full_reward": result.champion.full_reward_mean,
    }


def _stacked(tables: list[tuple[PlannedRun, pd.DataFrame]]) -> pd.DataFrame:
    if not tables:
        return pd.DataFrame()
    return pd.concat([table.assign(seed=run.seed) for run, table in tables], ignore_index=True)
