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
from exneat_cli.interruption import listen, listening, signal_heard

COMMANDS = {
    "train": "train one variant with one seed; -m trains every combination",
    "sweep": "train all variants of an experiment and test how they hold up",
    "evaluate": "test finished runs under perturbations",
    "report": "make tables, figures and a page of them from the runs there are",
    "inspect": "show a run's wiring, or list the runs",
    "doctor": "say whether this machine is fit for exneat, and what to fix",
}
"""Each command's name, which is also its module in `exneat_cli.commands`, and what it does."""

USAGE = {
    "sweep": "usage: exneat sweep experiment=<name or file.yaml> [budget=paper|quick|smoke] [key=value ...]\n"
    "  every setting of exneat train is one of all runs here; hydra/launcher=joblib runs them side by side",
    "report": "usage: exneat report [budget=paper|quick|smoke] [only=figure-4.3] [experiment=<name or file.yaml>]\n"
    "  [axis=generation|episodes|env_steps] [output=<root of runs, outputs by default>]",
    "inspect": "usage: exneat inspect [run=<run directory>] [output=<root of runs, outputs by default>]",
    "doctor": "usage: exneat doctor [output=<root of runs, outputs by default>]\n"
    "  each line is ok, degraded (works, but slower or in part) or broken; exit code 1 if anything is broken",
}
"""What --help prints for the commands that Hydra does not answer for."""

_RESUMABLE = "exneat: interrupted; run the same command again to resume (a single exneat train also needs resume=true)"
_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""Full disk, used-up quota, limit of file size: no fault of ours, wherever a library meets them."""

HELP = """exneat trains and compares modular neuroevolution (NEAT and ExNEAT).

usage: exneat <command> [key=value ...]

{commands}

  exneat train task=ant geometry=all            one run of ExNEAT on Ant
  exneat train task=ant algorithm=neat seed=3   the same task for NEAT
  exneat train -m seed=0,1,2 noise.sensor_std=0,0.1
  exneat train --help                           every setting with its default
  exneat sweep experiment=track_maze            all variants, conditions and seeds, trained and tested
  exneat evaluate run=outputs/ant/<run> sweep=sensor_noise
  exneat report                                 outputs/report/index.html
  exneat inspect                                the runs under outputs/
  exneat inspect run=outputs/ant/<run>          one run's modules, sensors and joints
  exneat doctor                                 whether this machine is fit for exneat
"""


def _printable(message: str) -> str:
    """The message with control characters spelled out: what a stranger wrote must not steer the terminal."""
    return "".join(c if c.isprintable() or c == "\n" else ascii(c)[1:-1] for c in message)


def program() -> int:
    """What the installed program calls: as `main`, but a late signal changes nothing any more."""
    listen()
    code = _answer(sys.argv[1:])
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)
    _drop_what_nobody_reads()
    return code


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; returns its exit code.

    0 is done, 1 a failed job or an unfit machine, 2 refused, 130 or 143 interrupted.

    Args:
        arguments: without the program's name; None takes the process's own.
    """
    with listening():
        return _answer(sys.argv[1:] if arguments is None else arguments)


def _answer(arguments: Sequence[str]) -> int:
    try:
        return _run(arguments)
    except (Exception, KeyboardInterrupt) as error:
        if isinstance(error, KeyboardInterrupt) or signal_heard() is not None:
            with contextlib.suppress(OSError, ValueError):  # nobody reads
                print(_RESUMABLE, file=sys.stderr, flush=True)
            return 128 + (signal_heard() or signal.SIGINT)
        if isinstance(error, BrokenPipeError):
            return 0
        message = _expected(error)
        if message is None:
            raise
        print(f"exneat: {_printable(message)}", file=sys.stderr)
        return 2


def _expected(error: BaseException) -> str | None:
    """What to say of an error that is no fault of the program's; None of others."""
    if isinstance(error, ExneatError):
        return str(error)
    if isinstance(error, OSError) and error.errno in _NO_ROOM:
        where = error.filename or "temporary files or the program's own output"
        return f"{where}: {error.strerror}; check the disk, output= and TMPDIR"
    return None


def _run(arguments: Sequence[str]) -> int:
    command, *rest = list(arguments) or ["--help"]
    if command in ("-h", "--help", "help"):
        print(HELP.format(commands="\n".join(f"  {name:<10}{text}" for name, text in COMMANDS.items())), end="")
        return 0
    if command in ("-V", "--version"):
        print(f"exneat {__version__}")
        return 0
    if command not in COMMANDS:
        raise ExneatError(f"{command}: expected a command, one of {', '.join(COMMANDS)}; see exneat --help")
    if rest in (["--help"], ["-h"]) and command in USAGE:
        print(USAGE[command])
        return 0
    code: int = importlib.import_module(f"exneat_cli.commands.{command}").run(rest)
    return code


def _drop_what_nobody_reads() -> None:
    """Python would complain at its end, with another exit code, of output that a closed pipe does not take."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
