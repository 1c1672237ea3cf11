"""What is wrong with an override can be said without composing anything: each is looked at alone, and named."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path

from hydra.conf import HydraConf
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import ChoiceSweep, Override, RangeSweep

from exneat_cli.errors import ConfigError, ExneatError, shortened

_SET_HERE = (
    "run",
    "sweep.subdir",
    "output_subdir",
    "job_logging",
    "hydra_logging",
    "searchpath",
    "job.chdir",
    "callbacks",
)
"""Keys below hydra. that would write, look or call outside of what exneat checks."""
_MOST_JOBS = 10_000
_OF_LISTS = ("sweep",)
"""Groups of which several options may be chosen at once."""


def check_overrides(overrides: Sequence[str], conf: Path) -> None:
    """Refuse overrides that Hydra would misunderstand, or take silently though they make no sense.

    Args:
        overrides: as on the command line.
        conf: exneat's own configuration, whose folders are the groups.

    Raises:
        ExneatError: one cannot be read, deletes a setting, chooses no option of a group, or changes what exneat itself
            asks of Hydra.
    """
    parser = OverridesParser.create()
    jobs = 1.0
    for text in overrides:
        if not text.isprintable():
            raise ExneatError(f"{shortened(text)}: expected key=value without control characters")
        try:
            override = parser.parse_override(text)
        except RecursionError as error:
            raise ExneatError(f"{_short(text)}: expected key=value, got something nested too deeply") from error
        except Exception as error:
            reason = _short(str(error).splitlines()[0])
            raise ExneatError(f"{_short(text)}: expected key=value: {reason}\n  {_fix(text)}") from error
        _check(text, override, conf)
        jobs *= _values(override)
        if not jobs <= _MOST_JOBS:
            raise ExneatError(f"{_short(text)}: expected at most {_MOST_JOBS} jobs in a multirun, got more")


def _values(override: Override) -> float:
    """How many values a sweep over this override has; Hydra would write all of them out first."""
    sweep = override.value() if override.is_sweep_override() else None
    if isinstance(sweep, ChoiceSweep):
        return len(sweep.list)
    if isinstance(sweep, RangeSweep) and sweep.step and sweep.start is not None and sweep.stop is not None:
        return max(1.0, (float(sweep.stop) - float(sweep.start)) / float(sweep.step))
    return 1


def _check(text: str, override: Override, conf: Path) -> None:
    key = override.key_or_group
    if not key:
        raise ExneatError(f"{_short(text)}: expected key=value, got no key")
    section, _, name = key.replace("/", ".").partition(".")
    if section == "hydra":
        _check_hydras(text, name)
        return
    if override.is_delete():
        raise ExneatError(f"{_short(text)}: a setting cannot be deleted\n  leave it out, or give it the value you want")
    if (conf / key).is_dir() and not override.is_sweep_override():
        _check_choice_of_option(key, override.value())


def _check_hydras(text: str, name: str) -> None:
    known = {field.name for field in dataclasses.fields(HydraConf)}
    if name.split(".")[0] not in known:
        raise ExneatError(f"{_short(text)}: unknown key; below hydra. there are {', '.join(sorted(known))}")
    for taken in _SET_HERE:
        if name == taken or name.startswith(f"{taken}."):
            fix = "output= says where runs go, --config-dir where your own files are"
            raise ExneatError(f"{_short(text)}: exneat sets hydra.{taken} itself\n  {fix}")


def _check_choice_of_option(group: str, value: object) -> None:
    options = value if isinstance(value, list) else [value]
    if isinstance(value, list) and group not in _OF_LISTS:
        raise ConfigError(group, "one option", value)
    for option in options:
        if option is not None and not isinstance(option, str):
            raise ConfigError(group, "the name of an option", value)
        if option is not None and (".." in Path(option).parts or Path(option).is_absolute()):
            raise ConfigError(group, "the name of an option", value, "--config-dir adds a directory of your own")


def _fix(text: str) -> str:
    if any(character in text for character in "{}[](),'\":~\\") or not text.isascii():
        return "values with brackets, quotes or other special characters need quotes of their own: \"key='value'\""
    return "e.g. seed=3"


def _short(text: str) -> str:
    return text if len(text) <= 120 else f"{text[:120]}..."
