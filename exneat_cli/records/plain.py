"""From plain data, such as YAML gives, to frozen dataclasses, which check types and ranges themselves."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any, TypeVar

from exneat_cli.errors import ExneatError, check_keys, check_section

_T = TypeVar("_T")


def build(cls: type[_T], values: Mapping[str, Any], prefix: str) -> _T:
    """Build a dataclass from keys with values.

    Args:
        cls: the dataclass.
        values: of its fields.
        prefix: what stands before its keys in messages, e.g. ``task.``.

    Raises:
        ExneatError: `values` are no section, a key is unknown or missing, or the dataclass refuses a value.
    """
    fields = dataclasses.fields(cls)  # type: ignore[arg-type]
    check_keys(prefix, check_section(prefix.rstrip("."), values), [f.name for f in fields])
    for f in fields:
        if f.name not in values and f.default is f.default_factory is dataclasses.MISSING:
            raise ExneatError(f"{prefix}{f.name}: is missing")
    return cls(**values)
