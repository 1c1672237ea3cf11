"""`exneat doctor`: checks, line by line, whether exneat works on this machine, and says how to fix what does not.

Each check imports what it needs itself, so that a missing or broken library affects only its own line.
"""

from __future__ import annotations

import contextlib
import importlib
import os
import platform
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from importlib import metadata
from pathlib import Path

from exneat_cli.commands.command_line import CommandLine
from exneat_cli.errors import ExneatError, check_path
from exneat_cli.interruption import scratch_directory

OK, DEGRADED, BROKEN = "ok", "degraded", "broken"
LEAST = 1_000_000_000
"""Bytes of memory (a small training of Ant takes half of them) and of disk space that should be free."""
_ROOMS = ("exneat_cli.runs", "exneat_cli.analysis", "exneat_cli.commands.launching")
"""Importing these imports every other room and every library."""
_PHYSICS = """
import mujoco, numba
from exneat_cli.tasks.robots.dynamics import load_library, mj_step
load_library()
model = mujoco.MjModel.from_xml_string(
    '<mujoco><worldbody><geom type="plane" size="9 9 1"/>'
    '<body pos="0 0 1"><freejoint/><geom size=".2 .3" type="capsule" euler="9 40 0"/></body></worldbody></mujoco>')
data, expected = mujoco.MjData(model), mujoco.MjData(model)
mujoco.mj_step(model, expected, 500)

@numba.njit
def step(model, data):
    for _ in range(500):
        mj_step(model, data)

step(model._address, data._address)
if (data.qpos != expected.qpos).any():
    raise SystemExit("MuJoCo steps differently from compiled code and through its own Python bindings")
print(f"MuJoCo {mujoco.__version__} steps from compiled code exactly as through its own bindings")
"""
FRAME = """
import os, mujoco
model = mujoco.MjModel.from_xml_string(
    '<mujoco><worldbody><light pos="0 0 3"/><geom size="1"/></worldbody></mujoco>')
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
with mujoco.Renderer(model, 240, 320) as renderer:
    renderer.update_scene(data)
    if not renderer.render().any():
        raise SystemExit("the frame is black")
print(f"MuJoCo draws off-screen (MUJOCO_GL={os.environ.get('MUJOCO_GL', 'not set')})")
"""


def run(line: CommandLine) -> int:
    """Run every check and print a line for each; returns 1 if anything is broken, else 0.

    Raises:
        ExneatError: an argument makes no sense.
    """
    plain = line.compose_only(("output",))
    states = []
    for name, look, worst, remedy in _checks(check_path("output", plain["output"])):
        try:
            state, found = OK, look()
        except Exception as error:  # to find whatever is wrong is the purpose
            state, found = worst, str(error) if isinstance(error, ExneatError) else f"{type(error).__name__}: {error}"
        print(f"{state:<9} {name:<16} {found}".replace("\n", "\n" + " " * 27), flush=True)
        if state != OK:
            print(f"{'':<10}remedy: {remedy}")
        states.append(state)
        if name == "loading" and state != OK:
            break  # the other checks use exneat's own code, and would only repeat this
    conclusion = "cannot run exneat until what is broken is fixed" if BROKEN in states else "can run exneat"
    counts = ", ".join(f"{states.count(state)} {state}" for state in (OK, DEGRADED, BROKEN))
    print(f"\n{counts}: this machine {conclusion}.")
    return 1 if BROKEN in states else 0


