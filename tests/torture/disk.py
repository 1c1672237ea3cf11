"""A disk that fills up, at every write site: one line, nothing lost, and the same bytes after a resume."""

from __future__ import annotations

import random
import re
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from tests.torture.faulty_disk import Ended, Fault, run_exneat
from tests.torture.findings import Finding, Mistakes, exactly, say
from tests.torture.program import environment
from tests.torture.small_runs import difference, results, rows_of, status_of, the_run

_SIDE_BY_SIDE = 2
_RUN = [
    *("train", "task=track_maze", "geometry=all", "linkage=output", "budget=smoke", "generations=3", "executor=serial"),
    *("sweep=sensor_noise", "sweep.levels=[0,0.1]", "sweep.episodes=1"),
]
_FILE_SIZES = (0, 100, 500, 1_000, 2_000, 4_000, 6_000, 8_000, 12_000, 16_000, 24_000, 32_000, 48_000, 64_000)
_DISK_SIZES = (8, 16, 24, 32, 40, 48, 64, 96, 128, 160)
"""Of a file system in memory, in KiB."""
_TELLING = re.compile(r"^exneat: ", re.MULTILINE)
_LONGEST = 3


def fill_disks(count: int, seed: int) -> list[Finding]:
    """Let writes fail one by one; returns the figures.

    Args:
        count: failing writes that are tried, evenly spread over all there are, at most each of them alone and
            each with all that follow it.
        seed: of their order.
    """
    mistakes = Mistakes()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        run_exneat([*_RUN, f"output={folder / 'warm'}"], Fault(), folder / "temporary")  # what it compiles is written
        first = run_exneat([*_RUN, f"output={folder / 'out'}"], Fault(), folder / "temporary")
        if first.code != 0:
            raise RuntimeError(f"the undisturbed run failed: {first.said[-500:]}")
        expected = results(folder / "out")
        faults = _faults(first.writes, count, seed)
        with ThreadPoolExecutor(_SIDE_BY_SIDE) as pool:
            tried = [pool.submit(_try, fault, folder / f"{k}", expected, mistakes) for k, fault in enumerate(faults)]
            ends = [each.result() for each in tried]
        disks = _fill_real_disks(folder, count, expected, mistakes)
    failed = sum(ends)
    limits = sum(fault.file_size is not None for fault in faults)
    note = f"of {first.writes} in a run, alone or with all later ones; {failed} ended it, the others did no harm"
    return [
        exactly("failing writes tried", len(faults) - limits, min(count, 2 * first.writes), note),
        exactly("limits of file size tried", limits, min(count, len(_FILE_SIZES))),
        Finding("full file systems tried", disks, "any", True, "" if disks else "skipped: none may be mounted here"),
        mistakes.none_of("faults that were not one clear line, lost a checkpoint or changed bytes"),
    ]


def _faults(writes: int, count: int, seed: int) -> list[Fault]:
    alone = [Fault(first, stays) for first in range(1, writes + 1) for stays in (False, True)]
    chosen = [alone[round(k)] for k in _spread(len(alone), count)]
    sizes = [_FILE_SIZES[round(k)] for k in _spread(len(_FILE_SIZES), count)]
    faults = [*chosen, *(Fault(file_size=size) for size in sizes)]
    random.Random(seed).shuffle(faults)
    return faults


def _spread(there: int, wanted: int) -> list[float]:
    """At most `wanted` places among `there`, evenly."""
    return [k * there / min(there, wanted) for k in range(min(there, wanted))] if there > wanted else list(range(there))


def _try(fault: Fault, folder: Path, expected: dict[str, bytes], mistakes: Mistakes) -> bool:
    """Run under a fault, then resume without it; returns whether the fault ended the run."""
    output = folder / "out"
    ended = run_exneat([*_RUN, f"output={output}"], fault, folder / "temporary")
    rows, was_done = rows_of(the_run(output)), status_of(the_run(output)) == "done"
    if complaint := _complaint(ended, output):
        mistakes.add(f"{fault}: {complaint}")
    again = run_exneat([*_RUN, f"output={output}", "resume=true"], Fault(), folder / "temporary")
    went_on = re.search(r"continuing after generation (\d+)", again.said)
    if not was_done and rows > 1 + (int(went_on[1]) if went_on else 0):
        mistakes.add(f"{fault}: went on after generation {went_on[1] if went_on else 0} of {rows}")
    differing = difference(results(output), expected)
    if again.code != 0 or differing:
        mistakes.add(f"{fault}: then exit code {again.code}, {differing or again.said[-200:]} differ")
    shutil.rmtree(folder)
    return ended.code != 0


def _complaint(ended: Ended, output: Path) -> str:
    """What is wrong with the way that exneat ended; empty if nothing is."""
    if ended.code == 0:
        return ""
    if "Traceback" in ended.said or ended.code != 2:
        return f"exit code {ended.code}: {ended.said[-600:]}"
    told = _TELLING.search(ended.said)
    if told is None or len(ended.said[told.start() :].strip().splitlines()) > _LONGEST:
        return f"expected one to three lines, got {ended.said[-400:]}"
    left = [path.name for path in output.rglob("*.tmp")]
    return f"left {', '.join(left)}" if left else ""


def _fill_real_disks(folder: Path, count: int, expected: dict[str, bytes], mistakes: Mistakes) -> int:
    """The same on small file systems in memory, each seen by nobody else; returns how many there were."""
    if subprocess.run(["unshare", "-rm", "mount", "-t", "tmpfs", "none", str(folder)], capture_output=True).returncode:
        return 0
    sizes = [_DISK_SIZES[round(k)] for k in _spread(len(_DISK_SIZES), max(1, count // 10))]
    for size in sizes:
        _fill_real_disk(size, folder / f"disk{size}", expected, mistakes)
    return len(sizes)


_SCRIPT = """
mount -t tmpfs -o size=$1k none out || exit 99
shift
"$@"; code=$?
find out -name '*.tmp'
mount -o remount,size=64m out
"$@" resume=true > resumed 2>&1 || { tail -5 resumed; exit 98; }
cp -r out copy
exit $code
"""


def _fill_real_disk(size: int, folder: Path, expected: dict[str, bytes], mistakes: Mistakes) -> None:
    (folder / "out").mkdir(parents=True)
    (folder / "temporary").mkdir()
    command = [sys.executable, "-m", "exneat_cli", *_RUN, "output=out"]
    done = subprocess.run(
        ["unshare", "-rm", "sh", "-c", _SCRIPT, "sh", str(size), *command],
        cwd=folder,
        env=environment(folder / "temporary"),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    if complaint := _complaint(Ended(done.returncode, done.stdout, 0), folder / "out"):
        mistakes.add(f"disk of {size} KiB: {complaint}")
    if differing := difference(results(folder / "copy"), expected):
        mistakes.add(f"disk of {size} KiB: {differing} differ")
    say(f"  disk of {size} KiB: exit code {done.returncode}")
    shutil.rmtree(folder)
