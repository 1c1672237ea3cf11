"""The directory of one run: its name, its files, and whether a run may use it."""

from __future__ import annotations

import contextlib
import hashlib
import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from exneat_cli.errors import ExneatError
from exneat_cli.records.files import read_json, write_json

RUNNING, DONE, FAILED, INTERRUPTED = "running", "done", "failed", "interrupted"
"""What a manifest's status can be."""

_WITHOUT_EFFECT = ("executor", "output", "name", "resume")
"""Settings that say where and how to run, not what comes out."""


def configuration_hash(configuration: dict[str, Any], *, with_seed: bool = True) -> str:
    """SHA-256, in hex, of the settings that results depend on.

    Args:
        configuration: all settings of a run, as plain data.
        with_seed: without it, the seeds of one arm share a hash.
    """
    ignored = _WITHOUT_EFFECT if with_seed else (*_WITHOUT_EFFECT, "seed")
    kept = {key: value for key, value in configuration.items() if key not in ignored}
    return hashlib.sha256(json.dumps(kept, sort_keys=True, allow_nan=False).encode()).hexdigest()


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
    def plots(self) -> Path:
        """Directory of the figures."""
        return self.path / "plots"

    def claim(self, full_hash: str, *, resume: bool) -> bool:
        """Make the directory ready for a run.

        Returns:
            True if the run is to be done, False if it is finished already.

        Raises:
            ExneatError: the directory cannot be made, or holds something else than this run finished.
        """
        if self.path.exists():
            return self._claim_existing(full_hash, resume)
        try:
            self.path.mkdir(parents=True)
        except OSError as error:
            raise ExneatError(
                f"{self.path}: the run directory cannot be made: {error.strerror}\n"
                "  set output= to a directory that you can write to"
            ) from error
        return True

    def _claim_existing(self, full_hash: str, resume: bool) -> bool:
        if not self.manifest.exists():
            raise ExneatError(
                f"{self.path}: expected a new directory or a finished run, got one without manifest.json\n"
                "  remove it, or set name= or output= to another place"
            )
        manifest = read_json(self.manifest)
        if manifest.get("configuration_hash") != full_hash:
            raise ExneatError(
                f"{self.path}: holds a run with another configuration or of another version\n"
                "  remove it, or set name= or output= to another place"
            )
        if manifest.get("status") == DONE:
            return False
        if not resume:
            raise ExneatError(
                f"{self.path}: holds an unfinished run (status {manifest.get('status')})\n"
                "  add resume=true to do it again from its first generation, with the same results"
            )
        return True

    def give_up(self) -> None:
        """Remove a claimed directory in which nothing could be written."""
        with contextlib.suppress(OSError):
            self.path.rmdir()

    def read_manifest(self) -> dict[str, Any]:
        """The manifest as plain data.

        Raises:
            ExneatError: it is missing or damaged.
        """
        return read_json(self.manifest)

    def update_manifest(self, **changes: object) -> None:
        """Replace entries of the manifest, which is created if there is none.

        Raises:
            ExneatError: it cannot be read or written.
        """
        known = self.read_manifest() if self.manifest.exists() else {}
        write_json(self.manifest, {**known, **changes})


def find_runs(output: Path) -> Iterator[RunDirectory]:
    """Every run below an output root, in alphabetical order."""
    for manifest in sorted(output.glob("*/*/manifest.json")):
        yield RunDirectory(manifest.parent)
