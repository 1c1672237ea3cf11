"""A user's own configuration directory, checked before Hydra reads it."""

from __future__ import annotations

import codecs
from pathlib import Path

from exneat_cli.errors import ExneatError, shortened
from exneat_cli.records import check_yaml, read_yaml

_CODE_MAY_COME_FROM = "hydra_plugins."


def check_own_files(directory: Path, packaged: Path | None) -> None:
    """Refuse a directory with files that Hydra would choke on, misread, pass over or call code for.

    Args:
        directory: the user's.
        packaged: exneat's own, if both are searched: Hydra silently prefers its files to a user's of the same name.

    Raises:
        ExneatError: it is no directory, or a file in it is unusable, empty or has the name of a packaged one.
    """
    if not directory.is_dir():
        came = "a file" if directory.exists() else "nothing"
        raise ExneatError(f"{directory}: expected a directory with configuration files, got {came}")
    for path in sorted(path for path in directory.rglob("*") if path.suffix in (".yaml", ".yml")):
        name = path.relative_to(directory)
        if path.suffix == ".yml":
            raise ExneatError(f"{path}: Hydra passes over .yml; rename it to {name.stem}.yaml")
        if packaged is not None and (packaged / name).exists():
            raise ExneatError(f"{path}: exneat has a {name} of its own, which would be taken instead; rename yours")
        for key, line, value in check_yaml(path):
            if key == "_target_" and not value.startswith(_CODE_MAY_COME_FROM):
                raise ExneatError(f"{path}:{line}: _target_ would call {value}; a configuration may not call code")
        if path.read_bytes().startswith(codecs.BOM_UTF8):
            raise ExneatError(f"{path}: begins with a byte order mark, which Hydra misreads; save it without one")
        _check_defaults(path, read_yaml(path).get("defaults", []))


def _check_defaults(path: Path, defaults: object) -> None:
    entries = defaults if isinstance(defaults, list) else [None]
    for entry in entries:
        if not isinstance(entry, str) and not (isinstance(entry, dict) and len(entry) == 1):
            came = shortened(defaults if entry is None else entry)
            raise ExneatError(f"{path}: defaults: expected a list of entries such as /evolution: recurrent, got {came}")
