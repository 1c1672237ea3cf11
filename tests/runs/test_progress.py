"""What a log gets to see."""

from __future__ import annotations

import io
import time

import numba
import pytest
from numba.core import event
from rich.console import Console

from exneat_cli.records import HistoryRow
from exneat_cli.runs import Progress
from exneat_cli.runs.progress import bar_on


def row(generation: int) -> HistoryRow:
    return {"generation": generation, "best_fitness": -12.34, "mean_fitness": 1234.5, "best_so_far": 12.34}


def test_a_log_gets_about_ten_lines_and_always_the_last_generation() -> None:
    stream = io.StringIO()
    lines = Progress(stream)
    lines.start("neat-s0", 95)
    for generation in range(1, 96):
        lines.generation(row(generation))
    lines.stop()
    written = stream.getvalue().splitlines()
    assert 9 <= len(written) <= 12
    assert written[-1].startswith("neat-s0: generation 95/95  best -12.34  mean 1234  so far 12.34  0.0")


def test_a_log_gets_a_line_where_nothing_ends_for_long(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("exneat_cli.runs.progress.LONGEST_SILENCE", 0.02)
    stream = io.StringIO()
    lines = Progress(stream)
    lines.start("neat-s0", 95)
    while "generation 1/95, still running" not in stream.getvalue():
        time.sleep(0.01)
    lines.generation(row(1))
    lines.stage("validating 7 teams")
    while "validating 7 teams, still running" not in stream.getvalue():
        time.sleep(0.01)
    lines.stop()


def test_compiling_is_announced_once_and_is_no_part_of_the_time_that_generations_take(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    stream, now = io.StringIO(), [0.0]
    monkeypatch.setattr(time, "perf_counter", lambda: now[0])
    lines = Progress(stream)
    lines.start("neat-s0", 3)
    for _ in range(2):

        @numba.njit
        def added(x: int) -> int:
            return x + 1

        compilation = event.Event("numba:compile", event.EventStatus.START, {"dispatcher": added})
        event.broadcast(compilation)
        now[0] += 25.0
        added(1)  # compiled amid another compilation
        event.broadcast(event.Event("numba:compile", event.EventStatus.END))
    now[0] += 1.0
    lines.generation(row(1))
    lines.stop()
    assert stream.getvalue().count("compiling, in every process") == 1
    assert "1.00 s each, 0:00:02 left" in stream.getvalue()


@pytest.mark.parametrize("width", [50, 80, 200])
def test_a_bar_keeps_its_counter_and_the_time_left_on_a_narrow_terminal(width: int) -> None:
    stream = io.StringIO()
    bar = Progress(bar=bar_on(Console(file=stream, width=width, force_terminal=True, color_system=None)))
    bar.start("exneat-a-rather-long-name-s0-123456", 1000)
    bar.generation(row(999))
    bar.stop()
    assert "exneat-a-rather-long-name-s0-123456" in stream.getvalue()
    last = [line for line in stream.getvalue().splitlines() if "999/1000" in line][-1]
    assert "0:00:00 left" in last
    assert ("best -12.34  mean 1234  so far 12.34" in last) == (width >= 80)
