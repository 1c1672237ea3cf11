"""How a run reports its progress: a live bar on a terminal, a line now and then elsewhere."""

from __future__ import annotations

import contextlib
import sys
import threading
import time
from collections.abc import Callable
from datetime import timedelta
from typing import TYPE_CHECKING, TextIO

from exneat_cli.compiling import announcing, seconds_compiled
from exneat_cli.records import HistoryRow

if TYPE_CHECKING:  # rich is loaded only where a bar is drawn
    from rich.console import Console
    from rich.progress import Progress as Bar

LONGEST_SILENCE = 30.0
"""Seconds after which a log gets a line, whatever the run is doing."""


class Progress:
    """The progress of a run: about ten plain lines and at least one per half minute, or a bar with the latest figures.

    Times per generation and times left do not include compilation, which happens once.

    Args:
        stream: where the lines go; None, the default from Python, prints nothing.
        bar: shown instead of the lines.
        tenths: whether to print a line after every tenth of the run and for each later stage.
        doing: says what is going on when there was no line for a while; by default, the part of the run.
    """

    def __init__(
        self,
        stream: TextIO | None = None,
        bar: Bar | None = None,
        *,
        tenths: bool = True,
        doing: Callable[[], str] | None = None,
    ) -> None:
        self._stream, self._bar, self._tenths = stream, bar, tenths
        self._title, self._unit, self._total, self._done = "", "", 0, 0
        self._began = self._spoke = time.perf_counter()
        self._doing = doing or self._part
        self._compiled_before, self._has_compiled = 0.0, False
        self._stage, self._ending = "", contextlib.ExitStack()
        self._before: int | None = None  # how much a resumed run had done before the start

    def start(self, title: str, total: int, unit: str = "generation") -> None:
        """Begin a training, or a test, of `total` units; the title is printed before every line, or above the bar."""
        self._title, self._unit, self._total, self._done = title, unit, total, 0
        self._began, self._compiled_before = time.perf_counter(), seconds_compiled()
        self._stage, self._before = "", None
        self._ending.enter_context(announcing(self._compiling))
        if self._bar:
            self._bar.console.print(title, highlight=False)
            for task in self._bar.task_ids:
                self._bar.remove_task(task)
            self._task = self._bar.add_task("", total=total, figures="", left="")
            self._bar.start()
            self._ending.callback(self._bar.stop)
        elif self._stream:
            over = threading.Event()
            ticking = threading.Thread(target=self._tick, args=(over,), daemon=True)
            ticking.start()
            self._ending.callback(ticking.join)
            self._ending.callback(over.set)

    def say(self, text: str) -> None:
        """Print a line."""
        self._spoke = time.perf_counter()
        if self._bar:
            self._bar.console.print(text, highlight=False)
        elif self._stream:
            print(f"{self._title}: {text}" if self._title else text, file=self._stream, flush=True)

    def stage(self, text: str) -> None:
        """Report what happens from now on if it is not one of the counted units."""
        self._stage = text
        if self._tenths:
            self.say(text)

    def generation(self, row: HistoryRow) -> None:
        """Count a generation that is done."""
        number = row["generation"]
        figures = "best {best_fitness:.4g}  mean {mean_fitness:.4g}  so far {best_so_far:.4g}".format_map(row)
        self.advance(int(number), figures)

    def advance(self, number: int, figures: str) -> None:
        """Move the bar, or print a line after every tenth, at the end, and after a long silence."""
        self._done, self._stage = number, ""
        self._before = number - 1 if self._before is None else self._before
        compiled = seconds_compiled() - self._compiled_before
        each = (time.perf_counter() - self._began - compiled) / (number - self._before)
        left = f"{timedelta(seconds=round(each * (self._total - number)))} left"
        if self._bar:
            self._bar.update(self._task, completed=number, figures=figures, left=left)
            return
        is_tenth = number % max(1, self._total // 10) == 0 or number == self._total
        if (is_tenth and self._tenths) or time.perf_counter() - self._spoke >= LONGEST_SILENCE:
            self.say(f"{self._unit} {number}/{self._total}  {figures}  {each:.2f} s each, {left}")

    def stop(self) -> None:
        """End the report, whether or not all went well."""
        self._ending.close()

    def _compiling(self, is_cached: bool) -> None:
        if not self._has_compiled:
            self._has_compiled, self._stage = True, "compiling"
            how_often = "once per version of exneat and kind of task" if is_cached else "in every process"
            self.say(f"compiling, {how_often}: this can take a minute")

    def _part(self) -> str:
        return self._stage or f"{self._unit} {min(self._done + 1, self._total)}/{self._total}"

    def _tick(self, over: threading.Event) -> None:
        while not over.wait(max(0.01, self._spoke + LONGEST_SILENCE - time.perf_counter())):
            if time.perf_counter() - self._spoke >= LONGEST_SILENCE:
                since = timedelta(seconds=round(time.perf_counter() - self._began))
                self.say(f"{self._doing()}, still running, {since} since the start")


def bar_on(console: Console) -> Bar:
    """A bar that shows its counter and times on any terminal, and cuts off figures that do not fit."""
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bar
    from rich.table import Column

    return Bar(
        MofNCompleteColumn(),
        BarColumn(bar_width=12),
        TimeElapsedColumn(),
        TextColumn("{task.fields[left]}"),
        TextColumn("{task.fields[figures]}", table_column=Column(ratio=1, no_wrap=True, overflow="ellipsis")),
        console=console,
        expand=True,
    )


def progress_for_terminal(*, tenths: bool = True) -> Progress:
    """A bar if standard error is a terminal, else lines on it."""
    if not sys.stderr.isatty():
        return Progress(sys.stderr, tenths=tenths)
    from rich.console import Console

    return Progress(bar=bar_on(Console(stderr=True)))
