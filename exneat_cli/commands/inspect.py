"""`exneat inspect`: the list of runs, a run's wiring in words, or a task's parts before any run.

The list does not import genomes and simulators, which would take a second.
"""

from __future__ import annotations

import glob
import sys

from exneat_cli.commands.command_line import CommandLine
from exneat_cli.commands.run_table import ListedRun, print_runs, sorted_runs, write_runs
from exneat_cli.errors import ConfigError, check_path, check_text
from exneat_cli.records import RunDirectory, find_runs, runs_at

_WITH_TASKS = (
    *("task", "algorithm", "linkage", "geometry", "evolution", "recipe", "wiring", "judging", "champion", "pairing"),
    *("budgets", "executor", "name"),
)
"""What a task's file and its recipe set; only the task itself is shown."""


def run(line: CommandLine) -> int:
    """Print the parts of ``task=<name>``, the wiring of one run, or a list of several.

    Raises:
        ExneatError: an argument makes no sense, or the run has no champion to show.
    """
    plain = line.compose_only(("run", "output", "sort", "csv"), _WITH_TASKS)
    check_text("sort", plain["sort"], "a column to sort by")
    if "task" in plain:
        from exneat_cli.commands.jobs import name_code
        from exneat_cli.commands.wiring_in_words import show_task
        from exneat_cli.runs import read_task

        name_code(line, plain)
        show_task(read_task(plain["task"]))
        return 0
    pattern = None if plain["run"] is None else check_path("run", plain["run"], "a run directory, or a pattern")
    if pattern is None:
        output = check_path("output", plain["output"])
        found = find_runs(output, tell_unreadable)
    else:
        found = runs_at(pattern)
        if len(found) == 1 or not glob.has_magic(str(pattern)):
            from exneat_cli.commands.wiring_in_words import show_run

            show_run(found[0] if found else RunDirectory(pattern))
            return 0
        if not found:
            fix = "exneat inspect without run= lists all runs"
            raise ConfigError("run", "a run directory, or a pattern that matches some", plain["run"], fix)
    if not found:
        print(f"No runs below {output}; exneat train creates one.")
        return 0
    runs = sorted_runs([ListedRun.read(each) for each in found], plain["sort"])
    if plain["csv"] is not None:
        write_runs(check_path("csv", plain["csv"], "a file to write"), runs)
    print_runs(runs)
    return 0


def tell_unreadable(error: OSError) -> None:
    """Name a folder that cannot be read, so that its runs are missing."""
    print(f"exneat: {error.filename}: cannot be read: {error.strerror}; runs in it are left out", file=sys.stderr)
