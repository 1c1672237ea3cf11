"""`exneat <command> ...`: finds the command, and turns expected errors into one to three lines."""

from __future__ import annotations

import importlib
import os
import shlex
import signal
import sys
import traceback
from collections.abc import Sequence

from exneat_cli import __version__
from exneat_cli.errors import ExneatError, nearest
from exneat_cli.interruption import SIGNALS, listening, name_window_library, signal_heard
from exneat_cli.output import NO_ROOM, forgiving_output

COMMANDS = {
    "train": "train one variant with one seed; -m trains every combination",
    "resume": "continue an unfinished run, or extend a finished one",
    "sweep": "train all variants of an experiment and test their robustness",
    "search": "search for the settings that learn best",
    "evaluate": "test finished runs under perturbations",
    "watch": "film a run's champion next to its networks",
    "report": "make tables, figures and a page from the existing runs",
    "export": "write a run's champion for use without exneat",
    "inspect": "show a run's wiring or a task's parts, or list the runs",
    "doctor": "check whether exneat works on this machine, and say how to fix problems",
    "completion": "print a completion script for bash, zsh or fish",
}
"""Each command's name, which is also its module in `exneat_cli.commands`, and what it does."""

_MAKING_FILES = ("train", "resume", "sweep", "search", "evaluate", "report")
"""Commands whose results are files: what they print may be lost without failing them."""

_GRAPHICS = {"egl": "libegl1 libopengl0 libgl1-mesa-dri", "osmesa": "libosmesa6"}
"""Debian packages that each value of MUJOCO_GL needs."""

HELP = """exneat trains and compares modular neuroevolution (NEAT and ExNEAT).

usage: exneat <command> [key=value ...]

{commands}

  exneat train task=ant geometry=all            one run of ExNEAT on Ant
  exneat train task=ant algorithm=neat seed=3   the same task for NEAT
  exneat train -m seed=0,1,2 noise.sensor_std=0,0.1
  exneat train --help                           every setting with its default; works for every command
  exneat train --cfg job task=hunting           print the resulting settings without training
  exneat train --config-dir mine task=own       a task of your own, from mine/task/own.yaml
  exneat train task=custom task.kind=my_module:MyTask   a task of your own, from a class
  exneat resume run=outputs/ant/<run>           continue an interrupted run
  exneat sweep experiment=track_maze            all variants, conditions and seeds, trained and tested
  exneat search space=mutation trials=60        settings chosen from the results of earlier trials
  exneat evaluate run=outputs/ant/<run> sweep=sensor_noise
  exneat watch run=outputs/ant/<run>            a film of the champion
  exneat report                                 outputs/report/index.html
  exneat export run=outputs/ant/<run> format=python     the champion as one Python file; also onnx, neat, dot
  exneat inspect                                the runs under outputs/
  exneat inspect run=outputs/ant/<run>          one run's modules, sensors and joints
  exneat doctor                                 whether exneat works on this machine
  eval "$(exneat completion bash)"              the Tab key completes commands, settings and runs
"""


def program() -> int:
    """Run the installed program: as `main`, but its output need not be read, and a late signal changes nothing."""
    with forgiving_output() as lost:
        code = main()
        for number in SIGNALS:
            signal.signal(number, signal.SIG_IGN)
        sys.stdout.flush()
        if lost:
            print(f"exneat: standard output could not be written: {lost[0].strerror}", file=sys.stderr)
            code = code or (0 if set(sys.argv[1:2]) & set(_MAKING_FILES) else 2)
    return code


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command, by default the process's own; returns its exit code.

    0 means done, 1 a failed job or a machine that cannot run exneat, 2 refused, 128 plus a signal's number interrupted.
    """
    command, *rest = list(sys.argv[1:] if arguments is None else arguments) or ["--help"]
    if command in ("-h", "--help", "help"):
        print(HELP.format(commands="\n".join(f"  {name:<12}{text}" for name, text in COMMANDS.items())), end="")
        return 0
    if command in ("-V", "--version"):
        print(f"exneat {__version__}")
        return 0
    with listening():
        try:
            name_window_library()
            _check_place()
            if command != "doctor" and os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0"):
                raise ExneatError("NUMBA_DISABLE_JIT: expected 0, got 1: nothing runs without compiled code; unset it")
            if command not in COMMANDS:
                hint = nearest(command, COMMANDS) or "see exneat --help"
                raise ExneatError(f"{command}: expected a command, one of {', '.join(COMMANDS)}; {hint}")
            if command == "completion":  # composes nothing, since the user waits for the answer
                return int(importlib.import_module("exneat_cli.commands.completion").run(rest, COMMANDS))
            line = importlib.import_module("exneat_cli.commands.command_line").read_command_line(command, rest)
            if line.shown:
                print(line.show())
                return 0
            return int(importlib.import_module(f"exneat_cli.commands.{command}").run(line))
        except (Exception, KeyboardInterrupt) as error:
            return _ended_by(error, shlex.join(["exneat", command, *rest]))


def _is_of_graphics(error: BaseException) -> bool:
    """Whether PyOpenGL, which MuJoCo imports for some values of MUJOCO_GL, raised it because a library is missing."""
    frames = traceback.walk_tb(error.__traceback__)
    return any(str(frame.f_globals.get("__name__")).startswith(("OpenGL", "mujoco.egl")) for frame, _ in frames)


def _check_place() -> None:
    """Refuse to work in a directory that no longer exists."""
    try:
        os.getcwd()
    except OSError as error:
        why = f"the current directory cannot be used: {error.strerror}"
        raise ExneatError(f"{why}\n  it may have been removed; change to one that exists") from error


def _ended_by(error: BaseException, typed: str) -> int:
    """Say what ended a command if it was not a bug of the program; returns the exit code.

    The command that continues is the note that a command added to the error, or else what was typed.
    """
    if isinstance(error, KeyboardInterrupt) or signal_heard() is not None:
        command = getattr(error, "__notes__", [typed])[-1]
        print(f"exneat: interrupted; to continue:\n{command}", file=sys.stderr, flush=True)
        return 128 + (signal_heard() or signal.SIGINT)
    if isinstance(error, ExneatError):
        message = str(error)
    elif (library := os.environ.get("MUJOCO_GL")) and _is_of_graphics(error):
        install = f"apt-get install {_GRAPHICS.get(library, 'its libraries')}"
        message = f"MUJOCO_GL={library}: MuJoCo cannot load it: {error}\n  unset it, or {install}; see exneat doctor"
    elif isinstance(error, ImportError):
        message = f"{error}\n  python -m pip check lists libraries that are missing or have the wrong version"
    elif isinstance(error, RuntimeError) and "environment variable" in str(error):  # MuJoCo's own words
        message = f"{error}\n  unset it, or see exneat doctor"
    elif isinstance(error, OSError) and error.errno in NO_ROOM:
        where = error.filename or "temporary files"
        message = f"{where}: {error.strerror}; check the disk, output= and TMPDIR"
    else:
        raise error
    # Text from a stranger's file must not control the terminal.
    printable = "".join(c if c.isprintable() or c == "\n" else ascii(c)[1:-1] for c in message)
    print(f"exneat: {printable}", file=sys.stderr)
    return 2
