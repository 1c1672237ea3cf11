"""`exneat evaluate`: how finished runs hold up when the world gets worse."""

from __future__ import annotations

from exneat_cli.commands.command_line import CommandLine
from exneat_cli.commands.jobs import finished_runs, name_code, with_sweeps
from exneat_cli.errors import ConfigError, ExneatError, check_keys, check_section
from exneat_cli.records import build
from exneat_cli.rollouts import Executor, is_compiled
from exneat_cli.runs import load_settings, progress_for_terminal


def run(line: CommandLine) -> int:
    """Test runs under perturbations; returns the exit code.

    Raises:
        ExneatError: a run, a sweep or a level is unusable; nothing was run then.
    """
    plain = line.compose_only(("run", "task", "sweeps"), ("sweep", "executor"))
    check_keys("task.", check_section("task", plain["task"]), ("kind", "env_id"))
    name_code(line, plain)
    if not plain["sweeps"]:
        raise ConfigError("sweep", "what to perturb, e.g. sweep=sensor_noise", "none")
    where = check_section("executor", plain.get("executor", {}))
    build(Executor, where, "executor.")
    planned = []
    for directory in finished_runs(plain["run"]):
        try:
            planned.append((directory, with_sweeps("", load_settings(directory), plain)))
        except ConfigError as error:
            raise ExneatError(f"{directory.path}: {error}") from error
    for directory, job in planned:
        fitting = "threads" if is_compiled(job.settings.task) else "processes"
        executor = build(Executor, {"name": fitting, **where}, "executor.")
        tested = job.test(directory, executor, progress_for_terminal())
        came = f"{directory.robustness}: {tested} levels tested now"
        print(came if tested else f"{directory.path}: all there already")
    return 0
