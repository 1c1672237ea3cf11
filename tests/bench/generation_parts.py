"""Where the time of a training generation goes, with array genomes and with neat-python's own."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import statistics
import tempfile
import time
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from exneat_cli.algorithms import Coevolution
from exneat_cli.records import write_history
from exneat_cli.records.checkpoint import write_checkpoint
from exneat_cli.rollouts import Executor, Runner
from exneat_cli.runs import RunSettings, training
from exneat_cli.tasks import Hunting
from exneat_cli.wiring import Geometry
from tests.bench.measurement import SECONDS, Row
from tests.bench.two_threads import usable_cores

GENERATIONS = 5
"""That are counted; the one before them compiles."""
VARIANTS = {
    "Ant, neat": RunSettings(algorithm="neat"),
    "Ant, exneat all/full": RunSettings(geometry=Geometry("all"), linkage="full"),
    "hunting, neat": RunSettings(task=Hunting(), algorithm="neat", population=200, episodes=20),
}
EVOLUTION, BRAINS, EPISODES, RECORDS = "evolution", "brains", "episodes", "records"


class Clock:
    """Wall seconds by part, since they were last taken."""

    def __init__(self) -> None:
        self._seconds: defaultdict[str, float] = defaultdict(float)

    @contextlib.contextmanager
    def timing(self, owner: Any, name: str, part: str) -> Iterator[None]:
        """Count the calls of a function or method towards `part`."""
        original = getattr(owner, name)

        @functools.wraps(original)
        def timed(*arguments: Any, **options: Any) -> Any:
            began = time.perf_counter()
            try:
                return original(*arguments, **options)
            finally:
                self._seconds[part] += time.perf_counter() - began

        setattr(owner, name, timed)
        try:
            yield
        finally:
            setattr(owner, name, original)

    @contextlib.contextmanager
    def counting(self, part: str) -> Iterator[None]:
        """Count the block towards `part`."""
        began = time.perf_counter()
        yield
        self._seconds[part] += time.perf_counter() - began

    def take(self) -> dict[str, float]:
        """What was counted so far; begins again at 0."""
        taken, self._seconds = dict(self._seconds), defaultdict(float)
        return taken


def measure_parts(variant: str, genome: str) -> list[Row]:
    """Seconds of each part of a generation.

    Args:
        variant: a key of `VARIANTS`.
        genome: ``array`` or ``stock``.
    """
    evolution = dataclasses.replace(VARIANTS[variant].evolution, genome=genome)
    settings = dataclasses.replace(VARIANTS[variant], evolution=evolution, generations=1 + GENERATIONS)
    generations = _seconds_by_part(settings)[1:]
    whole = statistics.median(sum(parts.values()) for parts in generations)
    return [
        Row(
            f"{part}, seconds of a generation of {variant}, {genome} genomes",
            SECONDS,
            [parts[part] for parts in generations],
            None,
            f"{statistics.median(parts[part] for parts in generations) / whole:.1%} of {whole:.3f} s",
        )
        for part in (EVOLUTION, BRAINS, EPISODES, RECORDS)
    ]


def _seconds_by_part(settings: RunSettings) -> list[dict[str, float]]:
    clock, generations = Clock(), []
    executor = Executor("threads", usable_cores())
    with (
        tempfile.TemporaryDirectory() as folder,
        Runner(settings.task, settings.noise, executor, training=True) as runner,
        clock.timing(Coevolution, "ask", EVOLUTION),
        clock.timing(Coevolution, "tell", EVOLUTION),
        clock.timing(training, "assemble", BRAINS),
        clock.timing(Runner, "run", EPISODES),
    ):
        evolving = training.Training.start(settings)
        while not evolving.is_over:
            evolving.advance(runner)
            with clock.counting(RECORDS):
                write_history(Path(folder) / "history.csv", evolving.history)
                write_checkpoint(Path(folder), evolving.checkpoint(), settings.full_hash)
            generations.append(clock.take())
    return generations
