"""What manifest.json must hold where it holds it; fields that are not known are left alone."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from exneat_cli.errors import ConfigError, ExneatError, check_choice, check_real, check_whole
from exneat_cli.records.files import read_json

RUNNING, DONE, FAILED, INTERRUPTED = "running", "done", "failed", "interrupted"
STATUSES = (RUNNING, DONE, FAILED, INTERRUPTED)
"""What a manifest's status can be."""
_WHOLE = ("format", "generations", "process", "seed")
_WORDS = ("variant", "task", "configuration_hash", "started", "finished")
_FIGURES = ("fitness_mean", "fitness_std", "full_reward_mean")


def read_manifest_data(path: Path) -> dict[str, Any]:
    """A manifest as plain data.

    Raises:
        ExneatError: the file is missing or damaged, or a known field has a value that makes no sense.
    """
    manifest = read_json(path)
    try:
        _check(manifest)
    except ConfigError as error:
        raise ExneatError(f"{path}: damaged: {error}") from error
    return manifest


def result_of(path: Path, manifest: Mapping[str, Any]) -> dict[str, Any]:
    """The result in the manifest of a finished run.

    Raises:
        ExneatError: there is none.
    """
    result = manifest.get("result")
    if not isinstance(result, dict):
        raise ExneatError(f"{path}: damaged: result: expected the figures of a finished run, got nothing")
    return result


def _check(manifest: Mapping[str, Any]) -> None:
    if "status" in manifest:
        check_choice("status", manifest["status"], STATUSES)
    for name in _WHOLE:
        if name in manifest:
            check_whole(name, manifest[name], 0, 2**64)
    for name in _WORDS:
        if name in manifest and not (isinstance(manifest[name], str) and manifest[name].isprintable()):
            raise ConfigError(name, "printable text", manifest[name])
    for name in ("budget_spent", "failed_robustness_episodes"):
        for key, value in _section(name, manifest.get(name, {})).items():
            check_real(f"{name}.{key}", value, 0.0, 1e300)
    _section("versions", manifest.get("versions", {}))
    if not isinstance(manifest.get("resumed", []), list):
        raise ConfigError("resumed", "a list of times", manifest["resumed"])
    if "result" in manifest:
        _check_result(_section("result", manifest["result"]))


def _check_result(result: Mapping[str, Any]) -> None:
    champion = _section("result.champion", result.get("champion"))
    for name in _FIGURES:
        check_real(f"result.champion.{name}", champion.get(name), -1e300, 1e300)
    check_whole("result.champion.episodes", champion.get("episodes"), 1)
    for name in ("training", "validation"):
        if name in result:
            check_real(f"result.{name}", result[name], -1e300, 1e300)
    for name in ("standing_still", "first_generation"):
        if name in result:
            mean = _section(f"result.{name}", result[name]).get("fitness_mean")
            check_real(f"result.{name}.fitness_mean", mean, -1e300, 1e300)


def _section(key: str, value: object) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        raise ConfigError(key, "a section with fields of its own", value)
    return value
