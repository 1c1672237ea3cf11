"""What a log gets to see."""

from __future__ import annotations

import io

from exneat_cli.records import HistoryRow
from exneat_cli.runs import Progress


def row(generation: int) -> HistoryRow:
    figures = {"best_fitness": 12.34, "mean_fitness": 5.0, "best_so_far": 12.34}
    return {"generation": generation, **figures, "wall_seconds": 2.0 * generation}


def test_a_log_gets_about_ten_lines_and_always_the_last_generation() -> None:
    stream = io.StringIO()
    lines = Progress(stream)
    lines.start("neat-s0", 95)
    for generation in range(1, 96):
        lines.generation(row(generation))
    lines.stop()
    written = stream.getvalue().splitlines()
    assert 9 <= len(written) <= 12
    assert written[-1] == "neat-s0: generation 95/95  best 12.34  mean 5  best so far 12.34  2.00 s each"
