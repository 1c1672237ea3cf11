"""What makes two runs the same: the settings on which results depend."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Any

from exneat_cli.records.plain import dotted

NOT_HASHED = ("executor", "output", "name", "resume", "checkpoint_every", "tracker", "generations")
"""Settings that say where and how to run, not what comes out; and the length, since a run may be extended."""


def configuration_hash(configuration: Mapping[str, Any], *, with_seed: bool = True) -> str:
    """SHA-256, in hex, of the settings on which results depend, except the number of generations.

    Without the seed, all runs of one variant share a hash.
    """
    kept = {key: value for key, value in identity(configuration).items() if with_seed or key != "seed"}
    return hashlib.sha256(json.dumps(kept, sort_keys=True).encode()).hexdigest()


def identity(configuration: Mapping[str, Any]) -> dict[str, Any]:
    """The settings that are hashed, by dotted key, with 1.0 written as 1: a number is the same however it was typed."""
    kept = {key: value for key, value in configuration.items() if key not in NOT_HASHED}
    text = json.dumps(kept, allow_nan=False, default=str)
    flat: dict[str, Any] = json.loads(text, object_pairs_hook=lambda pairs: dotted(dict(pairs)), parse_float=_shortest)
    return flat


def _shortest(text: str) -> int | float:
    number = float(text)
    return int(number) if number.is_integer() else number
