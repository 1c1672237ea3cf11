"""A damaged table is refused by its path."""

from __future__ import annotations

from pathlib import Path

import pytest

from exneat_cli.analysis.csv_files import read_csv
from exneat_cli.errors import ExneatError


def test_numbers_and_words_are_read(tmp_path: Path) -> None:
    path = tmp_path / "robustness.csv"
    path.write_text("variant,level\nneat,0.5\n")
    assert read_csv(path, ("variant", "level"))["level"].tolist() == [0.5]


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"", "No columns"),
        (b"variant,level\nneat,0.1\nneat,1,2,3,4\n", "Expected 2 fields"),
        (b"variant,level\nneat,\xff\xfe\n", "utf-8"),
        (b"variant,height\nneat,1\n", "expected a column level"),
        (b"variant,level\nneat,much\n", "expected numbers in column level"),
    ],
)
def test_a_damaged_table_is_refused_by_its_path(tmp_path: Path, content: bytes, reason: str) -> None:
    path = tmp_path / "robustness.csv"
    path.write_bytes(content)
    with pytest.raises(ExneatError, match=rf"robustness\.csv: damaged: .*{reason}"):
        read_csv(path, ("variant", "level"))


def test_a_missing_table_is_refused_by_its_path(tmp_path: Path) -> None:
    with pytest.raises(ExneatError, match=r"history\.csv: cannot be read"):
        read_csv(tmp_path / "history.csv")
