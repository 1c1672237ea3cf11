"""Where the data is that comes with exneat, and which of several YAML files of a name counts."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import exneat_cli


def shipped_directory(name: str) -> Path:
    """A folder of data: the copy inside an installed package, else the one beside it in a checkout."""
    package = Path(exneat_cli.__file__).parent
    packaged = package / name
    return packaged if packaged.is_dir() else package.parent / name


def yaml_file(folders: Iterable[Path], name: str) -> Path | None:
    """The file ``<name>.yaml`` of the first of these folders that has one."""
    return next((path for folder in folders if (path := folder / f"{name}.yaml").is_file()), None)


def section_of(name: str, path: Path) -> str:
    """The section that the file of ``<group>/<option>`` fills: that of its group, or empty for all settings."""
    is_global = "/" not in name or path.read_text("utf-8").startswith("# @package _global_")
    return "" if is_global else name.partition("/")[0]
