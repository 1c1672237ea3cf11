"""What is written is whole or not there."""

from __future__ import annotations

import math
from pathlib import Path
from unittest import mock

import pytest

from exneat_cli.errors import ExneatError
from exneat_cli.records import write_json, write_whole


@pytest.mark.parametrize("failure", [OSError(28, "No space left on device"), KeyboardInterrupt()])
def test_a_failed_write_keeps_the_old_file_and_leaves_no_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, failure: BaseException
) -> None:
    path = tmp_path / "history.csv"
    write_whole(path, "old")
    monkeypatch.setattr("os.fsync", mock.Mock(side_effect=failure))
    with pytest.raises((ExneatError, KeyboardInterrupt), match=r"history\.csv: could not be written: No space|^$"):
        write_whole(path, "new")
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_json_with_nan_is_refused_before_anything_is_written(tmp_path: Path) -> None:
    with pytest.raises(ValueError):
        write_json(tmp_path / "m.json", {"x": math.nan})
    assert not list(tmp_path.iterdir())
