"""The directory of one run: its name, its files, and whether a run may use it."""

from __future__ import annotations

import contextlib
import enum
import hashlib
import json
import shutil
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from exneat_cli.errors import ExneatError
from exneat_cli.records.files import delete, delete_orphans, write_json, write_whole
from exneat_cli.records.locks import held
from exneat_cli.records.manifest_data import DONE, read_manifest_data, result_of
from exneat_cli.records.yaml_files import read_yaml

MANIFEST_FORMAT = 3

_WITHOUT_EFFECT = ("executor", "output", "name", "resume", "checkpoint_every")
"""Settings that say where and how to run, not what comes out."""
_NOT_HASHED = (*_WITHOUT_EFFECT, "generations")
"""A run may be made longer, so its length is no part of what it is."""


class Claim(enum.Enum):
    """What is to be done in a run directory."""

    BEGIN = "begin"
    CONTINUE = "continue"
    FINISHED = "finished"


def configuration_hash(configuration: Mapping[str, Any], *, with_seed: bool = True) -> str:
    """SHA-256, in hex, of the settings that results depend on, but for the number of generations.

    Args:
        configuration: all settings of a run, as plain data.
        with_seed: without it, the seeds of one variant share a hash.
    """
    kept = _that_matter(configuration, _NOT_HASHED if with_seed else (*_NOT_HASHED, "seed"))
    return hashlib.sha256(json.dumps(kept, sort_keys=True, allow_nan=False).encode()).hexdigest()


def _that_matter(configuration: Mapping[str, Any], ignored: Sequence[str]) -> dict[str, Any]:
    return {key: _canonical(value) for key, value in configuration.items() if key not in ignored}


