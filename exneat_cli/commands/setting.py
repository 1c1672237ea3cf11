"""One setting of a command line, written key=value.

A value means the same in every command. One that Hydra's grammar cannot read is taken as text, so that paths may
contain brackets, quotes and letters of any script. A value with quotes of its own, such as ``"name='3'"``, is always
text, and so is the value of a name or a path.
"""

from __future__ import annotations

import contextlib
import json
from collections.abc import Sequence
from pathlib import Path

from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import Override, Quote, QuotedString, ValueType
from hydra.errors import HydraException

from exneat_cli.errors import ConfigError, ExneatError

_OF_LAUNCHERS = ("launcher", "sweep.dir", "job.env_set")
"""Hydra's own settings that a user may change; exneat sets all others itself."""
_TEXTS = {"name", "output", "run", "experiment", "only", "space", "style", "task.model", "task.env_id"}
"""Settings that are names and paths: their values are text even if they look like a number or a list."""
LONGEST = 300
"""At most this many characters of what a user typed, or of a library's message, are repeated in ours."""


def as_written(value: object) -> str:
    """A value in Hydra's grammar; text is quoted, so that it stays text."""
    if isinstance(value, list):
        return f"[{','.join(map(as_written, value))}]"
    return QuotedString(value, Quote.single).with_quotes() if isinstance(value, str) else json.dumps(value)


def is_hydras(text: str) -> bool:
    """Whether the setting is one of Hydra's own."""
    return text.lstrip("+").startswith(("hydra.", "hydra/"))


def read_setting(text: str, directories: Sequence[Path], *, multirun: bool = False) -> str:
    """Return the setting as Hydra's composition takes it; unknown keys pass, since dataclasses name the nearest key.

    Raises:
        ExneatError: it cannot be read, may not be set by the user, or has several values outside of a multirun.
    """
    readable, override = _parsed(text)
    key = override.key_or_group
    if not key:
        raise ExneatError(f"{text}: expected key=value, got no key")
    if override.is_delete():
        raise ExneatError(f"{text}: a setting cannot be deleted; leave it out, or give it the value you want")
    if override.is_sweep_override() and not (multirun and override.is_discrete_sweep() and not is_hydras(key)):
        raise ExneatError(
            f"{text}: expected one value, got several\n"
            f"  exneat train -m (--multirun) runs each of them; a list is written {key}=[...], text in quotes"
        )
    section, _, name = key.replace("/", ".").partition(".")
    if section == "hydra":
        if not name.startswith(_OF_LAUNCHERS):
            fix = "you may set hydra/launcher=, hydra.launcher.* and hydra.sweep.dir=; output= says where runs go"
            raise ExneatError(f"{text}: exneat sets hydra.{name} itself\n  {fix}")
        return readable
    if not any((directory / key).is_dir() for directory in directories):
        return f"++{readable.lstrip('+')}"
    if not override.is_sweep_override():
        value = override.value()
        if isinstance(value, list) and key != "sweep":  # which takes several options at once
            raise ConfigError(key, "one option", value, f"exneat train -m {key}=... runs several")
        if not isinstance(value, str | list):
            raise ConfigError(key, "the name of an option", value)
    return readable


def _parsed(text: str) -> tuple[str, Override]:
    """The setting in a form that Hydra's grammar reads, and the result."""
    parser = OverridesParser.create()
    key, separator, value = text.partition("=")
    quoted = f"{key}={as_written(value.strip())}"
    for readable in (text, quoted) if separator else (text,):
        with contextlib.suppress(HydraException):
            override = parser.parse_override(readable)
            if key.lstrip("+") not in _TEXTS or override.is_delete():
                return readable, override
            if override.is_sweep_override():
                return _parsed_texts(readable, override)
            is_text = override.value() is None or isinstance(override.value(), str)
            return (readable, override) if is_text else (quoted, parser.parse_override(quoted))
    raise ExneatError(f"{text[:LONGEST]}: expected key=value, e.g. seed=3")


def _parsed_texts(text: str, override: Override) -> tuple[str, Override]:
    """Several values of a setting whose values are text."""
    key, _, value = text.partition("=")
    each = value.split(",")
    if override.value_type != ValueType.SIMPLE_CHOICE_SWEEP or len(each) != len(list(override.sweep_iterator())):
        return text, override  # commas within quotes or brackets
    texts = f"{key}=" + ",".join(_parsed(f"{key}={one}")[0].partition("=")[2] for one in each)
    return texts, OverridesParser.create().parse_override(texts)
