"""Two processes that start on one directory at the same moment: exactly one writes."""

from __future__ import annotations

import multiprocessing
import os
import random
import re
import tempfile
import time
from collections.abc import Sequence
from dataclasses import replace
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from multiprocessing.synchronize import Barrier
from pathlib import Path
from typing import NamedTuple

from exneat_cli.errors import ExneatError
from exneat_cli.runs import RunSettings, train
from exneat_cli.tasks import TrackMaze
from tests.torture.findings import Finding, Mistakes, exactly
from tests.torture.program import HANGING
from tests.torture.small_runs import difference, results

_PRELOADED = ["tests.torture.races", "exneat_cli.rollouts.episode"]
_RACE = RunSettings(
    task=TrackMaze(), generations=3, population=10, episodes=2, validation_episodes=1, test_episodes=1, resume=False
)
_REFUSED = re.compile(r"another process is writing there \(process id (\d+)\)|holds an unfinished run|been removed by")


class _Said(NamedTuple):
    """What a racer ended with."""

    process: int
    trained: bool
    refusal: str


def race(count: int, seed: int) -> list[Finding]:
    """Let two processes race for a new directory, or for one whose holder was just killed; returns the figures.

    Args:
        count: races; every fifth is for the directory of a killed process.
        seed: of the delay between the two, 0 to some milliseconds.
    """
    chance, mistakes, late, named = random.Random(seed), Mistakes(), 0, 0
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(_PRELOADED)
    with tempfile.TemporaryDirectory() as folder:
        train(replace(_RACE, output=str(Path(folder) / "undisturbed")))
        expected = results(Path(folder) / "undisturbed")
        for number in range(count):
            settings = replace(_RACE, output=str(Path(folder) / str(number)), resume=chance.random() < 0.5)
            if number % 5 == 4:
                settings = replace(settings, resume=True)
                _begin_and_be_killed(context, settings, chance.uniform(0.0, 0.2))
            delays = (0.0, chance.choice([0.0, 0.0, chance.uniform(0.0, 0.3)]))
            said = _both(context, settings, delays)
            _judge(f"race {number}", said, mistakes)
            late += sum(not each.trained and not each.refusal for each in said)
            named += sum("process id" in each.refusal for each in said)
            if differing := difference(results(Path(settings.output)), expected):
                mistakes.add(f"race {number}: {differing} differ")
    note = f"the other one was refused by process id {named} times and found the run finished {late} times"
    return [
        exactly("races", number + 1, count, note),
        mistakes.none_of("races without exactly one writer, or with other bytes"),
    ]


def _judge(name: str, said: Sequence[_Said | None], mistakes: Mistakes) -> None:
    both = [each for each in said if each is not None]
    if len(both) != 2 or sum(each.trained for each in both) != 1:
        mistakes.add(f"{name}: expected one writer, got {said}")
        return
    winner, other = sorted(both, key=lambda each: not each.trained)
    refused = _REFUSED.search(other.refusal)
    if other.refusal and (refused is None or refused[1] not in (None, str(winner.process))):
        mistakes.add(f"{name}: process {winner.process} wrote, and the other was told: {other.refusal}")


def _both(
    context: multiprocessing.context.ForkServerContext, settings: RunSettings, delays: tuple[float, float]
) -> list[_Said | None]:
    start, racers = context.Barrier(2), []
    for delay in delays:
        here, there = context.Pipe(duplex=False)
        process = context.Process(target=_run, args=(settings, start, delay, there))
        process.start()
        there.close()
        racers.append((process, here))
    return [_heard(process, here) for process, here in racers]


def _heard(process: BaseProcess, here: Connection) -> _Said | None:
    """What a racer said; None if it died or hangs."""
    try:
        return here.recv() if wait([here], HANGING) else None
    except EOFError:
        return None
    finally:
        if process.is_alive() and not wait([process.sentinel], 10):
            process.kill()
        process.join()


def _run(settings: RunSettings, start: Barrier, delay: float, there: Connection) -> None:
    start.wait(HANGING)
    time.sleep(delay)
    try:
        there.send(_Said(os.getpid(), train(settings).trained_now, ""))
    except ExneatError as error:
        there.send(_Said(os.getpid(), False, str(error)))


def _begin_and_be_killed(
    context: multiprocessing.context.ForkServerContext, settings: RunSettings, after: float
) -> None:
    """Hold the directory, and be killed while it is held."""
    process = context.Process(target=train, args=(settings,))
    process.start()
    deadline = time.monotonic() + HANGING
    while not settings.directory.is_there() and time.monotonic() < deadline:
        time.sleep(0.001)
    time.sleep(after)
    process.kill()
    process.join()
