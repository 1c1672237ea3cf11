"""`exneat <command> ...`: finds the command, and turns expected errors into one to three lines."""

from __future__ import annotations

import contextlib
import errno
import importlib
import os
import signal
import sys
from collections.abc import Sequence

from exneat_cli import __version__
from exneat_cli.errors import ExneatError
from exneat_cli.interruption import listening, name_window_library, signal_heard

COMMANDS = {
    "train": "train one variant with one seed; -m trains every combination",
    "sweep": "train all variants of an experiment and test how they hold up",
    "evaluate": "test finished runs under perturbations",
    "watch": "film a run's champion, its networks beside it",
    "report": "make tables, figures and a page of them from the runs there are",
    "export": "write a run's champion for use elsewhere",
    "inspect": "show a run's wiring, or list the runs",
    "doctor": "say whether this machine is fit for exneat, and how to fix what is not",
}
"""Each command's name, which is also its module in `exneat_cli.commands`, and what it does."""

_RESUMABLE = "exneat: interrupted; run the same command again to resume (a single exneat train also needs resume=true)"
_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""Full disk, used-up quota, limit of file size: no fault of ours, wherever a library meets them."""

HELP = """exneat trains and compares modular neuroevolution (NEAT and ExNEAT).

usage: exneat <command> [key=value ...]

{commands}

  exneat train task=ant geometry=all            one run of ExNEAT on Ant
  exneat train task=ant algorithm=neat seed=3   the same task for NEAT
  exneat train -m seed=0,1,2 noise.sensor_std=0,0.1
  exneat train --help                           every setting with its default; the same for the other commands
  exneat train --cfg job task=hunting           what these settings come to, without training
  exneat train --config-dir mine task=own       mine/task/own.yaml is a task of your own
  exneat train task=custom task.kind=my_module:MyTask   and so is this class
  exneat sweep experiment=track_maze            all variants, conditions and seeds, trained and tested
  exneat evaluate run=outputs/ant/<run> sweep=sensor_noise
  exneat watch run=outputs/ant/<run>            a film of the champion
  exneat report                                 outputs/report/index.html
  exneat export run=outputs/ant/<run> format=python     the champion as one file of Python; also onnx, neat, dot
  exneat inspect                                the runs under outputs/
  exneat inspect run=outputs/ant/<run>          one run's modules, sensors and joints
  exneat doctor                                 whether this machine is fit for exneat
"""


def program() -> int:
    """What the installed program calls: as `main`, but a late signal changes nothing any more."""
    code = main()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:  # a closed pipe: Python would complain at its end, with another exit code
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
    return code


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command, by default the process's own; returns its exit code.

    0 is done, 1 a failed job or an unfit machine, 2 refused, 130 or 143 interrupted.
    """
    command, *rest = list(sys.argv[1:] if arguments is None else arguments) or ["--help"]
    if command in ("-h", "--help", "help"):
        print(HELP.format(commands="\n".join(f"  {name:<10}{text}" for name, text in COMMANDS.items())), end="")
        return 0
    if command in ("-V", "--version"):
        print(f"exneat {__version__}")
        return 0
    with listening():
        try:
            name_window_library()
            if command not in COMMANDS:
                raise ExneatError(f"{command}: expected a command, one of {', '.join(COMMANDS)}; see exneat --help")
            line = importlib.import_module("exneat_cli.commands.command_line").read_command_line(command, rest)
            if line.shown:
                print(line.show())
                return 0
            return int(importlib.import_module(f"exneat_cli.commands.{command}").run(line))
        except (Exception, KeyboardInterrupt) as error:
            return _ended_by(error)


def _ended_by(error: BaseException) -> int:
    """Say what ended a command, where that is no fault of the program's; returns the exit code."""
    if isinstance(error, KeyboardInterrupt) or signal_heard() is not None:
        with contextlib.suppress(OSError, ValueError):  # nobody reads
            print(_RESUMABLE, file=sys.stderr, flush=True)
        return 128 + (signal_heard() or signal.SIGINT)
    if isinstance(error, BrokenPipeError):
        return 0
    if isinstance(error, ExneatError):
        message = str(error)
    elif isinstance(error, ImportError):
        message = f"{error}\n  python -m pip check says which libraries are missing or of another version"
    elif isinstance(error, OSError) and error.errno in _NO_ROOM:
        where = error.filename or "temporary files or the program's own output"
        message = f"{where}: {error.strerror}; check the disk, output= and TMPDIR"
    else:
        raise error
    # What a stranger wrote must not steer the terminal.
    printable = "".join(c if c.isprintable() or c == "\n" else ascii(c)[1:-1] for c in message)
    print(f"exneat: {printable}", file=sys.stderr)
    return 2
