"""Workers of a dask cluster are killed while they evaluate: does the run end with the same bytes?"""

from __future__ import annotations

import os
import random
import signal
import tempfile
import threading
import time
from dataclasses import dataclass
from pathlib import Path

import psutil

from exneat_cli.records import HistoryRow
from exneat_cli.rollouts import Executor
from exneat_cli.runs import Progress, RunSettings, train
from exneat_cli.tasks import AntTask
from exneat_cli.wiring import Geometry
from tests.torture.findings import Finding, exactly

RESULTS = ("champion.json", "hall_of_fame.jsonl", "trace.csv")
"""The files of a run that must not differ in a single byte; history.csv may in its last column, wall_seconds."""


@dataclass(frozen=True)
class Killed:
    """What came of it.

    Attributes:
        kills: workers that were killed.
        same_bytes: whether the run ended as an undisturbed one on one thread.
        seconds, seconds_undisturbed: that both runs took.
    """

    kills: int
    same_bytes: bool
    seconds: float
    seconds_undisturbed: float


class _Killer(Progress):
    """Kills one worker in every generation, at a moment drawn at random, until it has killed enough."""

    def __init__(self, times: int, rng: random.Random) -> None:
        super().__init__()
        self.times, self.rng, self.kills = times, rng, 0
        self.threads: list[threading.Thread] = []

    def generation(self, row: HistoryRow) -> None:
        if len(self.threads) < self.times:
            self.threads.append(threading.Thread(target=self._kill, args=(self.rng.uniform(0.0, 0.5),)))
            self.threads[-1].start()

    def _kill(self, delay: float) -> None:
        time.sleep(delay)
        deadline = time.monotonic() + 60
        while not (running := workers_of_this_process()):  # all may be dead already
            if time.monotonic() > deadline:
                return
            time.sleep(0.05)
        os.kill(self.rng.choice(running), signal.SIGKILL)
        self.kills += 1


def workers_of_this_process() -> list[int]:
    """Process ids of the dask workers that this process started."""
    children = psutil.Process().children(recursive=True)
    found = []
    for child in children:
        try:
            if any("spawn_main" in argument for argument in child.cmdline()):
                found.append(child.pid)
        except psutil.Error:
            continue
    return found


def kill_workers(times: int, seed: int) -> Killed:
    """Train on one thread, then over two workers of which one is killed `times` times, once per generation.

    Args:
        times: how often.
        seed: of the run and of the moments.
    """
    with tempfile.TemporaryDirectory() as folder:
        began = time.perf_counter()
        expected = _results(_settings(Path(folder, "serial"), Executor("serial"), times, seed))
        undisturbed = time.perf_counter()
        killer = _Killer(times, random.Random(seed))
        came = _results(_settings(Path(folder, "dask"), Executor("dask", 2), times, seed), killer)
        ended = time.perf_counter()
    for thread in killer.threads:
        thread.join()
    return Killed(killer.kills, came == expected, ended - undisturbed, undisturbed - began)


def _settings(output: Path, executor: Executor, times: int, seed: int) -> RunSettings:
    return RunSettings(
        task=AntTask(max_steps=400),
        geometry=Geometry("lr"),
        seed=seed,
        generations=times + 2,
        population=60,
        validation_episodes=2,
        test_episodes=2,
        executor=executor,
        output=str(output),
    )


def _results(settings: RunSettings, progress: Progress | None = None) -> list[bytes]:
    run = train(settings, progress=progress).directory
    history = [line.rpartition(b",")[0] for line in run.history.read_bytes().splitlines()]
    return [*((run.path / name).read_bytes() for name in RESULTS), *history]


def lose_workers(count: int, seed: int) -> list[Finding]:
    """Kill so many workers while one run lasts; returns the figures."""
    killed = kill_workers(count, seed)
    note = f"{killed.seconds:.0f} s, undisturbed on one thread {killed.seconds_undisturbed:.0f} s"
    return [
        exactly("dask workers killed while evaluating", killed.kills, count, note),
        exactly("runs that ended with other bytes", 1 - killed.same_bytes, 0),
    ]
