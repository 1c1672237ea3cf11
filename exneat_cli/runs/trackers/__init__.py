"""Following runs in other tools: a tracker gets the rows of history.csv as they are written, the result and figures.

Each tool has a file here, the only one that imports its library, loaded when a run asks for it. A tracker that fails
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

_HALF = 120  # characters


class Tracker(Protocol):
    """One run in one tool, in the same place whenever the run is resumed."""

    def __init__(self, run: RunDirectory, settings: Mapping[str, Any], history: Sequence[HistoryRow]) -> None:
        """Begin with the settings of the run and its rows so far; in the end, the tool has each row once."""

    def generation(self, row: HistoryRow) -> None:
        """Add the row of a generation, which is its step."""

    def result(self, figures: Mapping[str, float]) -> None:
        """Add the run's results in validation and test."""

    def pictures(self, paths: Sequence[Path]) -> None:
        """Add figures (PNG) and films (MP4) under the names of their files."""

    def close(self) -> None:
        """End, with everything written."""


class Tracking:
    """All trackers of a run; one that fails is named once and left out from then on."""

    def __init__(self, names: Sequence[str]) -> None:
        self._names, self._title = names, ""
        self._trackers: dict[str, Tracker] = {}

    def begin(self, run: RunDirectory, settings: Mapping[str, Any], history: Sequence[HistoryRow]) -> None:
        """Begin or continue the run in this directory, which has this `history` so far."""
        self._title = run.path.name
        for name in self._names:
            with self._forgiving(name):
                made: Callable[..., Tracker] = importlib.import_module(f"exneat_cli.runs.trackers.{name}").OneRun
                self._trackers[name] = made(run, settings, history)

    def generation(self, row: HistoryRow) -> None:
        """Report a finished generation."""
        self._each(lambda tracker: tracker.generation(row))

    def result(self, result: Result) -> None:
        """Report the result of the run."""
        figures = {
            key.replace(".", "/"): float(value)
            for key, value in dotted(msgspec.to_builtins(result)).items()
            if isinstance(value, int | float)
        }
        self._each(lambda tracker: tracker.result(figures))

    def pictures(self, run: RunDirectory) -> None:
        """Report all figures and films; none if the run was found finished."""
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
            if len(why) > 2 * _HALF:  # a message begins with what went wrong, and ends with why
                why = f"{why[:_HALF]} ... {why[-_HALF:]}"
            print(f"exneat: {self._title}: tracker={name} gave up, the run goes on: {why}", file=sys.stderr)


def check_trackers(names: Sequence[str]) -> None:
    """Refuse to begin without the library of a tracker.

    Raises:
        ExneatError: one is not installed.
    """
    for name in names:
        if find_spec(name) is None:
            why = f"tracker={name}: expected the library {name}, which is not installed"
            raise ExneatError(f"{why}\n  pip install 'exneat[{name}]', or tracker=none")


@contextmanager
def tracked(names: Sequence[str]) -> Iterator[Tracking]:
    """The trackers of these names, which are closed at the end of the block, however it ends."""
    tracking = Tracking(names)
    try:
        yield tracking
    finally:
        tracking.close()
