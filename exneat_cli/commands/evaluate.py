"""`exneat evaluate`: tests finished runs under perturbations."""

from __future__ import annotations

from exneat_cli.commands.command_line import CommandLine
from exneat_cli.commands.jobs import Job, finished_runs, name_code_of_runs, with_sweeps
from exneat_cli.commands.run_table import print_table
from exneat_cli.errors import ConfigError, ExneatError, check_section
from exneat_cli.records import RunDirectory, build, read_robustness
from exneat_cli.rollouts import Executor, is_compiled
from exneat_cli.runs import load_settings, progress_for_terminal


def run(line: CommandLine) -> int:
    """Test runs under perturbations; returns the exit code.

    Raises:
        ExneatError: a run, a sweep or a level is unusable; nothing is run then.
    """
    plain = line.compose_only(("run", "task", "sweeps"), ("sweep", "executor"))
    name_code_of_runs(line, plain)
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
        came = f"{directory.robustness}: {tested} levels tested"
        print(came if tested else f"{directory.path}: all levels were tested before")
        _print_levels(job, directory)
    return 0


def _print_levels(job: Job, directory: RunDirectory) -> None:
    """Print the run's scores at each requested level, with the label and unit of each sweep."""
    rows = {(row.parameter, row.level, row.episodes): row for row in read_robustness(directory.robustness)}
    for sweep in job.sweeps:
        reached = [rows[sweep.name, float(level), job.episodes] for level in sweep.levels]
        cells = [[f"{row.level:g}", f"{row.fitness_mean:.4g}", f"{row.fitness_std:.3g}"] for row in reached]
        print(f"\n{sweep.label or sweep.name}; {job.settings.task.fitness_name} over {job.episodes} episodes")
        print_table([["level", "mean", "sd"], *cells], numbers=(0, 1, 2))
