"""Reading YAML as data: nothing in it is run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

from exneat_cli.errors import ExneatError
from exneat_cli.records.files import read_text


def read_yaml(path: Path) -> dict[str, Any]:
    """Read keys with values.

    Raises:
        ExneatError: the file is missing, unreadable, no YAML, or holds something else.
    """
    try:
        content = yaml.safe_load(read_text(path))
    except (yaml.YAMLError, ValueError) as error:
        mark = getattr(error, "problem_mark", None)
        place = f"{path}:{mark.line + 1}" if mark else str(path)
        problem = getattr(error, "problem", None) or " ".join(str(error).split())
        raise ExneatError(f"{place}: expected YAML, got something else: {problem}") from error
    if not isinstance(content, dict):
        raise ExneatError(f"{path}: expected keys with values, got {type(content).__name__}")
    return content
