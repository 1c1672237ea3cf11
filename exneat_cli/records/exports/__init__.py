"""Champions for use without exneat: one module per format, loaded when needed."""

from __future__ import annotations

import importlib
from pathlib import Path

from exneat_cli.algorithms import EvolutionSettings
from exneat_cli.records.champion import Champion
from exneat_cli.tasks import Task

FORMATS = {"python": "champion.py", "onnx": "champion.onnx", "neat": "neat", "dot": "champion.dot"}
"""Each format, which is also its module here, and the file or directory that it makes."""


def exported(
    format: str,  # noqa: A002
    champion: Champion,
    task: Task,
    evolution: EvolutionSettings,
    place: Path,
) -> dict[Path, str | bytes]:
    """The contents of a champion's files in a format of `FORMATS`; nothing is written.

    Args:
        format: one of `FORMATS`.
        champion: the team, from `read_champion`.
        task: what it was trained for.
        evolution: the settings that it evolved under.
        place: the file; for ``neat``, the directory.

    Raises:
        ExneatError: the format cannot hold this champion, or its library is not installed.
    """
    module = importlib.import_module(f"exneat_cli.records.exports.{format}")
    files: dict[str, str | bytes] = module.files(champion, task, evolution)
    return {place / name if name else place: content for name, content in files.items()}
