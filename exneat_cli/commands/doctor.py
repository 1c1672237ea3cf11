"""`exneat doctor`: whether this machine is fit for exneat, line by line, and what to do where it is not."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from exneat_cli.commands.findings import BROKEN, DEGRADED, OK, Check, Finding, findings_of
from exneat_cli.commands.installation import installation_checks, loading
from exneat_cli.errors import ExneatError

GIGABYTE = 1_000_000_000
LEAST_MEMORY = GIGABYTE
"""Bytes; a small training of Ant was seen to take half of it."""
LEAST_DISK = GIGABYTE
"""Bytes that should be left for runs."""


def run(arguments: Sequence[str]) -> int:
    """Look at everything and print a line each; returns 1 if anything is broken, else 0.

    Raises:
        ExneatError: an argument is unknown.
    """
    output = Path("outputs")
    for argument in arguments:
        key, separator, value = argument.partition("=")
        if key != "output" or not separator or not value:
            raise ExneatError(f"{argument}: expected output=<root of runs>")
        output = Path(value)
    states: Counter[str] = Counter()
    for finding in _all_findings(output):
        print(finding.lines(), flush=True)
        states[finding.state] += 1
    print(f"\n{states[OK]} ok, {states[DEGRADED]} degraded, {states[BROKEN]} broken: {_conclusion(states)}")
    return 1 if states[BROKEN] else 0


def _all_findings(output: Path) -> Iterator[Finding]:
    for check in installation_checks():
        yield from findings_of(check)
    loaded = list(findings_of(Check("loading", loading)))
    yield from loaded
    # The other checks are exneat's own code at work; without it each would only say the same again.
    if all(finding.state != BROKEN for finding in loaded):
        for check in machine_checks(output):
            yield from findings_of(check)


def _conclusion(states: Counter[str]) -> str:
    if states[BROKEN]:
        return "this machine is not fit for exneat until what is broken is fixed."
    return "this machine is fit for exneat."


def machine_checks(output: Path) -> list[Check]:
    """Processor, memory, simulator and disk.

    Args:
        output: root of the runs.
    """
    return [
        Check("processor", _processor),
        Check("memory", _memory),
        Check("compiled MuJoCo", _physics),
        Check("rendering", _rendering),
        Check("compile cache", _cache),
        Check("output root", lambda: _output(output)),
        Check("disk space", lambda: _disk_space(output)),
    ]


def _processor() -> Iterable[Finding]:
    from exneat_cli.records import provenance
    from exneat_cli.rollouts import Executor

    threads = Executor().threads
    cores = f"exneat takes {threads} {'thread' if threads == 1 else 'threads'} of {os.cpu_count()} cores"
    yield Finding(OK, "processor", f"{provenance.processor()}; {cores}")


def _memory() -> Iterable[Finding]:
    from exneat_cli.records import provenance

    available = provenance.available_memory()
    if available is None:
        yield Finding(OK, "memory", "this system does not say how much is available")
    elif available >= LEAST_MEMORY:
        yield Finding(OK, "memory", f"{available / GIGABYTE:.1f} GB available")
    else:
        found = f"{available / GIGABYTE:.1f} GB available; a run takes about half a GB"
        yield Finding(DEGRADED, "memory", found, "close other programs, or do one run at a time")


def _physics() -> Iterable[Finding]:
    from exneat_cli.tasks.robots import simulator_trial

    name = "compiled MuJoCo"
    try:
        physics = simulator_trial.try_physics()
    except ExneatError as error:
        remedy = "install MuJoCo, Gymnasium and numba anew; task=ant cannot be trained before"
        if "NUMBA_DISABLE_JIT" in os.environ:
            remedy = "unset NUMBA_DISABLE_JIT: exneat needs compiled code"
        yield Finding(BROKEN, name, f"Ant cannot be stepped: {error}", remedy)
        return
    if physics.compiled:
        yield Finding(OK, name, f"MuJoCo {physics.version} stepped from compiled code, as by its own bindings")
    else:
        found = f"Ant runs over Gymnasium, slower and on one core: {physics.because}"
        remedy = "install mujoco anew from its wheel, which holds its library, or use the grid worlds"
        yield Finding(DEGRADED, name, found, remedy)


def _rendering() -> Iterable[Finding]:
    from exneat_cli.tasks.robots import simulator_trial

    try:
        backend = simulator_trial.try_rendering()
    except ExneatError as error:
        remedy = (
            "apt-get install libegl1 libopengl0 libgl1-mesa-dri, and set MUJOCO_GL=egl; training needs no rendering"
        )
        yield Finding(DEGRADED, "rendering", f"no picture of MuJoCo off-screen: {error}", remedy)
    else:
        yield Finding(OK, "rendering", f"MuJoCo draws off-screen (MUJOCO_GL={backend})")


def _cache() -> Iterable[Finding]:
    from exneat_cli.compiling import cache_directory, cache_root
    from exneat_cli.records import disk

    directory = cache_directory()
    try:
        if directory is None:
            raise ExneatError(f"{cache_root()} cannot be written to")
        disk.try_writing(directory)
    except (ExneatError, RuntimeError) as error:  # RuntimeError: a user without a home directory
        remedy = "set NUMBA_CACHE_DIR to a directory that you can write to"
        yield Finding(DEGRADED, "compile cache", f"every start compiles anew: {error}", remedy)
    else:
        yield Finding(OK, "compile cache", f"{directory} can be written")


def _output(root: Path) -> Iterable[Finding]:
    from exneat_cli.records import disk

    remedy = "set output= to a directory on a disk that you can write to"
    try:
        disk.try_writing(root)
    except ExneatError as error:
        yield Finding(BROKEN, "output root", f"output={root}: {error}", remedy)
        return
    state = "can be written" if root.is_dir() else "can be made"
    yield Finding(OK, "output root", f"output={root} {state}")
    try:
        exclude = disk.locks_exclude(root)
    except ExneatError as error:
        yield Finding(BROKEN, "locks", f"output={root}: {error}", remedy + " and that has locks")
        return
    if exclude:
        yield Finding(OK, "locks", "a second process is kept out of a run directory")
    else:
        yield Finding(
            DEGRADED, "locks", f"output={root}: the file system grants a lock twice", "never do one run twice"
        )


def _disk_space(root: Path) -> Iterable[Finding]:
    from exneat_cli.records import disk

    try:
        free = disk.free_bytes(root)
    except ExneatError:  # the line about the output root says it
        return
    found = f"{free / GIGABYTE:.1f} GB left for output={root}"
    if free >= LEAST_DISK:
        yield Finding(OK, "disk space", found)
    else:
        yield Finding(DEGRADED, "disk space", found, "make room, or set output= to another disk")
