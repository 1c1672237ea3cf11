"""Whole episodes on two threads against one."""

from __future__ import annotations

import os
import time
from functools import partial
from pathlib import Path

import numpy as np

from exneat_cli.rollouts import Executor
from tests.bench.measurement import RATIO, Bar, Pair, Row, VerificationError, seconds_of, speed_ratios
from tests.bench.workload import Workload, open_runner

BAR = Bar(1.6, at_least=True)
_SYSTEM_TIMES = Path("/proc/stat")
_IDLE_FIELDS = (3, 4)
"""Idle and waiting for disks, among the times of /proc/stat."""
_COUNTED_FIELDS = 8
"""The later ones, of guests, are contained in the first two."""


def usable_cores() -> int:
    """Cores that this process may use."""
    return Executor().threads


def compare_threads(workload: Workload, repetitions: int) -> Row:
    """Environment steps per second on two threads over those on one, same brains.

    Raises:
        VerificationError: the outcomes differ.
    """
    work = workload.brains(), [workload.seeds]
    with open_runner(threads=2) as two, open_runner(threads=1) as one:
        if not all(np.array_equal(*sides) for sides in zip(two.run(*work), one.run(*work), strict=True)):
            raise VerificationError("the outcomes of episodes depend on the number of threads")
        pair = Pair(partial(seconds_of, partial(two.run, *work)), partial(seconds_of, partial(one.run, *work)))
        began, others_before = time.perf_counter(), _core_seconds_of_others()
        ratios = speed_ratios([pair], repetitions)
        seconds, others_after = time.perf_counter() - began, _core_seconds_of_others()
    note = f"{usable_cores()} cores seen"
    if others_before is not None and others_after is not None:
        note += f", {max(0.0, others_after - others_before) / seconds:.2f} cores busy with other processes"
    name = f"2 threads / 1 thread, {len(workload.genomes)} whole Ant episodes, steps/s"
    return Row(name, RATIO, ratios, BAR, note)


def _core_seconds_of_others() -> float | None:
    """Core seconds that all other processes of the machine used since it started; None where nothing tells."""
    try:
        fields = _SYSTEM_TIMES.read_text(encoding="utf-8").splitlines()[0].split()[1 : 1 + _COUNTED_FIELDS]
    except OSError:
        return None
    ticks = sum(int(field) for index, field in enumerate(fields) if index not in _IDLE_FIELDS)
    return ticks / os.sysconf("SC_CLK_TCK") - time.process_time()
