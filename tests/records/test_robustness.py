"""robustness.csv: merged by level, in one order, read as data."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from exneat_cli.errors import ExneatError
from exneat_cli.records import UNPERTURBED, RobustnessRow, merge_robustness, read_robustness


def row(parameter: str, level: float, fitness: float = 0.5, episodes: int = 20) -> RobustnessRow:
    return RobustnessRow("neat", 3, parameter, level, episodes, fitness, 0.1, fitness, 0.1)


def test_a_new_row_replaces_the_old_one_of_its_level_and_no_other(tmp_path: Path) -> None:
    path = tmp_path / "robustness.csv"
    merge_robustness(path, [row("gap", 1.0), row("gap", 0.0), row(UNPERTURBED, 0.0)])
    merge_robustness(path, [row("gap", 1.0, 0.9), row("a", 2.0)])
    assert read_robustness(path) == [row(UNPERTURBED, 0.0), row("a", 2.0), row("gap", 0.0), row("gap", 1.0, 0.9)]


finite = st.floats(allow_nan=False, allow_infinity=False)


@given(st.lists(st.tuples(st.sampled_from(["p_e", "gap"]), finite, finite), max_size=8), st.randoms())
def test_the_bytes_do_not_depend_on_the_order_of_the_rows(
    tmp_path_factory: pytest.TempPathFactory, entries: list[tuple[str, float, float]], random: object
) -> None:
    unique = list({(name, level): row(name, level, fitness) for name, level, fitness in entries}.values())
    folder = tmp_path_factory.mktemp("rows")
    merge_robustness(folder / "a.csv", unique)
    random.shuffle(unique)  # type: ignore[attr-defined]
    for each in unique:
        merge_robustness(folder / "b.csv", [each])
    assert not unique or (folder / "a.csv").read_bytes() == (folder / "b.csv").read_bytes()


HEADER = ",".join(RobustnessRow._fields) + "\n"


@pytest.mark.parametrize("text", ["", "a,b\n1", "\x00", f"{HEADER}neat,0,gap,nan,1,0,0,0,0\n", f"{HEADER}neat,0\n"])
def test_a_damaged_file_is_named(tmp_path: Path, text: str) -> None:
    path = tmp_path / "robustness.csv"
    assert read_robustness(path) == []
    path.write_text(text)
    with pytest.raises(ExneatError, match=r"robustness\.csv: (expected a table|damaged, at \[row\]\[column\])"):
        read_robustness(path)
