"""The directory of one run: its files, its single writer, and whether a run may use it."""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
import shutil
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from exneat_cli.errors import ExneatError
from exneat_cli.records.files import delete, make_directory, write_json, write_whole
from exneat_cli.records.identity import identity
from exneat_cli.records.manifest import (
    CHANGED_WORLDS,
    DONE,
    FAILED,
    MANIFEST_FORMAT,
    OLDER_FORMAT,
    RUNNING,
    Manifest,
    Result,
)
from exneat_cli.records.plain import read_json, read_yaml

_ELSEWHERE = "  remove it, or set name= or output= to another place"
ABSENT = (errno.ENOENT, errno.ENOTDIR, errno.ENAMETOOLONG)
"""Errors that mean that nothing is there; others leave that open."""
_TRIES, _PAUSE = 3, 0.02
"""How often to try to get a lock, and the seconds in between: `is_held` holds it only for a moment."""


@dataclass(unsafe_hash=True)
class RunDirectory:
    """``<output>/<name>/<variant>-s<seed>-<hash>``, where one run keeps its files.

    docs/run-directory.md says what each of them holds. Not every run has all of them: a baseline has no history,
    champion or hall of fame, and only grid worlds have tiles.
    """

    path: Path

    def __post_init__(self) -> None:
        self.manifest = self.path / "manifest.json"
        self.config = self.path / "config.yaml"
        self.history = self.path / "history.csv"
        self.champion = self.path / "champion.json"
        self.hall_of_fame = self.path / "hall_of_fame.jsonl"
        self.robustness = self.path / "robustness.csv"
        self.trace = self.path / "trace.csv"
        self.tiles = self.path / "tiles.csv"
        self.plots = self.path / "plots"
        self.model = self.path / "model"

    @contextlib.contextmanager
    def claimed(
        self, full_hash: str, configuration: Mapping[str, Any], *, resume: bool, lengthen: bool
    ) -> Iterator[bool]:
        """Hold the directory, created if needed, against other processes; yields whether the run is already finished.

        Args:
            full_hash: the run's `configuration_hash`.
            configuration: all its settings, as plain data.
            resume: whether an unfinished run may be continued.
            lengthen: whether a finished one may be extended.

        Raises:
            ExneatError: the directory cannot be made or used, or holds something else than this run.
        """
        make_directory(self.path)
        with self.held():
            is_finished = self._may_be_used(full_hash, configuration, resume=resume, lengthen=lengthen)
            for directory in (self.path, self.plots):
                for orphan in directory.glob(".*.[0-9]*.tmp"):  # of a process that was killed while it wrote here
                    delete(orphan)
            yield is_finished

    @contextlib.contextmanager
    def held(self) -> Iterator[None]:
        """Hold the directory against other processes, and other threads of this one.

        The lock is on the directory itself: nothing is left behind, and a killed process frees it.

        Raises:
            ExneatError: another process holds it, or it cannot be opened.
        """
        try:
            descriptor = os.open(self.path, os.O_RDONLY | os.O_DIRECTORY)
        except OSError as error:
            raise ExneatError(f"{self.path}: cannot be opened: {error.strerror}") from error
        try:
            _lock(self.path, descriptor)
            if not _is_still(self.path, descriptor):
                raise ExneatError(f"{self.path}: has just been removed by another process; try again")
            yield
        finally:
            os.close(descriptor)

    def is_held(self) -> bool:
        """Whether a process holds the directory now."""
        try:
            with self.held():
                return False
        except ExneatError:
            return True

    def _may_be_used(self, full_hash: str, configuration: Mapping[str, Any], *, resume: bool, lengthen: bool) -> bool:
        if not self.manifest.exists():
            # A run that was killed before its manifest was written leaves only temporary files.
            if all(path.suffix == ".tmp" for path in self.path.iterdir()):
                return False
            came = "expected a new directory or a run, got one without manifest.json"
            raise ExneatError(f"{self.path}: {came}\n{_ELSEWHERE}")
        manifest, asked = self.read_manifest(), configuration["generations"]
        if manifest.configuration_hash != full_hash:
            raise ExneatError(f"{self.path}: holds another run: {self._difference(configuration)}\n{_ELSEWHERE}")
        there, is_done = manifest.generations, manifest.status == DONE
        if is_done and there == asked:
            return True
        if asked < there:
            raise ExneatError(
                f"{self.path}: holds a run of {there} generations, but {asked} are asked for\n"
                "  generations= can only be raised; set name= to another folder for a shorter run"
            )
        if manifest.status == FAILED and not self.history.exists():
            return False  # it failed before anything was trained, so there is nothing to lose
        if not (lengthen if is_done else resume):
            holds = f"a finished run of {there} generations" if is_done else f"an unfinished run ({manifest.status})"
            fix = f"add resume=true to continue where it stopped, or use exneat resume run={self.path}"
            raise ExneatError(f"{self.path}: holds {holds}\n  {fix}")
        return False

    def _difference(self, configuration: Mapping[str, Any]) -> str:
        """How the settings of the run that is there differ, in words."""
        there, here = self._identity(), identity(configuration)
        if there is None:
            return "its config.yaml cannot be read"
        keys = [key for key in sorted({*there, *here}) if there.get(key) != here.get(key)]
        named = [f"{key} is {there.get(key, 'unset')} there, {here.get(key, 'unset')} here" for key in keys]
        return "; ".join(named[:3] + ["..."] * (len(named) > 3)) or "its manifest belongs to another one"

    def is_alike(self, configuration: Mapping[str, Any]) -> bool:
        """Whether the run has exactly these settings."""
        return self._identity() == identity(configuration)

    def _identity(self) -> dict[str, Any] | None:
        """The settings in config.yaml on which results depend; None if they cannot be read."""
        try:
            return identity(read_yaml(self.config))
        except (ExneatError, TypeError, ValueError):
            return None

    def begin(self, config: str, manifest: Manifest, files: Mapping[str, bytes]) -> None:
        """Write the first files, beginning with the manifest; if that fails, a directory that was new is removed again.

        Args:
            config: the content of config.yaml.
            manifest: of the run.
            files: files that the task is made of, by path, to be kept below `model`.

        Raises:
            ExneatError: they cannot be written.
        """
        is_new = not any(self.path.iterdir())
        try:
            write_json(self.manifest, manifest)
            write_whole(self.config, config)
            for name, content in files.items():
                make_directory((self.model / name).parent)
                write_whole(self.model / name, content)
        except ExneatError:
            if is_new:
                shutil.rmtree(self.path, ignore_errors=True)
            raise

    def forget_what_was_derived(self) -> None:
        """Delete robustness and figures, which belong to a champion and a history that are about to change."""
        delete(self.robustness)
        shutil.rmtree(self.plots, ignore_errors=True)

    def check_writable(self) -> None:
        """Refuse a directory in which no file can be written, before anything is computed for it.

        Raises:
            ExneatError: no file can be written.
        """
        trial = self.path / ".trial"
        write_whole(trial, b"")
        delete(trial)

    def is_there(self) -> bool:
        """Whether the directory holds a run.

        Raises:
            ExneatError: the directory cannot be read, so it is unknown.
        """
        try:
            os.stat(self.manifest)
        except OSError as error:
            if error.errno not in ABSENT:
                raise ExneatError(f"{self.path}: cannot be read: {error.strerror}") from error
            return False
        return True

    def is_finished(self, full_hash: str | None = None, generations: int | None = None) -> bool:
        """Whether a run is there and done, with this hash and length if they are given.

        Raises:
            ExneatError: its manifest is damaged, or of another format.
        """
        if not self.is_there():
            return False
        manifest = self.read_manifest()
        same = full_hash in (None, manifest.configuration_hash) and generations in (None, manifest.generations)
        return manifest.status == DONE and same

    def read_manifest(self) -> Manifest:
        """The manifest.

        Raises:
            ExneatError: it is missing, damaged or of another format, or a finished run has no result.
        """
        manifest, _ = read_json(self.manifest, Manifest, MANIFEST_FORMAT, OLDER_FORMAT)
        if manifest.format == OLDER_FORMAT and manifest.task in CHANGED_WORLDS:
            why = f"task={manifest.task} was a different world then"
            raise ExneatError(f"{self.manifest}: expected format {MANIFEST_FORMAT}, got {OLDER_FORMAT}: {why}")
        if manifest.status == DONE and manifest.result is None:
            raise ExneatError(f"{self.manifest}: damaged: result: expected the figures of a finished run, got nothing")
        return manifest

    def status(self, manifest: Manifest) -> str:
        """The status in its `manifest`, but "killed" if that is "running" and no process holds the run."""
        return "killed" if manifest.status == RUNNING and not self.is_held() else manifest.status

    def read_result(self) -> Result:
        """The result of a finished run; see `read_manifest`."""
        result = self.read_manifest().result
        if result is None:
            raise ExneatError(f"{self.path}: expected a finished run, got one without a result")
        return result

    def update_manifest(self, **changes: object) -> None:
        """Replace fields of the manifest.

        Raises:
            ExneatError: it cannot be read or written.
        """
        write_json(self.manifest, msgspec.structs.replace(self.read_manifest(), **changes))


def _lock(directory: Path, descriptor: int) -> None:
    for attempt in range(1, _TRIES + 1):
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return
        except BlockingIOError:
            if attempt == _TRIES:
                holder = f"process id {_holder(descriptor)}"
                raise ExneatError(f"{directory}: another process is writing there ({holder})") from None
            time.sleep(_PAUSE)
        except OSError as error:
            why = f"{directory}: cannot be locked: {error.strerror}; set output= to a disk that supports flock"
            raise ExneatError(why) from error


def _is_still(directory: Path, descriptor: int) -> bool:
    with contextlib.suppress(OSError):
        return os.path.samefile(directory, descriptor)
    return False


def _holder(descriptor: int) -> str:
    """Id of the process that holds the lock, if the kernel tells."""
    with contextlib.suppress(OSError):
        inode = os.fstat(descriptor).st_ino
        for fields in map(str.split, Path("/proc/locks").read_text(encoding="ascii").splitlines()):
            if "FLOCK" in fields and "->" not in fields and fields[-3].endswith(f":{inode}"):
                return fields[-4]
    return "unknown"
