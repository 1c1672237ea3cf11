"""Published runs: one CSV per experiment, one row per run, from which tables and curves are made without training.

docs/run-directory.md says what the columns hold. Rows are written by `exneat sweep ... publish=true` and never by hand.
"""

from __future__ import annotations

import contextlib
import csv
import fcntl
import io
import os
from collections.abc import Callable, Collection, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from exneat_cli.errors import ExneatError
from exneat_cli.records.files import make_directory, read_text
from exneat_cli.records.plain import Count, Real, Word, converted
from exneat_cli.records.run_directory import RunDirectory
from exneat_cli.records.tables import read_cells, read_robustness, write_csv


class PublishedRun(NamedTuple):
    """The figures of one finished run; a field is None if the run has no such figure, as a baseline has no training."""

    condition: Word
    variant: Word
    seed: Count
    budget: Word
    configuration_hash: Word
    generations: Count
    episodes: Count | None
    env_steps: Count | None
    wall_seconds: Real | None
    training: Real | None
    validation: Real | None
    test_episodes: Count
    test_mean: Real
    test_std: Real
    full_reward_mean: Real
    full_reward_std: Real
    curve: str | None
    sweep_episodes: Count | None
    robustness: str | None
    commit: str | None
    processor: str | None
    versions: str | None

    @property
    def place(self) -> tuple[str, str, int, str]:
        """What identifies a row: condition, variant, seed and budget."""
        return self.condition, self.variant, self.seed, self.budget

    @property
    def best_so_far(self) -> list[float]:
        """The training curve, one value per generation."""
        return [float(value) for value in (self.curve or "").split()]

    @property
    def levels(self) -> list[tuple[str, float, float, float]]:
        """Sweep, level, mean fitness and mean full reward of each level that was tested."""
        found = []
        for entry in (self.robustness or "").split():
            sweep, _, figures = entry.partition("=")
            level, fitness, *full_reward = map(float, figures.split(":"))
            found.append((sweep, level, fitness, *(full_reward or [fitness])))
        return found  # type: ignore[return-value]


def published_run(
    directory: RunDirectory,
    place: tuple[str, str, str],
    levels: Collection[tuple[str, float]] = (),
    sweep_episodes: int | None = None,
) -> PublishedRun:
    """The row of a finished run; `place` names its condition, variant and budget.

    Of its robustness, the row holds those (sweep, level) in `levels` that were tested in `sweep_episodes` episodes.

    Raises:
        ExneatError: a file of the run is missing or damaged, or it is not finished.
    """
    condition, variant, budget = place
    manifest, result = directory.read_manifest(), directory.read_result()
    test, spent = result.champion, manifest.budget_spent
    tested = [
        f"{row.parameter}={row.level!r}:{row.fitness_mean!r}"
        + (f":{row.full_reward_mean!r}" if row.full_reward_mean != row.fitness_mean else "")
        for row in read_robustness(directory.robustness)
        if (row.parameter, row.level) in levels and row.episodes == sweep_episodes
    ]
    return PublishedRun(
        condition=condition,
        variant=variant,
        seed=manifest.seed,
        budget=budget,
        configuration_hash=manifest.configuration_hash,
        generations=manifest.generations,
        episodes=_whole(spent.get("episodes")),
        env_steps=_whole(spent.get("env_steps")),
        wall_seconds=spent.get("wall_seconds"),
        training=result.training,
        validation=result.validation,
        test_episodes=test.episodes,
        test_mean=test.fitness_mean,
        test_std=test.fitness_std,
        full_reward_mean=test.full_reward_mean,
        full_reward_std=test.full_reward_std,
        curve=" ".join(_best_so_far(directory.history)) or None,
        sweep_episodes=sweep_episodes if tested else None,
        robustness=" ".join(tested) or None,
        commit=manifest.git_commit,
        processor=manifest.processor or None,
        versions="; ".join(f"{name} {version}" for name, version in manifest.versions.items()) or None,
    )


def _whole(value: float | None) -> int | None:
    return None if value is None else int(value)


def _best_so_far(history: Path) -> list[str]:
    if not history.exists():
        return []
    try:
        return [row["best_so_far"] for row in csv.DictReader(io.StringIO(read_text(history)))]
    except (csv.Error, KeyError) as error:
        raise ExneatError(f"{history}: damaged: expected a column best_so_far, got {error}") from error


def read_published(path: Path) -> list[PublishedRun]:
    """All rows; none if the file is not there.

    Raises:
        ExneatError: the file is damaged.
    """
    cells = [[cell or None for cell in row] for row in read_cells(path, PublishedRun._fields)]
    return converted(cells, list[PublishedRun], f"{path}: damaged, at [row][column]", strict=False)


def publish(path: Path, rows: Sequence[PublishedRun], order: Callable[[PublishedRun], Any]) -> None:
    """Add rows to a file, which is created if needed and sorted by `order`; a row replaces the old one of its place.

    Several processes may publish at once: each waits for its turn. Rows that are there already change nothing.

    Raises:
        ExneatError: the file is damaged, or cannot be written.
    """
    make_directory(path.parent)
    with _taking_turns(path.parent):
        before = read_published(path)
        merged = {row.place: row for row in (*before, *rows)}
        if list(merged.values()) != before or not path.exists():
            in_order: list[PublishedRun] = sorted(merged.values(), key=order)
            write_csv(path, PublishedRun._fields, in_order)


@contextlib.contextmanager
def _taking_turns(directory: Path) -> Iterator[None]:
    try:
        descriptor = os.open(directory, os.O_RDONLY | os.O_DIRECTORY)
    except OSError as error:
        raise ExneatError(f"{directory}: cannot be opened: {error.strerror}") from error
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    except OSError as error:
        raise ExneatError(f"{directory}: cannot be locked: {error.strerror}") from error
    finally:
        os.close(descriptor)