def _flat(plain: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """The same with dotted keys."""
    flat: dict[str, Any] = {}
    for key, value in plain.items():
        flat |= _flat(value, f"{prefix}{key}.") if isinstance(value, dict) else {f"{prefix}{key}": value}
    return flat


def _canonical(value: Any) -> Any:
    """The value with 1.0 written as 1, at any depth: a number is the same however it was typed."""
    if isinstance(value, dict):
        return {key: _canonical(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_canonical(entry) for entry in value]
    return int(value) if isinstance(value, float) and value.is_integer() else value


@dataclass(frozen=True)
class RunDirectory:
    """Where one run keeps its files; see the README for what each of them holds."""

    path: Path

    @property
    def manifest(self) -> Path:
        """Status, versions, seeds, hash, budget spent, result."""
        return self.path / "manifest.json"

    @property
    def config(self) -> Path:
        """The full configuration."""
        return self.path / "config.yaml"

    @property
    def history(self) -> Path:
        """One row per generation."""
        return self.path / "history.csv"

    @property
    def champion(self) -> Path:
        """The champion team."""
        return self.path / "champion.json"

    @property
    def hall_of_fame(self) -> Path:
        """The teams that the champion was chosen from."""
        return self.path / "hall_of_fame.jsonl"

    @property
    def robustness(self) -> Path:
        """One row per perturbation and level."""
        return self.path / "robustness.csv"

    @property
    def trace(self) -> Path:
        """The champion's path in the first test episode."""
        return self.path / "trace.csv"

    @property
    def tiles(self) -> Path:
        """The grid world of the trace: path and cues of every tile at its end."""
        return self.path / "tiles.csv"

    @property
    def plots(self) -> Path:
        """Directory of the figures."""
        return self.path / "plots"

    @contextlib.contextmanager
    def claimed(
        self, full_hash: str, configuration: Mapping[str, Any], *, resume: bool, lengthen: bool
    ) -> Iterator[Claim]:
        """Hold the directory, made if need be, against other processes.

        Args:
            full_hash: of the run, see `configuration_hash`.
            configuration: all its settings, as plain data.
            resume: whether to go on with an unfinished run.
            lengthen: whether to make a finished one longer.

        Yields:
            What is to be done there.

        Raises:
            ExneatError: the directory cannot be made or used, or holds something else than this run.
        """
        self._make()
        with self.held():
            claim = self._claim(full_hash, configuration, resume=resume, lengthen=lengthen)
            for directory in (self.path, self.plots):
                delete_orphans(directory)
            yield claim

    def _make(self) -> None:
        try:
            self.path.mkdir(parents=True, exist_ok=True)
        except FileExistsError:
            raise ExneatError(f"{self.path}: expected a directory, got a file; set name= or output=") from None
        except OSError as error:
            raise ExneatError(
                f"{self.path}: the run directory cannot be made: {error.strerror}\n"
                "  set output= to a directory that you can write to"
            ) from error

    def held(self) -> contextlib.AbstractContextManager[None]:
        """Hold the directory against other processes.

        Raises:
            ExneatError: when entered, if another process holds it, or it cannot be opened.
        """
        return held(self.path)

    def _claim(self, full_hash: str, configuration: Mapping[str, Any], *, resume: bool, lengthen: bool) -> Claim:
        if not self.manifest.exists():
            if self._holds_nothing():
                return Claim.BEGIN
            raise ExneatError(
                f"{self.path}: expected a new directory or a run, got one without manifest.json\n"
                "  remove it, or set name= or output= to another place"
            )
        manifest = self.read_manifest()
        fix = "  remove it, or set name= or output= to another place"
        if manifest.get("format") != MANIFEST_FORMAT:
            came = f"holds a run of format {manifest.get('format')!r}, expected {MANIFEST_FORMAT}"
            raise ExneatError(f"{self.path}: {came}\n{fix}")
        if manifest.get("configuration_hash") != full_hash:
            raise ExneatError(f"{self.path}: holds another run: {self._difference(configuration)}\n{fix}")
        status, there, asked = manifest.get("status"), manifest.get("generations"), configuration["generations"]
        if status == DONE and there == asked:
            return Claim.FINISHED
        if not isinstance(there, int) or asked < there:
            raise ExneatError(
                f"{self.path}: holds a run of {there} generations, and {asked} are asked for\n"
                "  generations= can only be raised; set name= to another folder for a shorter run"
            )
        if not (lengthen if status == DONE else resume):
            holds = f"a finished run of {there} generations" if status == DONE else f"an unfinished run ({status})"
            raise ExneatError(f"{self.path}: holds {holds}\n  add resume=true to go on from where it stopped")
        return Claim.CONTINUE

    def _difference(self, configuration: Mapping[str, Any]) -> str:
        """What the run that is there has otherwise, in words."""
        try:
            there = _flat(_that_matter(read_yaml(self.config), _NOT_HASHED))
        except ExneatError:
            return "its config.yaml cannot be read"
        asked = _flat(_that_matter(configuration, _NOT_HASHED))
        keys = [key for key in sorted({*there, *asked}) if there.get(key) != asked.get(key)]
        named = [f"{key} is {there.get(key, 'unset')} there, {asked.get(key, 'unset')} here" for key in keys[:3]]
        return "; ".join(named) + ("; ..." if len(keys) > 3 else "") if keys else "its manifest is of another one"

    def _holds_nothing(self) -> bool:
        """Whether the directory is new, or left by a run that was killed before its manifest was written."""
        return all(path.suffix == ".tmp" for path in self.path.iterdir())

    def begin(self, config: str, manifest: dict[str, object]) -> None:
        """Write the first two files, the manifest first; if that fails, a directory that was new is gone again.

        Raises:
            ExneatError: they cannot be written.
        """
        is_new = not any(self.path.iterdir())
        try:
            write_json(self.manifest, manifest)
            write_whole(self.config, config)
        except ExneatError:
            if is_new:
                shutil.rmtree(self.path, ignore_errors=True)
            raise

    def forget_what_was_derived(self) -> None:
        """Delete robustness and figures, which belong to a champion and a history that are about to change."""
        delete(self.robustness)
        shutil.rmtree(self.plots, ignore_errors=True)

    def is_there(self) -> bool:
        """Whether the directory holds a run, as far as one can see."""
        with contextlib.suppress(OSError):
            return self.manifest.exists()
        return False

    def read_manifest(self) -> dict[str, Any]:
        """The manifest as plain data.

        Raises:
            ExneatError: it is missing or damaged.
        """
        return read_manifest_data(self.manifest)

    def read_result(self) -> dict[str, Any]:
        """The result in the manifest of a finished run.

        Raises:
            ExneatError: it is missing or damaged.
        """
        return result_of(self.manifest, self.read_manifest())

    def update_manifest(self, **changes: object) -> None:
        """Replace or add entries of the manifest.

        Raises:
            ExneatError: it cannot be read or written.
        """
        write_json(self.manifest, {**self.read_manifest(), **changes})


def find_runs(output: Path) -> Iterator[RunDirectory]:
    """Every run below an output root, in alphabetical order.

    Raises:
        ExneatError: the root cannot be read.
    """
    try:
        manifests = sorted(output.glob("*/*/manifest.json"))
    except OSError as error:
        raise ExneatError(f"output={output}: cannot be read: {error.strerror}") from error
    for manifest in manifests:
        yield RunDirectory(manifest.parent)
