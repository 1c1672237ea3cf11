"""`python -m tests.torture`: faults of every kind put upon real runs, one table line per measured figure.

Writes outputs/torture/torture.csv; the exit code is 1 if a bar is missed. Every moment, fault and damage is
drawn from --seed; what a process was doing at that moment is for the machine to decide.
"""

from __future__ import annotations

import argparse
import importlib
import sys
import time
from collections.abc import Callable
from pathlib import Path

from exneat_cli.records import provenance
from tests.torture.findings import Finding, print_findings, say, write_findings

TABLE = Path("outputs") / "torture" / "torture.csv"
CASES = {
    "kills": ("kills", "kill_runs", 200),
    "workers": ("workers", "compare_workers", 2),
    "disk": ("disk", "fill_disks", 1000),
    "checkpoints": ("checkpoints", "damage_checkpoints", 1000),
    "dask": ("dask_workers", "lose_workers", 10),
    "races": ("races", "race", 100),
    "signals": ("interruptions", "interrupt", 50),
    "sweeps": ("sweeps", "kill_sweeps", 20),
    "explosions": ("explosions", "explode", 2),
}
"""Each case's file, function, and full count: kills, tasks, sites of a failing write, bit flips, and so on."""


def main() -> int:
    """Run the suite; returns the exit code."""
    options = _options()
    print(f"{provenance.processor()}; seed {options.seed}", flush=True)
    found: list[tuple[str, Finding]] = []
    for case in options.only or CASES:
        module, function, full = CASES[case]
        count = options.count or max(1, round(full * options.scale))
        say(f"{case}: {count}")
        work: Callable[[int, int], list[Finding]] = getattr(
            importlib.import_module(f"tests.torture.{module}"), function
        )
        began = time.monotonic()
        findings = work(count, options.seed)
        print_findings(case, findings)
        say(f"{case}: {time.monotonic() - began:.0f} s")
        found += [(case, each) for each in findings]
        write_findings(options.table, found)
    missed = sum(not each.meets for _, each in found)
    print(f"\n{len(found) - missed} of {len(found)} bars met. Written: {options.table}")
    return 1 if missed else 0


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tests.torture", description=__doc__)
    parser.add_argument("--only", action="append", choices=sorted(CASES), help="this case alone; may come again")
    parser.add_argument("--scale", type=float, default=1.0, help="part of the full counts, e.g. 0.1 (default 1)")
    parser.add_argument("--count", type=int, help="this count for every case instead")
    parser.add_argument("--seed", type=int, default=0, help="of all random choices (default 0)")
    parser.add_argument("--table", type=Path, default=TABLE, help=f"where the CSV goes (default {TABLE})")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
