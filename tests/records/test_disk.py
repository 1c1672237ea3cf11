"""Trying out a place for runs, and leaving it as it was."""

from __future__ import annotations

import errno
import fcntl
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from exneat_cli.errors import ExneatError
from exneat_cli.records import disk


@pytest.mark.parametrize("root", [".", "outputs", "far/down/outputs"])
def test_a_usable_place_is_left_as_it_was(root: str, tmp_path: Path) -> None:
    disk.try_writing(tmp_path / root)
    assert disk.locks_exclude(tmp_path / root)
    assert disk.free_bytes(tmp_path / root) > 0
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("trial", [disk.try_writing, disk.locks_exclude, disk.free_bytes])
def test_a_file_a_dangling_link_and_an_impossible_name_are_refused(
    trial: Callable[[Path], object], tmp_path: Path
) -> None:
    (tmp_path / "file").touch()
    (tmp_path / "link").symlink_to(tmp_path / "nowhere")
    for name, message in (
        ("file", "is a file"),
        ("file/below", "is a file|Not a directory"),
        ("link/below", "leads nowhere"),
        ("x" * 300, "File name too long"),
    ):
        with pytest.raises(ExneatError, match=message):
            trial(tmp_path / name)


def test_a_directory_without_permission_is_refused(tmp_path: Path) -> None:
    if os.getuid() == 0:
        pytest.skip("root may write everywhere")
    tmp_path.chmod(0o500)
    with pytest.raises(ExneatError, match="Permission denied"):
        disk.try_writing(tmp_path / "outputs")


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="needs a file system that cannot be written")
def test_a_file_system_that_cannot_be_written_is_refused() -> None:
    with pytest.raises(ExneatError, match="/proc: "):
        disk.try_writing(Path("/proc/exneat"))


def test_a_full_disk_is_named_and_the_trial_is_gone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full_disk(descriptor: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("os.fsync", full_disk)
    with pytest.raises(ExneatError) as refused:
        disk.try_writing(tmp_path / "outputs")
    assert str(refused.value) == f"{tmp_path}: No space left on device"
    assert not list(tmp_path.iterdir())


def test_locks_that_are_granted_twice_do_not_exclude(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fcntl, "flock", lambda descriptor, operation: None)
    assert not disk.locks_exclude(tmp_path)
    assert not list(tmp_path.iterdir())


def test_a_file_system_without_locks_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_locks(descriptor: int, operation: int) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(fcntl, "flock", no_locks)
    with pytest.raises(ExneatError, match="No locks available"):
        disk.locks_exclude(tmp_path)
    assert not list(tmp_path.iterdir())
