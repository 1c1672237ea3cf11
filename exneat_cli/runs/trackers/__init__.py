"""Following runs in other tools: a tracker is told the rows of history.csv as they are written, the result and figures.

Each tool has a file here, which alone knows its library and is loaded when a run asks for it. What a tracker fails at
costs a line, never the run.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Protocol

import msgspec

from exneat_cli.errors import ExneatError
from exneat_cli.records import HistoryRow, Result, RunDirectory, dotted

TRACKERS = ("tensorboard", "wandb", "mlflow")
"""What ``tracker=`` may be, each with a file, a library and an extra of that name."""

_HALF = 120  # letters


class Tracker(Protocol):
    """One run in one tool, in the same place whenever the run is gone on with."""

    def __init__(self, run: RunDirectory, settings: Mapping[str, Any], history: Sequence[HistoryRow]) -> None:
        """Begin with the settings of the run and the rows that it has by now; each row is there once in the end."""

    def generation(self, row: HistoryRow) -> None:
        """Add the row of a generation, which is its step."""

    def result(self, figures: Mapping[str, float]) -> None:
        """Add what came of the run in validation and test."""

    def pictures(self, paths: Sequence[Path]) -> None:
        """Add figures (PNG) and films (MP4) by the names of their files."""

    def close(self) -> None:
        """End, with all written."""


class Tracking:
    """All trackers of a run, told together; one that fails is named once and told nothing more."""

    def __init__(self, names: Sequence[str]) -> None:
        self._names, self._title = names, ""
        self._trackers: dict[str, Tracker] = {}

    def begin(self, run: RunDirectory, settings: Mapping[str, Any], history: Sequence[HistoryRow]) -> None:
        """Begin, or go on with, the run in this directory, of which `history` is there."""
        self._title = run.path.name
        for name in self._names:
            with self._forgiving(name):
                made: Callable[..., Tracker] = importlib.import_module(f"exneat_cli.runs.trackers.{name}").OneRun
                self._trackers[name] = made(run, settings, history)

    def generation(self, row: HistoryRow) -> None:
        """Tell of a generation that is done."""
        self._each(lambda tracker: tracker.generation(row))

    def result(self, result: Result) -> None:
        """Tell what came of the run."""
        figures = {
            key.replace(".", "/"): float(value)
            for key, value in dotted(msgspec.to_builtins(result)).items()
            if isinstance(value, int | float)
        }
        self._each(lambda tracker: tracker.result(figures))

    def pictures(self, run: RunDirectory) -> None:
        """Tell of all that was drawn and filmed; nothing where the run was found finished."""
        paths = [path for kind in ("png", "mp4") for path in sorted(run.plots.glob(f"*.{kind}"))]
        self._each(lambda tracker: tracker.pictures(paths))

    def close(self) -> None:
        """End all of them."""
        self._each(lambda tracker: tracker.close())

    def _each(self, tell: Callable[[Tracker], None]) -> None:
        for name, tracker in list(self._trackers.items()):
            with self._forgiving(name):
                tell(tracker)

    @contextmanager
    def _forgiving(self, name: str) -> Iterator[None]:
        try:
            yield
        except Exception as error:  # of a library that talks to a server, or of a disk
            self._trackers.pop(name, None)
            why = (str(error).strip() or type(error).__name__).splitlines()[0]
            if len(why) > 2 * _HALF:  # what went wrong stands at the beginning, and why at the end
                why = f"{why[:_HALF]} ... {why[-_HALF:]}"
            print(f"exneat: {self._title}: tracker={name} gave up, the run goes on: {why}", file=sys.stderr)


def check_trackers(names: Sequence[str]) -> None:
    """Refuse to begin where the library of a tracker is not installed.

    Raises:
        ExneatError: that is so.
    """
    for name in names:
        if find_spec(name) is None:
            why = f"tracker={name}: expected the library {name}, which is not installed"
            raise ExneatError(f"{why}\n  pip install 'exneat[{name}]', or tracker=none")


@contextmanager
def tracked(names: Sequence[str]) -> Iterator[Tracking]:
    """Trackers by their names, which are closed at the end of the block, however it ends."""
    tracking = Tracking(names)
    try:
        yield tracking
    finally:
        tracking.close()
