"""`python -m tests.bench`: measures, prints one table per part and writes each to outputs/bench/.

Figures decide nothing: the exit code is 0 unless two sides that should do the same did not, or a
process failed.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterable
from dataclasses import fields
from functools import partial
from itertools import product
from pathlib import Path

from exneat_cli.records import provenance
from tests.bench.bare_physics import compare_with_bare_physics
from tests.bench.evolution_growth import (
    measure_growth_with_modules,
    measure_growth_with_population,
    measure_growth_with_threads,
)
from tests.bench.evolution_speed import INITIAL_CONNECTIONS, compare_with_stock
from tests.bench.generation_cost import VARIANTS, compare_with_physics
from tests.bench.generation_parts import VARIANTS as DISSECTED_VARIANTS
from tests.bench.generation_parts import measure_parts
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
from tests.bench.training_speed import compare_with_neat_python
from tests.bench.two_threads import compare_threads, usable_cores
from tests.bench.warp_speed import (
    Sizes,
    compare_with_bare_steps,
    compare_with_cpu,
    measure_device_memory,
    measure_evolution,
)
from tests.bench.workload import find_workload

SIZES = tuple(field.name for field in fields(Sizes))
FOLDER = Path("outputs") / "bench"
SINGLE_THREAD_EPISODES = 4
THREADED_EPISODES = 16

Pieces = dict[str, Callable[[], Iterable[Row]]]
"""What a part measures, piece by piece, and how that is called while it lasts."""


def main() -> int:
    """Run the benchmark; returns the exit code."""
    options = _options()
    versions = ", ".join(f"{name} {version}" for name, version in provenance.versions().items())
    print(f"{provenance.processor()}, {usable_cores()} cores; {versions}", flush=True)
    for name in [options.only] if options.only else (name for name in PARTS if name != "warp"):
        pieces, table = PARTS[name]
        try:
            rows = _measure(pieces(options))
        except VerificationError as error:
            print(f"bench: {error}", file=sys.stderr)
            return 1
        print()
        print_table(rows)
        write_table(FOLDER / table, rows)
        print(f"\nRatios: both sides taking turns. Written: {FOLDER / table}", flush=True)
    return 0


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tests.bench", description=__doc__)
    parser.add_argument("--only", choices=tuple(PARTS), help="measure this part alone")
    parser.add_argument(
        "--full", action="store_true", help="training: 30 generations; ant: measure memory over the whole paper budget"
    )
    parser.add_argument("--skip-paper", action="store_true", help="grid: leave out the trainings of the paper budget")
    parser.add_argument(
        "--repetitions", type=_at_least_one, default=11, help="ant, grid: pairs of runs per ratio (default 11)"
    )
    parser.add_argument(
        "--size", action="append", default=[], type=_size, metavar="NAME=NUMBER", help=f"warp: {', '.join(SIZES)}"
    )
    return parser.parse_args()


def _size(text: str) -> tuple[str, object]:
    name, _, value = text.partition("=")
    if name not in SIZES:
        raise argparse.ArgumentTypeError(f"expected one of {', '.join(SIZES)}, got {name!r}")
    return name, value if name == "device" else int(value)


def _at_least_one(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"expected a whole number of at least 1, got {text!r}")
    return int(text)


def _evolution(options: argparse.Namespace) -> Pieces:
    stock: Pieces = {
        f"array against neat-python's genomes, {name}": partial(_one, partial(compare_with_stock, name))
        for name in INITIAL_CONNECTIONS
    }
    return {
        **stock,
        "growth with population": measure_growth_with_population,
        "growth with modules": measure_growth_with_modules,
        "growth with threads": lambda: [measure_growth_with_threads()],
    }


def _generation(options: argparse.Namespace) -> Pieces:
    whole: Pieces = {f"whole generations, {variant}": partial(compare_with_physics, variant) for variant in VARIANTS}
    return whole | {
        f"parts of a generation, {variant}, {genome} genomes": partial(measure_parts, variant, genome)
        for variant, genome in product(DISSECTED_VARIANTS, ("array", "stock"))
    }


def _training(options: argparse.Namespace) -> Pieces:
    return {"whole training": lambda: [compare_with_neat_python(full=options.full)]}


def _ant(options: argparse.Namespace) -> Pieces:
    _say("looking for random networks that keep upright")
    many = find_workload(THREADED_EPISODES)
    few = many.first(SINGLE_THREAD_EPISODES)
    repetitions: int = options.repetitions
    return {
        "bare physics": lambda: [compare_with_bare_physics(few, repetitions)],
        "two threads": lambda: [compare_threads(many, repetitions)],
        "Gymnasium": lambda: [compare_with_gymnasium(few, repetitions)],
        "exneat --help": lambda: [measure_help()],
        "smoke training": measure_smoke_training,
        "memory": lambda: [measure_memory(full=options.full)],
    }


def _grid(options: argparse.Namespace) -> Pieces:
    repetitions: int = options.repetitions
    pieces: Pieces = {
        "general maze": lambda: [compare_general_maze(repetitions)],
        "hunting": lambda: [compare_hunting(repetitions)],
    }
    if not options.skip_paper:
        for task, algorithm in product(PAPER_TASKS, PAPER_ALGORITHMS):
            measure = partial(measure_paper_training, task, algorithm)
            pieces[f"paper budget, {task}, {algorithm}"] = partial(_one, measure)
    return pieces


def _warp(options: argparse.Namespace) -> Pieces:
    sizes = Sizes(**dict(options.size))
    return {
        "memory": lambda: [measure_device_memory(sizes)],  # first, since Warp keeps what others had
        "whole evolution": lambda: [measure_evolution(sizes)],
        "bare steps": lambda: [compare_with_bare_steps(sizes)],
        "runs side by side": lambda: compare_with_cpu(sizes),
    }


PARTS: dict[str, tuple[Callable[[argparse.Namespace], Pieces], str]] = {
    "evolution": (_evolution, "evolution.csv"),
    "generation": (_generation, "generation.csv"),
    "training": (_training, "training.csv"),
    "ant": (_ant, "ant_speed.csv"),
    "grid": (_grid, "grid_worlds.csv"),
    "warp": (_warp, "warp.csv"),
}
"""What can be measured alone, and the table that it fills."""


def _one(measure: Callable[[], Row]) -> list[Row]:
    return [measure()]


def _measure(pieces: Pieces) -> list[Row]:
    rows: list[Row] = []
    for name, measure in pieces.items():
        _say(f"measuring: {name}")
        rows += measure()
    return rows


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
