"""A sweep killed at many points: only what is unfinished is done again, and skipping the rest costs next to nothing."""

from __future__ import annotations

import json
import random
import shutil
import statistics
import tempfile
import time
from pathlib import Path

import yaml

from tests.torture.findings import Finding, Mistakes, at_most, exactly, say
from tests.torture.program import HANGING, Program
from tests.torture.small_runs import difference, results, undisturbed

SECONDS_PER_SKIPPED_JOB = 0.2
_REPETITIONS = 3
_EXPERIMENT = {
    "claim": "Nothing; its jobs are there to be stopped.",
    "settings": {"task": "track_maze", "population": 20, "episodes": 2, "generations": 4},
    "variants": {
        "neat": {"label": "NEAT", "settings": {"algorithm": "neat"}},
        "exneat": {"label": "ExNEAT", "settings": {"geometry": "all", "linkage": "output"}},
        "random": {"label": "random", "settings": {"algorithm": "random"}},
    },
    "conditions": {"gap_1": {"label": "gap of 1", "settings": {"task.gap": 1}, "sweeps": ["gap"]}},
    "runs": {"smoke": 2},
}
_JOBS = 6


def kill_sweeps(count: int, seed: int) -> list[Finding]:
    """Kill sweeps with everything they started; returns the figures.

    Args:
        count: kills, each of a new sweep.
        seed: of the moments.
    """
    mistakes, chance = Mistakes(), random.Random(seed)
    finished, done_again = 0, 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "small.yaml").write_text(yaml.safe_dump(_EXPERIMENT))
        arguments = [f"experiment={folder / 'small.yaml'}", "budget=smoke", "executor=serial"]
        began = time.monotonic()
        expected = undisturbed(arguments, folder / "whole", "sweep")
        lasting = time.monotonic() - began
        say(f"  {lasting:.0f} s undisturbed")
        for number in range(count):
            moment = (number + chance.random()) / count * lasting
            kept, again = _kill_once(arguments, moment, folder / str(number), expected, mistakes)
            finished += kept
            done_again += again
        skipping = _seconds_per_skipped_job(folder / "whole", arguments)
    note = f"{finished} jobs were finished at the kills and {done_again} done afterwards"
    return [
        exactly("sweeps killed", number + 1, count, note),
        mistakes.none_of("finished jobs that were touched, unfinished ones that were not done, or other bytes"),
        at_most("seconds per skipped job", skipping, SECONDS_PER_SKIPPED_JOB, f"{_JOBS} jobs against 1, both finished"),
    ]


def _kill_once(
    arguments: list[str], moment: float, folder: Path, expected: dict[str, bytes], mistakes: Mistakes
) -> tuple[int, int]:
    """Kill a sweep after some seconds and repeat it; returns jobs that were finished before, and done after."""
    name = f"killed after {moment:.1f} s"
    with Program(["sweep", *arguments, "output=out"], folder) as program:
        program.wait(moment)
    before = _finished(folder / "out")
    with Program(["sweep", *arguments, "output=out"], folder) as program:
        if program.wait(HANGING) != 0:
            mistakes.add(f"{name}: then failed: {program.errors[-300:]}")
        told = program.output
    touched = [str(path) for path, stamp in before.items() if not path.exists() or _stamp(path) != stamp]
    if touched:
        mistakes.add(f"{name}: touched {', '.join(touched)}")
    if differing := difference(results(folder / "out"), expected):
        mistakes.add(f"{name}: {differing} differ")
    jobs = len({path.parent for path in before if path.name == "manifest.json"})
    if f"{_JOBS - jobs} runs done, {jobs} skipped" not in told:
        mistakes.add(f"{name}: {jobs} jobs were finished, and the sweep says: {told.strip().splitlines()[-1:]}")
    shutil.rmtree(folder)
    return jobs, _JOBS - jobs


def _finished(output: Path) -> dict[Path, tuple[int, bytes]]:
    """Every file of the jobs that were trained, tested and drawn, with its time and content."""
    files: dict[Path, tuple[int, bytes]] = {}
    for manifest in output.glob("*/*/manifest.json"):
        run = manifest.parent
        trained = json.loads(manifest.read_text(encoding="utf-8"))["status"] == "done"
        tested = (run / "robustness.csv").exists() and "gap" in (run / "robustness.csv").read_text(encoding="utf-8")
        figures = ["path", "robustness"] + ["training", "network"] * (run / "history.csv").exists()
        if trained and tested and all((run / "plots" / f"{figure}.svg").exists() for figure in figures):
            files |= {path: _stamp(path) for path in run.rglob("*") if path.is_file()}
    return files


def _stamp(path: Path) -> tuple[int, bytes]:
    return path.stat().st_mtime_ns, path.read_bytes()


def _seconds_per_skipped_job(folder: Path, arguments: list[str]) -> float:
    """How much longer a finished sweep takes to find that out than one with a single job, per job."""
    few = yaml.safe_load(Path(arguments[0].partition("=")[2]).read_text(encoding="utf-8"))
    few["variants"], few["runs"] = {"neat": few["variants"]["neat"]}, {"smoke": 1}
    single = folder / "single" / "small.yaml"
    single.parent.mkdir()
    single.write_text(yaml.safe_dump(few))
    alone = [f"experiment={single}", *arguments[1:]]
    seconds = [(_seconds(folder, arguments), _seconds(folder, alone)) for _ in range(_REPETITIONS)]
    return statistics.median(many - one for many, one in seconds) / (_JOBS - 1)


def _seconds(folder: Path, arguments: list[str]) -> float:
    with Program(["sweep", *arguments, "output=out"], folder) as program:
        program.wait(HANGING)
        if " 0 runs done" not in program.output.replace(":", ""):
            raise RuntimeError(f"expected a finished sweep, got: {program.output} {program.errors}")
        return time.monotonic() - program.began
