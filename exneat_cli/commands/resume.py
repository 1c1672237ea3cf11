"""`exneat resume`: continues a run with the settings in its directory."""

from __future__ import annotations

from dataclasses import replace

from exneat_cli.commands.command_line import CommandLine
from exneat_cli.commands.jobs import name_code_of_runs, with_sweeps
from exneat_cli.commands.train import tell
from exneat_cli.errors import ExneatError, check_path
from exneat_cli.records import RunDirectory, build
from exneat_cli.rollouts import Executor
from exneat_cli.runs import progress_for_terminal, read_settings


def run(line: CommandLine) -> int:
    """Continue ``run=<directory>``; returns the exit code.

    Raises:
        ExneatError: there is no such run, its settings cannot be read, or a setting makes no sense.
    """
    plain = line.compose_only(("run", "generations", "tracker", "task", "sweeps"), ("sweep", "executor"))
    name_code_of_runs(line, plain)
    directory = RunDirectory(check_path("run", plain["run"], "a run directory"))
    settings = read_settings(directory)
    path = directory.path.absolute()
    asked = {key: plain[key] for key in ("generations", "tracker") if plain[key] is not None}
    if "executor" in plain:
        asked["executor"] = build(Executor, plain["executor"], "executor.")
    place = str(directory.path.parent.parent)
    settings = replace(settings, resume=True, name=path.parent.name, output=place, **asked)
    if settings.directory.path.absolute() != path:
        came = f"its settings belong in {settings.directory.path.name}"
        raise ExneatError(f"run={directory.path}: is not where exneat puts such a run: {came}")
    job = with_sweeps("resume", settings, plain)
    tell(job.do(progress_for_terminal(), line.words, go_on=True))
    return 0
