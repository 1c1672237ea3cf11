"""Finding run directories."""

from __future__ import annotations

import os
from collections.abc import Callable
from glob import glob
from pathlib import Path

from exneat_cli.errors import ExneatError
from exneat_cli.records.run_directory import ABSENT, RunDirectory


def find_runs(output: Path, unreadable: Callable[[OSError], None] | None = None) -> list[RunDirectory]:
    """Every run in an output root or one of its folders, or the run that it is itself; in alphabetical order.

    `unreadable` is called for each folder that cannot be read; a root that does not exist has no runs.
    """

    def tell(error: OSError) -> None:
        if unreadable and error.errno not in ABSENT:
            unreadable(error)

    found: list[tuple[int, Path]] = []
    for place, folders, files in os.walk(output, onerror=tell, followlinks=True):
        path = Path(place)
        depth = len(path.relative_to(output).parts)
        folders[:] = [name for name in folders if depth < 2 and not name.startswith(".")]
        if "manifest.json" in files:
            found.append((depth, path))
    return [RunDirectory(path) for _, path in sorted(found)]


def runs_at(pattern: Path) -> list[RunDirectory]:
    """The runs whose directories match a pattern, in alphabetical order; a literal match takes precedence.

    Raises:
        ExneatError: a folder where runs may be cannot be read.
    """
    found = [Path()]
    for part in pattern.parts:
        literal = [path / part for path in found if os.path.lexists(path / part)]
        found = literal or [path / each for path in found for each in _fitting(path, part)]
    return [run for path in found if (run := RunDirectory(path)).is_there()]


def _fitting(folder: Path, part: str) -> list[str]:
    try:
        os.scandir(folder).close()  # `glob` would ignore its errors
    except OSError as error:
        if error.errno in ABSENT:
            return []
        raise ExneatError(f"{folder}: cannot be read: {error.strerror}") from error
    return sorted(glob(part, root_dir=folder))
