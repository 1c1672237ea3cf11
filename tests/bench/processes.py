"""Whole processes: how long the command takes to answer and to train, and how much memory it needs."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from tests.bench.measurement import MEGABYTES, SECONDS, Bar, Row, VerificationError

HELP_REPETITIONS = 5
TRAIN_REPETITIONS = 2
SHORT_GENERATIONS = 3
SMOKE = ("train", "recipe=thesis", "budget=smoke", "geometry=all")
PAPER = ("train", "task=ant", "recipe=thesis", "geometry=all", "budget=paper")

HELP_BAR = Bar(1.0, at_least=False)
COLD_BAR = Bar(40.0, at_least=False)
WARM_BAR = Bar(15.0, at_least=False)
MEMORY_BAR = Bar(500.0, at_least=False)


def measure_help() -> Row:
    """Wall seconds of `exneat --help`, from start to end of the process.

    Raises:
        VerificationError: the command failed.
    """
    with tempfile.TemporaryDirectory() as directory:
        seconds = [_run([_exneat(), "--help"], Path(directory))[0] for _ in range(HELP_REPETITIONS)]
    return Row("exneat --help, whole process", SECONDS, seconds, HELP_BAR)


def measure_smoke_training() -> tuple[Row, Row]:
    """Wall seconds of a smoke run that must compile everything first, and of the next one that need not.

    Raises:
        VerificationError: the command failed.
    """
    cold: list[float] = []
    warm: list[float] = []
    for _ in range(TRAIN_REPETITIONS):
        with tempfile.TemporaryDirectory() as directory:
            for seconds, output in ((cold, "output=first"), (warm, "output=second")):
                seconds.append(_run([_exneat(), *SMOKE, output], Path(directory))[0])
    name = f"exneat {' '.join(SMOKE)}"
    return (
        Row(f"{name}, cold compile cache", SECONDS, cold, COLD_BAR),
        Row(f"{name}, warm compile cache", SECONDS, warm, WARM_BAR),
    )


def measure_memory(*, full: bool) -> Row:
    """Peak resident memory, in MB, of one training process that also has to compile.

    Args:
        full: run the whole paper budget instead of its first generations.

    Raises:
        VerificationError: the command failed.
    """
    cut = () if full else (f"generations={SHORT_GENERATIONS}",)
    label = "whole run" if full else f"cut to {SHORT_GENERATIONS} generations"
    watcher = [sys.executable, str(Path(__file__).with_name("peak_memory.py"))]
    with tempfile.TemporaryDirectory() as directory:
        _, printed = _run([*watcher, _exneat(), *PAPER, *cut, "output=runs"], Path(directory))
    name = f"peak resident memory of exneat {' '.join(PAPER)}, {label}, cold compile cache"
    return Row(name, MEGABYTES, [int(printed) / 1e6], MEMORY_BAR)


def _exneat() -> str:
    return str(Path(sys.executable).with_name("exneat"))


def _run(command: Sequence[str], directory: Path) -> tuple[float, str]:
    """Wall seconds and standard output of `command`, run in `directory` with its compile cache there too."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(directory / "numba")}
    began = time.perf_counter()
    done = subprocess.run(command, cwd=directory, env=environment, capture_output=True, text=True, check=False)
    seconds = time.perf_counter() - began
    if done.returncode != 0:
        raise VerificationError(f"{' '.join(command)} exited with {done.returncode}:\n{done.stderr[-2000:]}")
    return seconds, done.stdout
