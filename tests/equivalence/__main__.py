"""`python -m tests.equivalence`: 70 seeds of each kind of genome on each condition; about 15 minutes on two cores.

Prints one line per condition and writes them to outputs/equivalence/. The exit code is 1 if equivalence was not shown.
"""

from __future__ import annotations

import argparse
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from exneat_cli.records import write_csv
from exneat_cli.records.files import make_directory
from tests.equivalence.conditions import CONDITIONS
from tests.equivalence.equivalence import MARGIN, Equivalence, compare

FOLDER = Path("outputs") / "equivalence"
SEEDS = range(1000, 1070)
"""Never used for a reported comparison of variants."""


def main() -> int:
    """Run the study; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m tests.equivalence", description=__doc__)
    parser.add_argument("--processes", type=int, default=2, help="runs side by side (default 2)")
    options = parser.parse_args()
    make_directory(FOLDER)
    results: dict[str, Equivalence] = {}
    finals = []
    with ProcessPoolExecutor(options.processes) as pool:
        for name in CONDITIONS:
            jobs = {kind: [pool.submit(_final, name, kind, seed) for seed in SEEDS] for kind in ("array", "stock")}
            reached = {kind: [job.result() for job in own] for kind, own in jobs.items()}
            finals += [(name, kind, *pair) for kind in reached for pair in zip(SEEDS, reached[kind], strict=True)]
            results[name] = compare(reached["array"], reached["stock"])
            print(_sentence(name, results[name]), flush=True)
    write_csv(FOLDER / "final_fitness.csv", ("condition", "genome", "seed", "fitness"), finals)
    rows = [(name, *result, result.shown) for name, result in results.items()]
    write_csv(FOLDER / "equivalence.csv", ("condition", *Equivalence._fields, "shown"), rows)
    return 0 if all(result.shown for result in results.values()) else 1


def _final(name: str, kind: str, seed: int) -> float:
    return CONDITIONS[name](kind, seed)


def _sentence(name: str, result: Equivalence) -> str:
    means = f"array {result.array_mean:.4f}, stock {result.stock_mean:.4f} (sd {result.stock_sd:.4f})"
    interval = f"difference {result.low:+.2f} to {result.high:+.2f} sd, margin {MARGIN:g}"
    verdict = "equivalent" if result.shown else "equivalence not shown"
    return f"{name}, {result.seeds} seeds each: {means}; {interval}, p = {result.p:.4f}: {verdict}"


if __name__ == "__main__":
    sys.exit(main())
