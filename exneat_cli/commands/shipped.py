"""Where the data is that comes with exneat."""

from __future__ import annotations

from pathlib import Path

import exneat_cli


def shipped_directory(name: str) -> Path:
    """A folder of data: the copy inside an installed package, else the one beside it in a checkout."""
    package = Path(exneat_cli.__file__).parent
    packaged = package / name
    return packaged if packaged.is_dir() else package.parent / name
