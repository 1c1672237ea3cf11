"""Champions for use elsewhere: one file for each format, loaded when it is asked for."""

from __future__ import annotations

import importlib
from pathlib import Path

from exneat_cli.algorithms import EvolutionSettings
from exneat_cli.records.champion import Champion
from exneat_cli.records.files import make_directory, write_whole
from exneat_cli.tasks import Task

FORMATS = {"python": "champion.py", "onnx": "champion.onnx", "neat": "neat", "dot": "champion.dot"}
"""Each format, which is also its module here, and the file or directory that it makes."""


def export(format: str, champion: Champion, task: Task, evolution: EvolutionSettings, place: Path) -> list[Path]:  # noqa: A002
    """Write a champion in a format of `FORMATS`; returns the files.

    Args:
        format: which.
        champion: the team, from `read_champion`.
        task: what it was trained for.
        evolution: the settings that it evolved under.
        place: the file; of ``neat`` the directory.

    Raises:
        ExneatError: the format cannot hold this champion, its library is not installed, or it cannot be written.
    """
    module = importlib.import_module(f"exneat_cli.records.exports.{format}")
    files: dict[str, str | bytes] = module.files(champion, task, evolution)
    paths = {place / name if name else place: content for name, content in files.items()}
    for path, content in paths.items():
        make_directory(path.parent)
        write_whole(path, content)
    return list(paths)
