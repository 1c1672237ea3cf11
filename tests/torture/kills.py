"""kill -9 at random moments, again and again, until the run is done: the same bytes, little repeated."""

from __future__ import annotations

import random
import re
import shutil
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

from tests.torture.findings import Finding, Mistakes, at_most, exactly, say
from tests.torture.program import HANGING, Program
from tests.torture.small_runs import difference, results, rows_of, status_of, the_run, undisturbed, variants

_SIDE_BY_SIDE = 2
_INTERVALS = (1, 3)
"""Values of checkpoint_every, in turn."""
_MOMENTS = {"start-up": 1, "training": 4, "a write": 3, "validation": 1, "drawing": 1}
"""When a kill falls, and how often in comparison."""


@dataclass
class _Tally:
    """What one variant, or all, went through."""

    kills: int = 0
    repeated: list[int] = field(default_factory=list)
    beyond: int = 0
    runs: int = 0
    moments: dict[str, int] = field(default_factory=dict)

    def add(self, other: _Tally) -> None:
        """Count another one in."""
        self.kills += other.kills
        self.repeated += other.repeated
        self.beyond += other.beyond
        self.runs += other.runs
        for moment, times in other.moments.items():
            self.moments[moment] = self.moments.get(moment, 0) + times


def kill_runs(count: int, seed: int) -> list[Finding]:
    """Kill runs of every variant; returns the figures.

    Args:
        count: kills in all; shared among the variants, so that fewer kills than variants leave some out.
        seed: of the moments.
    """
    chosen = variants()
    random.Random(seed).shuffle(chosen)
    chosen = chosen[:count]
    mistakes, total = Mistakes(), _Tally()
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(_SIDE_BY_SIDE) as pool:
        shares = [len(range(k, count, len(chosen))) for k in range(len(chosen))]
        tasks = [
            pool.submit(
                _torment, variant, share, random.Random(f"{seed} {variant[0]}"), Path(folder) / str(k), mistakes
            )
            for k, (variant, share) in enumerate(zip(chosen, shares, strict=True))
        ]
        for task in tasks:
            total.add(task.result())
    moments = ", ".join(f"{times} in {moment}" for moment, times in sorted(total.moments.items()))
    most = max(total.repeated, default=0)
    return [
        exactly("kills -9", total.kills, count, f"{len(chosen)} variants, {total.runs} runs: {moments}"),
        mistakes.none_of("differences from the undisturbed runs, or runs that could not go on"),
        at_most(
            "resumes that repeated more than one checkpoint interval",
            total.beyond,
            0,
            f"of {len(total.repeated)}; at most {most} generations repeated with checkpoints every 1 or 3",
        ),
    ]


def _torment(
    variant: tuple[str, list[str]], kills: int, chance: random.Random, folder: Path, mistakes: Mistakes
) -> _Tally:
    """One variant, run to its end as often as the kills last."""
    name, arguments = variant
    began = time.monotonic()
    expected = undisturbed(arguments, folder / "undisturbed")
    tally = _Tally()
    while tally.kills < kills:
        every = _INTERVALS[tally.runs % len(_INTERVALS)]
        place = folder / f"run{tally.runs}"
        command = [*arguments, f"checkpoint_every={every}", "resume=true", "output=out"]
        if _to_the_end(command, place, every, kills, chance, tally, mistakes, name):
            if differing := difference(results(place / "out"), expected):
                mistakes.add(f"{name}, run {tally.runs}: {differing} differ")
        else:
            break
        tally.runs += 1
        shutil.rmtree(place)
    say(f"  {name}: {tally.kills} kills, {tally.runs} runs in {time.monotonic() - began:.0f} s")
    return tally


def _to_the_end(
    command: Sequence[str],
    folder: Path,
    every: int,
    kills: int,
    chance: random.Random,
    tally: _Tally,
    mistakes: Mistakes,
    name: str,
) -> bool:
    """Start, kill, start again, until the run is done; False if it cannot be."""
    while True:
        run = the_run(folder / "out")
        rows, was_done = rows_of(run), status_of(run) == "done"
        moment = chance.choices(list(_MOMENTS), list(_MOMENTS.values()))[0] if tally.kills < kills else ""
        with Program(["train", *command], folder) as program:
            killed = bool(moment) and _kill_at(moment, program, folder / "out", chance)
            code = None if killed else program.wait(HANGING)
            program.kill()
            if rows and not was_done:
                _measure_repetition(program.errors, rows, every, tally)
            if killed:
                tally.kills += 1
                tally.moments[moment] = tally.moments.get(moment, 0) + 1
            elif code == 0:
                return True
            else:
                mistakes.add(f"{name}: ended with {code}: {program.errors[-300:]}")
                return False


def _kill_at(moment: str, program: Program, output: Path, chance: random.Random) -> bool:
    """Wait for a moment and end the process there; False if the process was done before."""
    if moment == "start-up":
        time.sleep(chance.uniform(0.0, 2.0))
    elif moment == "training":
        program.wait_for(lambda: _is_begun(program))
        time.sleep(chance.uniform(0.0, 2.0))
    elif moment == "a write":
        # The history is written just before the checkpoint, so a moment after it is one in the middle of both.
        rows = rows_of(the_run(output)) + chance.randint(1, 4)
        program.wait_for(lambda: rows_of(the_run(output)) >= rows)
        time.sleep(chance.uniform(0.0, 0.02))
    elif moment == "validation":
        program.wait_for(lambda: ": validating" in program.errors)
        time.sleep(chance.uniform(0.0, 0.5))
    else:
        program.wait_for(lambda: status_of(the_run(output)) == "done")
        time.sleep(chance.uniform(0.0, 2.0))
    if program.code is not None:
        return False
    program.kill()
    return program.code == -9


def _is_begun(program: Program) -> bool:
    return ": generation" in program.errors or ": continuing" in program.errors


def _measure_repetition(errors: str, rows: int, every: int, tally: _Tally) -> None:
    """Compare the generations that were recorded at a kill with the one that the next start went on from."""
    said = re.search(r"continuing after generation (\d+)", errors)
    # Every generation of these short runs has a line of its own, so one without the other began from nothing.
    if said is None and ": generation" not in errors:
        return
    repeated = rows - (int(said[1]) if said else 0)
    tally.repeated.append(repeated)
    tally.beyond += repeated > every
