"""The directory of one run: its name, its files, and whether a run may use it."""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import json
import os
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from exneat_cli.errors import ExneatError
from exneat_cli.records.files import write_json, write_whole
from exneat_cli.records.manifest_data import read_manifest_data, result_of

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
    kept = {key: _canonical(value) for key, value in configuration.items() if key not in ignored}
    return hashlib.sha256(json.dumps(kept, sort_keys=True, allow_nan=False).encode()).hexdigest()


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
    def claimed(self, full_hash: str, *, resume: bool) -> Iterator[bool]:
        """Hold the directory, made if need be, against other processes.

        Yields:
            True if the run is to be done, False if it is finished already.

        Raises:
            ExneatError: the directory cannot be made or used, or holds something else than this run finished.
        """
        is_new = self._make()
        with self.held():
            yield is_new or self._is_to_be_done(full_hash, resume)

    def _make(self) -> bool:
        try:
            self.path.mkdir(parents=True)
        except FileExistsError:
            if self.path.is_dir():
                return False
            raise ExneatError(f"{self.path}: expected a directory, got a file; set name= or output=") from None
        except OSError as error:
            raise ExneatError(
                f"{self.path}: the run directory cannot be made: {error.strerror}\n"
                "  set output= to a directory that you can write to"
            ) from error
        return True

    @contextlib.contextmanager
    def held(self) -> Iterator[None]:
        """Hold the directory against other processes.

        Raises:
            ExneatError: another process holds it, or it cannot be opened.
        """
        # The lock is on the directory itself: nothing is left behind, and a killed process frees it.
        try:
            descriptor = os.open(self.path, os.O_RDONLY)
        except OSError as error:
            raise ExneatError(f"{self.path}: cannot be opened: {error.strerror}") from error
        try:
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                process = self.read_manifest().get("process", "unknown") if self.manifest.exists() else "unknown"
                raise ExneatError(f"{self.path}: another process is writing this run (process id {process})") from None
            yield
        finally:
            os.close(descriptor)

    def _is_to_be_done(self, full_hash: str, resume: bool) -> bool:
        if not self.manifest.exists():
            if resume and self._holds_nothing():
                return True
            raise ExneatError(
                f"{self.path}: expected a new directory or a finished run, got one without manifest.json\n"
                "  remove it, or set name= or output= to another place"
            )
        manifest = self.read_manifest()
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

    def _holds_nothing(self) -> bool:
        """Whether a run that was killed before its manifest was written left this directory."""
        return all(path.name == self.config.name or path.suffix == ".tmp" for path in self.path.iterdir())

    def begin(self, config: str, manifest: dict[str, object]) -> None:
        """Write the first two files, the manifest last; if that fails, a directory that was new is gone again.

        Raises:
            ExneatError: they cannot be written.
        """
        is_new = not any(self.path.iterdir())
        try:
            write_whole(self.config, config)
            write_json(self.manifest, manifest)
        except ExneatError:
            if is_new:
                shutil.rmtree(self.path, ignore_errors=True)
            raise

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
