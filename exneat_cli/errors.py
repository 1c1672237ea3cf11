"""Errors that a user can fix, and the checks that raise them.

Every message names the thing, what was expected, what was given and how to fix it, in at most three
lines; `exneat_cli.main` prints it without a traceback and exits with code 2.
"""

from __future__ import annotations

import difflib
import math
import os
import sys
from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

_LONGEST_VALUE = 160


class ExneatError(Exception):
    """An error that the user can fix: bad input, an unusable directory, a missing file."""


class ConfigError(ExneatError):
    """A setting with an unusable value.

    Args:
        key: the setting's dotted name, as on the command line, e.g. ``noise.sensor_std``.
        expected: what would have been accepted, in words.
        came: the value that was given.
        fix: one sentence on how to correct it; empty if `expected` makes that clear.
    """

    def __init__(self, key: str, expected: str, came: object, fix: str = "") -> None:
        super().__init__(key, expected, came, fix)
        self.key = key

    def __str__(self) -> str:
        key, expected, came, fix = self.args
        message = f"{key}: expected {expected}, got {shortened(came)}"
        return f"{message}\n  {fix}" if fix else message


def shortened(value: object) -> str:
    """The `repr` of a value, shortened to a line or two."""
    try:
        text = repr(value)
    except ValueError:  # an integer of thousands of digits
        text = f"a value of type {type(value).__name__} with thousands of digits"
    return text if len(text) <= _LONGEST_VALUE else f"{text[:_LONGEST_VALUE]}..."


def check_whole(key: str, value: object, low: int, high: int | None = None) -> None:
    """Refuse anything but an integer in ``[low, high]`` (no upper bound if `high` is None) with a `ConfigError`."""
    whole = isinstance(value, int) and not isinstance(value, bool)
    if not whole or value < low or (high is not None and value > high):  # type: ignore[operator]
        bounds = f"a whole number of at least {low}" if high is None else f"a whole number from {low} to {high}"
        raise ConfigError(key, bounds, value)


def check_real(key: str, value: object, low: float, high: float = math.inf) -> None:
    """Refuse anything but a finite number in ``[low, high]`` with a `ConfigError`."""
    if not isinstance(value, int | float) or isinstance(value, bool) or not (is_finite(value) and low <= value <= high):
        bounds = f"a number of at least {low:g}" if high == math.inf else f"a number from {low:g} to {high:g}"
        raise ConfigError(key, bounds, value)


def is_finite(value: float) -> bool:
    """Whether a number is finite as a double; Python's integers can be too large for one."""
    return abs(value) <= sys.float_info.max


def check_flag(key: str, value: object) -> None:
    """Refuse anything but True or False with a `ConfigError`."""
    if not isinstance(value, bool):
        raise ConfigError(key, "true or false", value)


def check_choice(key: str, value: object, choices: Sequence[str]) -> None:
    """Refuse anything but one of `choices` with a `ConfigError`."""
    if not isinstance(value, str) or value not in choices:
        raise ConfigError(key, "one of " + ", ".join(choices), value, nearest(str(value), choices))


def nearest(word: str, known: Iterable[str], cutoff: float = 0.6, prefix: str = "") -> str:
    """Ask whether the nearest `known` word was meant, with `prefix` before it; empty if none is near."""
    close = difflib.get_close_matches(word, list(known), n=1, cutoff=cutoff)
    return f"did you mean {prefix}{close[0]}?" if close else ""


def check_text(key: str, value: object, expected: str = "text") -> None:
    """Refuse anything but printable text with a `ConfigError`, which says that `expected` was expected."""
    if not isinstance(value, str) or not value or not value.isprintable():
        is_plain = isinstance(value, bool | int | float)
        raise ConfigError(key, expected, value, "in a YAML file such text stands in quotes" if is_plain else "")


def check_path(key: str, value: object, expected: str = "a directory") -> Path:
    """Return the path that a setting names, with a leading ``~`` as the home directory; see `check_text`."""
    check_text(key, value, expected)
    return Path(os.path.expanduser(str(value)))


def check_section(key: str, value: object) -> Mapping[str, Any]:
    """Return a mapping from keys to values, and refuse anything else with a `ConfigError`."""
    if not isinstance(value, Mapping):
        raise ConfigError(key, "a section with keys of its own", value)
    return value


def check_keys(prefix: str, values: Mapping[str, Any], known: Collection[str]) -> None:
    """Refuse a key that is not `known` with an `ExneatError` that names the nearest one.

    In messages, keys are preceded by `prefix`, e.g. ``task.``.
    """
    for key in values:
        if key not in known:
            hint = nearest(str(key), known, 0.5, prefix) or "known here: " + ", ".join(known)
            raise ExneatError(f"{prefix}{key}: unknown key (value {shortened(values[key])})\n  {hint}")