def _checks(output: Path) -> list[tuple[str, Callable[[], str], str, str]]:
    """For each check: name, function that says what it found, state if that raises, and remedy."""
    install = "reinstall exneat in an environment of its own, or only what is named here"
    place = "set output= to a writable directory on a disk that supports file locks"
    egl = "apt-get install libegl1 libopengl0 libgl1-mesa-dri, and set MUJOCO_GL=egl; training needs no rendering"
    return [
        ("python", _versions, DEGRADED, install),
        ("packages", lambda: said_by(["-m", "pip", "check"]), DEGRADED, install),
        ("loading", _loading, BROKEN, f"{install}; unset MUJOCO_GL if it is set"),
        ("compiled MuJoCo", lambda: said_by(["-c", _PHYSICS]), BROKEN, f"{install}; unset NUMBA_DISABLE_JIT"),
        ("rendering", _rendering, DEGRADED, egl),
        ("compile cache", _cache, DEGRADED, "set NUMBA_CACHE_DIR to a directory that you can write to"),
        ("output root", lambda: _output(output), BROKEN, place),
        ("memory", _memory, DEGRADED, "close other programs, or do one run at a time"),
        ("disk space", lambda: _disk_space(output), DEGRADED, "free some space, or set output= to another disk"),
    ]


def _versions() -> str:
    needed = [text for text in metadata.requires("exneat") or () if "extra ==" not in text]
    names = ["exneat", *(re.split(r"[^\w.-]", text)[0] for text in needed)]
    return ", ".join([f"Python {platform.python_version()}", *(f"{name} {metadata.version(name)}" for name in names)])


def _loading() -> str:
    for room in _ROOMS:
        importlib.import_module(room)
    return "every part of exneat can be loaded"


def _memory() -> str:
    from exneat_cli.records import provenance

    available = provenance.available_memory()
    return "not reported by this system" if available is None else _enough(available, "available")


def _disk_space(output: Path) -> str:
    return _enough(shutil.disk_usage(_nearest(output)).free, f"free for output={output}")


def _enough(found: int, what: str) -> str:
    said = f"{found / 1e9:.1f} GB {what}"
    if found < LEAST:
        raise ExneatError(f"{said}, which may not be enough")
    return said


def _rendering() -> str:
    egl = {} if "MUJOCO_GL" in os.environ or sys.platform != "linux" else {"MUJOCO_GL": "egl"}  # needs no screen
    return said_by(["-c", FRAME], 60.0, **egl)


def said_by(arguments: Sequence[str], seconds: float = 180.0, **environment: str) -> str:
    """What Python prints in a separate process, which a driver or an incompatible library may crash.

    Raises:
        ExneatError: it failed, crashed, or took longer than `seconds`.
    """
    try:
        done = subprocess.run(
            [sys.executable, "-P", *arguments],  # -P: no file in the working directory may pass for a library
            env={**os.environ, **environment},
            capture_output=True,
            errors="replace",
            timeout=seconds,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise ExneatError(f"no answer within {seconds:g} s") from None
    if done.returncode < 0:
        raise ExneatError(f"its process was killed by {signal.Signals(-done.returncode).name}")
    if done.returncode:
        raise ExneatError(done.stdout.strip() or done.stderr.strip().split("\n")[-1] or f"exit code {done.returncode}")
    return done.stdout.strip()


def _cache() -> str:
    from exneat_cli.compiling import cache_directory, cache_root

    directory = cache_directory()
    if directory is None:
        raise ExneatError(f"exneat compiles anew at every start: {cache_root()} is not writable")
    with _trial(directory):
        return f"{directory} is writable"


def _output(output: Path) -> str:
    from exneat_cli.records import RunDirectory

    with _trial(output) as path, RunDirectory(path).held(), contextlib.suppress(ExneatError), RunDirectory(path).held():
        raise OSError(f"output={output}: the file system grants the same lock twice")
    return f"output={output} can be {'written' if output.is_dir() else 'created'}, and a second process is kept out"


@contextlib.contextmanager
def _trial(place: Path) -> Iterator[Path]:
    """A temporary directory with a file written as runs do it, in the place or its nearest existing parent."""
    from exneat_cli.records import write_whole

    with scratch_directory(".exneat-doctor-", _nearest(place)) as path:
        write_whole(path / "trial", b"written by exneat doctor\n")
        yield path


def _nearest(place: Path) -> Path:
    return next(each for each in (place.absolute(), *place.absolute().parents) if os.path.lexists(each))
