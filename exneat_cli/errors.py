"""Errors that a user can mend, and the checks that raise them.

Every message names the thing, what was expected, what came and how to mend it, in at most three
lines; `exneat_cli.main` prints it without a traceback and exits with code 2.
"""

from __future__ import annotations

import math
from collections.abc import Sequence


class ExneatError(Exception):
    """Something that the user can mend: bad input, an unusable directory, a missing file."""


class ConfigError(ExneatError):
    """A setting with an unusable value.

    Args:
        key: the setting's dotted name, as on the command line, e.g. ``noise.sensor_std``.
        expected: what would have been accepted, in words.
        came: the value that was given.
        mend: one sentence on how to put it right; left out where `expected` says it already.
    """

    def __init__(self, key: str, expected: str, came: object, mend: str = "") -> None:
        super().__init__(key, expected, came, mend)
        self.key = key

    def __str__(self) -> str:
        key, expected, came, mend = self.args
        message = f"{key}: expected {expected}, got {came!r}"
        return f"{message}\n  {mend}" if mend else message


def check_whole(key: str, value: object, low: int, high: int | None = None) -> None:
    """Refuse anything but an integer in ``[low, high]`` (no upper bound if `high` is None).

    Raises:
        ConfigError: `value` is a bool, not an integer, or out of range.
    """
    bounds = f"a whole number of at least {low}" if high is None else f"a whole number from {low} to {high}"
    if not isinstance(value, int) or isinstance(value, bool):
        raise ConfigError(key, bounds, value)
    if value < low or (high is not None and value > high):
        raise ConfigError(key, bounds, value)


def check_real(key: str, value: object, low: float, high: float = math.inf) -> None:
    """Refuse anything but a finite number in ``[low, high]``.

    Raises:
        ConfigError: `value` is not a number, is NaN or infinite, or out of range.
    """
    bounds = f"a number of at least {low:g}" if high == math.inf else f"a number from {low:g} to {high:g}"
    if not isinstance(value, int | float) or isinstance(value, bool):
        raise ConfigError(key, bounds, value)
    if not math.isfinite(value) or value < low or value > high:
        raise ConfigError(key, bounds, value)


def check_flag(key: str, value: object) -> None:
    """Refuse anything but True or False.

    Raises:
        ConfigError: `value` is not a bool.
    """
    if not isinstance(value, bool):
        raise ConfigError(key, "true or false", value)


def check_choice(key: str, value: object, choices: Sequence[str]) -> None:
    """Refuse anything but one of `choices`.

    Raises:
        ConfigError: `value` is none of them.
    """
    if not isinstance(value, str) or value not in choices:
        raise ConfigError(key, "one of " + ", ".join(choices), value)
