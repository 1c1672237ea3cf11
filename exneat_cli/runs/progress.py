"""How a run tells what it is doing: a live bar on a terminal, a line now and then elsewhere."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, TextIO

from exneat_cli.records import HistoryRow

if TYPE_CHECKING:  # rich is loaded only where a bar is drawn
    from rich.progress import Progress as Bar


class Progress:
    """What a training tells: about ten plain lines per run, or a bar with the last figures and the time left.

    Args:
        stream: where the lines go; without it nothing is said, which is the default from Python.
        bar: stands in for the lines.
    """

    def __init__(self, stream: TextIO | None = None, bar: Bar | None = None) -> None:
        self._stream, self._bar = stream, bar
        self._title, self._generations = "", 1

    def start(self, title: str, generations: int) -> None:
        """Begin a training; the title stands before every line, or beside the bar."""
        self._title, self._generations = title, generations
        if self._bar:
            self._task = self._bar.add_task(title, total=generations, figures="")
            self._bar.start()

    def say(self, text: str) -> None:
        """Print something that is worth a line."""
        if self._bar:
            self._bar.console.print(text, highlight=False)
        elif self._stream:
            print(f"{self._title}: {text}" if self._title else text, file=self._stream, flush=True)

    def generation(self, row: HistoryRow) -> None:
        """Move the bar; or print every tenth part of the run, and the last generation."""
        number = row["generation"]
        figures = "best {best_fitness:.4g}  mean {mean_fitness:.4g}  best so far {best_so_far:.4g}".format_map(row)
        if self._bar:
            self._bar.update(self._task, completed=number, figures=figures)
        elif number % max(1, self._generations // 10) == 0 or number == self._generations:
            each = row["wall_seconds"] / number
            self.say(f"generation {number}/{self._generations}  {figures}  {each:.2f} s each")

    def stop(self) -> None:
        """End the training, whether it went well or not."""
        if self._bar:
            self._bar.stop()


def progress_for_terminal() -> Progress:
    """A bar if standard error is a terminal, else lines on it."""
    if not sys.stderr.isatty():
        return Progress(sys.stderr)
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
    from rich.progress import Progress as Bar

    return Progress(
        bar=Bar(
            TextColumn("{task.description}"),
            BarColumn(bar_width=24),
            MofNCompleteColumn(),
            TextColumn("{task.fields[figures]}"),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
            console=Console(stderr=True),
        )
    )
