"""`python -m tests.bench`: measures, prints one table per part and writes each to outputs/bench/.

Figures decide nothing: the exit code is 0 unless two sides that should do the same did not, or a
process failed.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

from exneat_cli.records import provenance
from tests.bench.bare_physics import compare_with_bare_physics
from tests.bench.grid_worlds import (
    PAPER_ALGORITHMS,
    PAPER_TASKS,
    compare_general_maze,
    compare_hunting,
    measure_paper_training,
)
from tests.bench.gymnasium_loop import compare_with_gymnasium
from tests.bench.measurement import Row, VerificationError
from tests.bench.processes import measure_help, measure_memory, measure_smoke_training
from tests.bench.table import print_table, write_table
from tests.bench.two_threads import compare_threads, usable_cores
from tests.bench.workload import find_workload

FOLDER = Path("outputs") / "bench"
SINGLE_THREAD_EPISODES = 4
THREADED_EPISODES = 16


def main() -> int:
    """Run the benchmark; returns the exit code."""
    options = _options()
    parts = {"ant": (_measure_ant, "ant_speed.csv"), "grid": (_measure_grid_worlds, "grid_worlds.csv")}
    versions = ", ".join(f"{name} {version}" for name, version in provenance.versions().items())
    print(f"{provenance.processor()}, {usable_cores()} cores; {versions}", flush=True)
    for name in [options.only] if options.only else parts:
        measure, table = parts[name]
        try:
            rows = measure(options)
        except VerificationError as error:
            print(f"bench: {error}", file=sys.stderr)
            return 1
        print()
        print_table(rows)
        write_table(FOLDER / table, rows)
        print(f"\nRatios: both sides in one process, taking turns. Written: {FOLDER / table}", flush=True)
    return 0


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tests.bench", description=__doc__)
    parser.add_argument("--only", choices=("ant", "grid"), help="measure this part alone")
    parser.add_argument("--full", action="store_true", help="ant: measure memory over the whole quick budget")
    parser.add_argument("--skip-paper", action="store_true", help="grid: leave out the trainings of the paper budget")
    parser.add_argument("--repetitions", type=_at_least_one, default=11, help="pairs of runs per ratio (default 11)")
    return parser.parse_args()


def _at_least_one(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"expected a whole number of at least 1, got {text!r}")
    return int(text)


def _measure_ant(options: argparse.Namespace) -> list[Row]:
    _say("looking for random networks that keep upright")
    many = find_workload(THREADED_EPISODES)
    few = many.first(SINGLE_THREAD_EPISODES)
    repetitions: int = options.repetitions
    return _measure(
        {
            "bare physics": lambda: (compare_with_bare_physics(few, repetitions),),
            "two threads": lambda: (compare_threads(many, repetitions),),
            "Gymnasium": lambda: (compare_with_gymnasium(few, repetitions),),
            "exneat --help": lambda: (measure_help(),),
            "smoke training": measure_smoke_training,
            "memory": lambda: (measure_memory(full=options.full),),
        }
    )


def _measure_grid_worlds(options: argparse.Namespace) -> list[Row]:
    repetitions: int = options.repetitions
    pieces: dict[str, Callable[[], tuple[Row, ...]]] = {
        "general maze": lambda: (compare_general_maze(repetitions),),
        "hunting": lambda: (compare_hunting(repetitions),),
    }
    if not options.skip_paper:
        arms = [(task, algorithm) for task in PAPER_TASKS for algorithm in PAPER_ALGORITHMS]
        pieces |= {f"paper budget, {task}, {name}": partial(_paper_row, task, name) for task, name in arms}
    return _measure(pieces)


def _paper_row(task: str, algorithm: str) -> tuple[Row]:
    return (measure_paper_training(task, algorithm),)


def _measure(pieces: Mapping[str, Callable[[], tuple[Row, ...]]]) -> list[Row]:
    rows: list[Row] = []
    for name, measure in pieces.items():
        _say(f"measuring: {name}")
        rows += measure()
    return rows


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
