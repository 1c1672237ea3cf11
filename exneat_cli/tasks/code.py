"""Code that a task's settings name: only who runs exneat may have it imported, no file that somebody else wrote."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Collection

from exneat_cli.errors import ConfigError

_SETTINGS = ("env_id",)
"""Settings of tasks that may name code, as ``module:name``."""


def code_in(section: object) -> dict[str, str]:
    """Settings of a ``task`` section that would import a module which is not imported yet, by dotted name."""
    values = {key: section.get(key) for key in _SETTINGS} if isinstance(section, dict) else {}
    named = {f"task.{key}": value for key, value in values.items() if isinstance(value, str) and ":" in value}
    return {key: value for key, value in named.items() if value.partition(":")[0] not in sys.modules}


def refuse_code(section: object, named: Collection[str] = ()) -> None:
    """Refuse a ``task`` section that names code, before anything is imported; but for the settings in `named`.

    Raises:
        ConfigError: it does.
    """
    for key, value in code_in(section).items():
        if key not in named:
            fix = f"a file that somebody wrote imports nothing; if you trust it, add {key}={value} to the command line"
            raise ConfigError(key, "no code to import", value, fix)


def import_code(section: object) -> None:
    """Import what a ``task`` section of the user's own names.

    Raises:
        ConfigError: it cannot be imported.
    """
    for key, value in code_in(section).items():
        try:
            importlib.import_module(value.partition(":")[0])
        except Exception as error:  # whatever that code raises
            said = " ".join(f"{type(error).__name__}: {error}".split())[:200]
            raise ConfigError(key, "code that can be imported, as module:name", value, said) from error
