"""Temporary files go, whenever a signal comes."""

from __future__ import annotations

import signal
import tempfile
from pathlib import Path

import pytest

from exneat_cli.interruption import Interrupted, listening, scratch_directory


def test_a_signal_while_the_directory_is_made_leaves_none_behind(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    make = tempfile.mkdtemp

    def make_and_be_interrupted(prefix: str, dir: Path) -> str:  # noqa: A002
        name = make(prefix=prefix, dir=dir)
        signal.raise_signal(signal.SIGTERM)
        return name

    monkeypatch.setattr(tempfile, "mkdtemp", make_and_be_interrupted)
    with listening(), pytest.raises(Interrupted), scratch_directory(above=tmp_path):
        pass
    assert not list(tmp_path.iterdir())


def test_a_signal_while_the_directory_is_used_leaves_none_behind(tmp_path: Path) -> None:
    def use() -> None:
        with scratch_directory(above=tmp_path) as path:
            (path / "file").touch()
            signal.raise_signal(signal.SIGTERM)

    with listening(), pytest.raises(Interrupted):
        use()
    assert not list(tmp_path.iterdir())
