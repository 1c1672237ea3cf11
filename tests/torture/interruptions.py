"""Ctrl-C and SIGTERM at random moments: a quick end, no process left, and the same bytes later."""

from __future__ import annotations

import json
import random
import shutil
import signal
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

import yaml

from tests.torture.findings import Finding, Mistakes, at_most, exactly, say
from tests.torture.program import HANGING, Program
from tests.torture.small_runs import difference, results, undisturbed

BAR = 5.0
"""Seconds from the signal to the end of the last process; nothing is compiled meanwhile, for that is done before."""
_LONGEST_WAIT = 20.0
"""Seconds after which what is still there counts as left behind."""
_SIDE_BY_SIDE = 2
_CODES = {signal.SIGINT: 130, signal.SIGTERM: 143}
_SMALL = ["task=track_maze", "geometry=all", "linkage=output", "budget=smoke", "population=40", "episodes=6"]
_EXPERIMENT = {
    "claim": "Nothing; its jobs are there to be stopped.",
    "settings": {"task": "track_maze", "population": 40, "episodes": 6, "generations": 8},
    "variants": {
        "neat": {"label": "NEAT", "settings": {"algorithm": "neat"}},
        "exneat": {"label": "ExNEAT", "settings": {"geometry": "all", "linkage": "output"}},
    },
    "conditions": {"clean": {"label": "clean", "settings": {}, "sweeps": ["sensor_noise"]}},
    "runs": {"smoke": 2},
}
_JOBLIB = ["hydra/launcher=joblib", "hydra.launcher.n_jobs=2"]


class _Command(NamedTuple):
    """What is started: a name, its arguments, and what the same command needs in order to go on."""

    name: str
    arguments: list[str]
    resume: list[str]


class _Stop(NamedTuple):
    """How one process took a signal."""

    seconds: float
    left: int
    files: int
    how: str
    unmarked: int = 0


def interrupt(count: int, seed: int) -> list[Finding]:
    """Send signals; returns the figures.

    Args:
        count: signals in all, half of them SIGINT, shared among the commands.
        seed: of the moments.
    """
    mistakes = Mistakes()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "small.yaml").write_text(yaml.safe_dump(_EXPERIMENT))
        commands = _commands(folder / "small.yaml")[:count]
        lasting, expected = [], []
        for number, command in enumerate(commands):
            # Once for what must be compiled, then for the time that it takes.
            undisturbed(command.arguments[1:], folder / f"first{number}", command.arguments[0])
            began = time.monotonic()
            expected.append(undisturbed(command.arguments[1:], folder / f"whole{number}", command.arguments[0]))
            lasting.append(time.monotonic() - began)
            say(f"  {command.name}: {lasting[-1]:.0f} s undisturbed")
        chance = random.Random(seed)
        with ThreadPoolExecutor(_SIDE_BY_SIDE) as pool:
            tries = []
            for number in range(count):
                k, kind = number % len(commands), list(_CODES)[number // len(commands) % 2]
                moment = chance.uniform(0.0, 1.0) * lasting[k]
                place = folder / f"try{number}"
                tries.append(pool.submit(_try, commands[k], kind, moment, place, expected[k], mistakes))
            stops = [each.result() for each in tries]
    return _figures(count, stops, mistakes)


def _figures(count: int, stops: list[_Stop], mistakes: Mistakes) -> list[Finding]:
    hows = [stop.how for stop in stops]
    note = ", ".join(f"{hows.count(how)} {how}" for how in sorted(set(hows)))
    return [
        exactly("signals", len(stops), count, note),
        at_most("longest end after a signal, s", max(stop.seconds for stop in stops), BAR),
        exactly("processes left", sum(stop.left for stop in stops), 0),
        exactly("temporary files left in run directories", sum(stop.files for stop in stops), 0),
        exactly("runs not marked interrupted", sum(stop.unmarked for stop in stops), 0),
        mistakes.none_of("wrong exit codes, missing lines, or resumes with other bytes"),
    ]


def _commands(experiment: Path) -> list[_Command]:
    one = ["train", *_SMALL, "generations=16"]
    several = ["train", "-m", *_SMALL, "generations=8", "seed=0,1,2"]
    sweep = ["sweep", f"experiment={experiment}", "budget=smoke"]
    commands = [
        _Command("one run", one, ["resume=true"]),
        _Command("runs in turn", several, ["resume=true"]),
        _Command("a sweep", sweep, []),
    ]
    if find_spec("hydra_plugins.hydra_joblib_launcher"):
        commands.append(_Command("runs side by side", [*several, *_JOBLIB, "executor=serial"], ["resume=true"]))
    processes = ["train", "task=gym", "budget=smoke", "population=40", "generations=16", "executor.workers=2"]
    return [*commands, _Command("in processes", processes, ["resume=true"])]


def _try(
    command: _Command, kind: int, moment: float, folder: Path, expected: dict[str, bytes], mistakes: Mistakes
) -> _Stop:
    """One signal, `moment` seconds after the start, and the same command again."""
    name = f"{command.name}, {signal.Signals(kind).name} after {moment:.2f} s"
    with Program([*command.arguments, "output=out"], folder) as program:
        time.sleep(moment)
        running, heard = program.code is None, program.listens
        sent = time.monotonic()
        # A terminal sends Ctrl-C to all processes of the group, a scheduler SIGTERM to the first one alone.
        program.send(kind, to_all=kind == signal.SIGINT)
        code = program.wait(HANGING)
        while program.left_over() and time.monotonic() - sent < _LONGEST_WAIT:
            time.sleep(0.01)
        seconds = time.monotonic() - sent
        stop = _judge(name, program, kind, code, seconds, mistakes, running=running, heard=heard)
    with Program([*command.arguments, *command.resume, "output=out"], folder) as again:
        if again.wait(HANGING) != 0:
            mistakes.add(f"{name}: did not go on: {again.errors[-300:]}")
    if differing := difference(results(folder / "out"), expected):
        mistakes.add(f"{name}: {differing} differ")
    shutil.rmtree(folder)
    return stop


def _judge(
    name: str,
    program: Program,
    kind: int,
    code: int | None,
    seconds: float,
    mistakes: Mistakes,
    *,
    running: bool,
    heard: bool,
) -> _Stop:
    """What the process did, with complaints about what it should not have done."""
    left = len(program.left_over())
    files = len(list((program.temporary.parent / "out").rglob("*.tmp")))
    errors = program.errors.strip()
    if code == 0 and running and not heard:
        return _Stop(0.0, left, files, "lost in the start of Python")
    if left or files or seconds > BAR:
        say(f"  {name}: {seconds:.1f} s, exit code {code}, {left} processes and {files} temporary files left")
    if code == 0:
        return _Stop(0.0 if not running else seconds, left, files, "done before")
    if code == -kind and "in program" not in errors and "exneat:" not in errors:
        return _Stop(seconds, left, files, "ended before exneat had begun")
    if code != _CODES[signal.Signals(kind)]:
        mistakes.add(f"{name}: exit code {code}: {errors[-300:]}")
    elif "Traceback" in errors or not errors.splitlines() or not errors.splitlines()[-1].startswith("exneat "):
        mistakes.add(f"{name}: does not end in the command that goes on: {errors[-300:]}")
    return _Stop(seconds, left, files, "stopped", _unmarked(program.temporary.parent / "out"))


def _unmarked(output: Path) -> int:
    """How many runs are still said to be running."""
    manifests = [json.loads(path.read_text()) for path in output.glob("*/*/manifest.json")]
    return sum(manifest["status"] == "running" for manifest in manifests)
