"""Runs side by side: what they reached, and the settings in which they differ."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from exneat_cli.errors import ConfigError, ExneatError, nearest
from exneat_cli.records import NOT_HASHED, Manifest, RunDirectory, Score, dotted, read_yaml, write_csv

MOST_SETTINGS = 8
"""At most this many settings have a column on the screen; a CSV file has all of them."""
_OWN_COLUMNS = ("fitness", "seed", "status", "run")
_NOT_COMPARED = {*NOT_HASHED, "seed"} - {"generations"}
"""Settings without effect on results, and the seed, which always has a column."""
_Row = list[str]


@dataclass(frozen=True)
class ListedRun:
    """A run with its settings by dotted name; manifest and settings are empty if they cannot be read."""

    directory: RunDirectory
    status: str
    manifest: Manifest | None
    settings: Mapping[str, Any]

    @classmethod
    def read(cls, directory: RunDirectory) -> ListedRun:
        """Read as much of a run as can be read."""
        try:
            manifest = directory.read_manifest()
            settings = dotted(read_yaml(directory.config))
        except ExneatError:
            return cls(directory, "damaged", None, {})
        return cls(directory, directory.status(manifest), manifest, settings)

    @property
    def tested(self) -> Score | None:
        """The score of its champion on the test episodes."""
        return self.manifest.result.champion if self.manifest and self.manifest.result else None

    @property
    def fitness(self) -> float | None:
        """The mean fitness of its champion on the test episodes."""
        return self.tested.fitness_mean if self.tested else None

    @property
    def seed(self) -> int | None:
        """The root of its random streams."""
        return self.manifest.seed if self.manifest else None

    def value_of(self, column: str) -> Any:
        """The run's value in a column of the table, which is one that every run has or a setting."""
        if column in _OWN_COLUMNS:
            return str(self.directory.path) if column == "run" else getattr(self, column)
        return self.settings.get(column)


def differing(runs: Iterable[ListedRun]) -> list[str]:
    """Settings in which runs differ, in the order of config.yaml; a missing setting does not count as a value."""
    values: dict[str, set[str]] = {}
    for run in runs:
        for key, value in run.settings.items():
            if key.partition(".")[0] not in _NOT_COMPARED:
                values.setdefault(key, set()).add(_written(value))
    return [key for key, found in values.items() if len(found) > 1]


def sorted_runs(runs: Sequence[ListedRun], column: str) -> list[ListedRun]:
    """Runs in the order of a column, for fitness the best first; runs without a value come last.

    Raises:
        ConfigError: there is no such column.
    """
    key = _full_name(column, runs)
    have = [run for run in runs if run.value_of(key) is not None]
    numbers = all(isinstance(run.value_of(key), int | float) for run in have)
    in_order = sorted(
        have, key=lambda run: run.value_of(key) if numbers else _written(run.value_of(key)), reverse=key == "fitness"
    )
    return in_order + [run for run in runs if run.value_of(key) is None]


def _full_name(column: str, runs: Sequence[ListedRun]) -> str:
    """The full name of a column, of which the user may type the end of a setting's dotted name."""
    settings = dict.fromkeys(key for run in runs for key in run.settings)
    meant = [key for key in settings if key == column or key.endswith(f".{column}") or key == f"{column}.name"]
    if column in (*_OWN_COLUMNS, *meant[:1]):
        return column
    if len(meant) == 1:
        return meant[0]
    fix = f"did you mean {meant[0]}?" if meant else nearest(column, [*_OWN_COLUMNS, *settings])
    raise ConfigError("sort", f"{', '.join(_OWN_COLUMNS)} or a setting of these runs", column, fix)


def print_runs(runs: Sequence[ListedRun]) -> None:
    """Print a table for each folder, since runs in one folder are meant to be compared."""
    folders: dict[Path, list[ListedRun]] = {}
    for run in runs:
        folders.setdefault(run.directory.path.parent, []).append(run)
    for folder, members in sorted(folders.items()):
        if len(folders) > 1:
            print(f"{folder}:")
        keys = differing(members)
        shown, left_out = keys[:MOST_SETTINGS], keys[MOST_SETTINGS:]
        print_table(
            [["status", "seed", "test fitness", *_short_names(shown), "run"], *(_row(run, shown) for run in members)],
            numbers=(1, 2),
        )
        if left_out:
            print(f"They also differ in {', '.join(left_out)}; exneat inspect csv=FILE writes all of these.")
        if len(folders) > 1:
            print()


def _row(run: ListedRun, keys: Sequence[str]) -> _Row:
    figure = f"{run.tested.fitness_mean:.4g} (sd {run.tested.fitness_std:.3g})" if run.tested else "-"
    seed = "?" if run.seed is None else str(run.seed)
    settings = [_written(run.settings[key]) if key in run.settings else "-" for key in keys]
    return [run.status, seed, figure, *settings, str(run.directory.path)]


def _short_names(keys: Sequence[str]) -> list[str]:
    """The last part of dotted names (the section, for ``<section>.name``); the whole name where that is ambiguous."""
    short = [key.removesuffix(".name").rpartition(".")[2] for key in keys]
    return [name if short.count(name) == 1 else key for name, key in zip(short, keys, strict=True)]


def _written(value: object) -> str:
    return value if isinstance(value, str) else json.dumps(value)


def print_table(rows: Sequence[_Row], numbers: Sequence[int] = ()) -> None:
    """Print rows of cells, with the columns `numbers` aligned to the right; the first row is the heading."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        cells = [
            cell.rjust(w) if k in numbers else cell.ljust(w)
            for k, (cell, w) in enumerate(zip(row, widths, strict=True))
        ]
        print("  ".join(cells).rstrip())


def write_runs(path: Path, runs: Sequence[ListedRun]) -> None:
    """Write one table of all runs, with every setting in which any of them differ.

    Raises:
        ExneatError: the file cannot be written.
    """
    keys = differing(runs)
    columns = ("run", "status", "variant", "seed", "test_fitness", "test_sd", "test_episodes", *keys)
    rows = []
    for run in runs:
        tested, manifest = run.tested, run.manifest
        score = (tested.fitness_mean, tested.fitness_std, tested.episodes) if tested else ("", "", "")
        about = (manifest.variant, manifest.seed) if manifest else ("", "")
        settings = [_written(run.settings[key]) if key in run.settings else "" for key in keys]
        rows.append((run.directory.path, run.status, *about, *score, *settings))
    write_csv(path, columns, rows)
