"""`python -m tests.bench`: measures, prints one table and writes outputs/bench/ant_speed.csv.

Figures decide nothing: the exit code is 0 unless two sides that should do the same did not, or a
process failed.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

from exneat_cli.records import provenance
from tests.bench.bare_physics import compare_with_bare_physics
from tests.bench.gymnasium_loop import compare_with_gymnasium
from tests.bench.measurement import Row, VerificationError
from tests.bench.processes import measure_help, measure_memory, measure_smoke_training
from tests.bench.table import print_table, write_table
from tests.bench.two_threads import compare_threads, usable_cores
from tests.bench.workload import find_workload

TABLE = Path("outputs") / "bench" / "ant_speed.csv"
SINGLE_THREAD_EPISODES = 4
THREADED_EPISODES = 16


def main() -> int:
    """Run the benchmark; returns the exit code."""
    options = _options()
    versions = ", ".join(f"{name} {version}" for name, version in provenance.versions().items())
    print(f"{provenance.processor()}, {usable_cores()} cores; {versions}\n", flush=True)
    try:
        rows = _measure(options.repetitions, full=options.full)
    except VerificationError as error:
        print(f"bench: {error}", file=sys.stderr)
        return 1
    print_table(rows)
    write_table(TABLE, rows)
    print(f"\nRatios: both sides in one process, taking turns. Written: {TABLE}")
    return 0


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tests.bench", description=__doc__)
    parser.add_argument("--full", action="store_true", help="measure memory over the whole quick budget")
    parser.add_argument("--repetitions", type=_at_least_one, default=11, help="pairs of runs per ratio (default 11)")
    return parser.parse_args()


def _at_least_one(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"expected a whole number of at least 1, got {text!r}")
    return int(text)


def _measure(repetitions: int, *, full: bool) -> list[Row]:
    _say("looking for random networks that keep upright")
    many = find_workload(THREADED_EPISODES)
    few = many.first(SINGLE_THREAD_EPISODES)
    parts: dict[str, Callable[[], tuple[Row, ...]]] = {
        "bare physics": lambda: (compare_with_bare_physics(few, repetitions),),
        "two threads": lambda: (compare_threads(many, repetitions),),
        "Gymnasium": lambda: (compare_with_gymnasium(few, repetitions),),
        "exneat --help": lambda: (measure_help(),),
        "smoke training": measure_smoke_training,
        "memory": lambda: (measure_memory(full=full),),
    }
    rows: list[Row] = []
    for name, measure in parts.items():
        _say(f"measuring: {name}")
        rows += measure()
    return rows


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
