"""Where exneat's own data is, and which of several YAML files of the same name is used."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import exneat_cli
from exneat_cli.errors import ConfigError, check_path


def shipped_directory(name: str) -> Path:
    """A folder of data: the copy inside an installed package, else the one beside it in a checkout."""
    package = Path(exneat_cli.__file__).parent
    packaged = package / name
    return packaged if packaged.is_dir() else package.parent / name


def shipped_files(folder: str) -> dict[str, Path]:
    """The YAML files in a folder of data, by name, without the catalogue of figures, which is not an experiment."""
    return {path.stem: path for path in sorted(shipped_directory(folder).glob("*.yaml")) if path.stem != "catalogue"}


def chosen_file(key: str, name: object, folder: str) -> Path:
    """The YAML file that a setting names: one of `shipped_files`, or the user's own, by its path.

    Raises:
        ConfigError: there is no file of that name.
    """
    known = shipped_files(folder)
    expected = f"one of {', '.join(known)}, or a .yaml file"
    if isinstance(name, str) and name.endswith((".yaml", ".yml")):
        return check_path(key, name, expected)
    if not isinstance(name, str) or name not in known:
        raise ConfigError(key, expected, name)
    return known[name]


def yaml_file(folders: Iterable[Path], name: str) -> Path | None:
    """The file ``<name>.yaml`` of the first of these folders that has one."""
    return next((path for folder in folders if (path := folder / f"{name}.yaml").is_file()), None)


def section_of(name: str, path: Path) -> str:
    """The section that the file of ``<group>/<option>`` fills: that of its group, or empty for all settings."""
    is_global = "/" not in name or path.read_text("utf-8").startswith("# @package _global_")
    return "" if is_global else name.partition("/")[0]
