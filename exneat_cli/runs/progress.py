"""How a run tells what it is doing: a live bar on a terminal, a line now and then elsewhere."""

from __future__ import annotations

import sys
from typing import TextIO

from exneat_cli.records import HistoryRow


class Progress:
    """What a training tells: about ten plain lines per run.

    Args:
        stream: where the lines go; without it nothing is said, which is the default from Python.
    """

    def __init__(self, stream: TextIO | None = None) -> None:
        self._stream = stream
        self._title = ""
        self._generations = 1

    def start(self, title: str, generations: int) -> None:
        """Begin a training; the title stands before every line."""
        self._title, self._generations = title, generations

    def say(self, text: str) -> None:
        """Print something that is worth a line."""
        if self._stream is not None:
            print(f"{self._title}: {text}" if self._title else text, file=self._stream, flush=True)

    def generation(self, row: HistoryRow) -> None:
        """Print every tenth part of the run, and the last generation."""
        number = row["generation"]
        if number % max(1, self._generations // 10) == 0 or number == self._generations:
            each = row["wall_seconds"] / number
            self.say(f"generation {number}/{self._generations}  {_figures(row)}  {each:.2f} s each")

    def stop(self) -> None:
        """End the training, whether it went well or not."""


class Bar(Progress):
    """A live bar with the figures of the last generation and the time left."""

    def __init__(self) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
        from rich.progress import Progress as RichProgress

        self._bar = RichProgress(
            TextColumn("{task.description}"),
            BarColumn(bar_width=24),
            MofNCompleteColumn(),
            TextColumn("{task.fields[figures]}"),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
            console=Console(stderr=True),
        )

    def start(self, title: str, generations: int) -> None:
        """Show the empty bar."""
        self._task = self._bar.add_task(title, total=generations, figures="")
        self._bar.start()

    def say(self, text: str) -> None:
        """Print the line above the bar."""
        self._bar.console.print(text, highlight=False)

    def generation(self, row: HistoryRow) -> None:
        """Move on by one."""
        self._bar.update(self._task, completed=row["generation"], figures=_figures(row))

    def stop(self) -> None:
        """Leave the bar as it is."""
        self._bar.stop()


def progress_for_terminal() -> Progress:
    """A bar if standard error is a terminal, else lines on it."""
    return Bar() if sys.stderr.isatty() else Progress(sys.stderr)


def _figures(row: HistoryRow) -> str:
    return f"best {row['best_fitness']:.4g}  mean {row['mean_fitness']:.4g}  best so far {row['best_so_far']:.4g}"
