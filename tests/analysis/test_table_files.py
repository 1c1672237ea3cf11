"""Cells as people read them."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from exneat_cli.analysis.artefacts import Built
from exneat_cli.analysis.statistics import Interval
from exneat_cli.analysis.table_files import decimals_for, figure_cell, interval_cell, p_cell, write_table
from exneat_cli.errors import ExneatError


@pytest.mark.parametrize(
    ("values", "decimals"),
    [([0.2, 1.0], 3), ([0.2, 700.0], 1), ([-700.0, math.nan], 1), ([math.nan], 3), ([], 3)],
)
def test_figures_have_three_decimals_unless_one_of_them_is_large(values: list[float], decimals: int) -> None:
    assert decimals_for(values) == decimals


def test_a_figure_that_rounds_to_zero_has_no_sign() -> None:
    assert figure_cell(-0.0001, 3) == "0.000"
    assert figure_cell(-0.001, 3) == "-0.001"


def test_what_does_not_exist_is_an_empty_cell() -> None:
    assert figure_cell(math.nan, 3) == ""
    assert p_cell(math.nan) == ""
    assert interval_cell(Interval(math.nan, math.nan), 3) == ""


@given(st.floats(1e-300, 1.0))
def test_a_p_is_never_printed_as_zero(p: float) -> None:
    assert p_cell(p) == "<0.001" if p < 0.001 else float(p_cell(p)) >= 0.001


def test_a_directory_that_cannot_be_made_is_named(tmp_path: Path) -> None:
    (tmp_path / "report").write_text("a file")
    with pytest.raises(ExneatError, match="report: cannot be made"):
        write_table(tmp_path / "report", Built("table-9.1", "T", "C.", ()), ("a",), [])
