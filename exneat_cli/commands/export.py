"""`exneat export`: writes the champion of a finished run for use without exneat."""

from __future__ import annotations

from pathlib import Path

from exneat_cli.commands.command_line import CommandLine
from exneat_cli.commands.jobs import finished_runs, name_code_of_runs
from exneat_cli.errors import ConfigError, ExneatError, check_choice, check_path
from exneat_cli.records import make_directory, write_whole
from exneat_cli.records.exports import FORMATS, exported
from exneat_cli.runs import load_champion, load_settings


def run(line: CommandLine) -> int:
    """Write champions in a format of `FORMATS`, each into the folder ``export`` of its run unless ``output`` is set.

    Raises:
        ExneatError: a run is unusable, or its champion does not fit the format; nothing is written then.
    """
    plain = line.compose_only(("run", "format", "output", "task"))
    name_code_of_runs(line, plain)
    check_choice("format", plain["format"], list(FORMATS))
    form, runs = plain["format"], finished_runs(plain["run"])
    output = plain["output"]
    if output is not None:
        output = check_path("output", output, "a file, or for format=neat a directory")
        if len(runs) > 1:
            raise ConfigError("output", "null for several runs, since each has its own file", plain["output"])
    loaded = [
        (directory, settings := load_settings(directory), load_champion(directory, settings)) for directory in runs
    ]
    files: dict[Path, str | bytes] = {}
    for directory, settings, champion in loaded:
        place = directory.path / "export" / FORMATS[form] if output is None else output
        try:
            files |= exported(form, champion, settings.task, settings.evolution, place)
        except ExneatError as error:
            raise ExneatError(f"{directory.path}: {error}") from error
    for path, content in files.items():
        make_directory(path.parent)
        write_whole(path, content)
        print(f"Written: {path}")
    return 0
