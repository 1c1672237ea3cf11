"""Tables keep every bit; robustness.csv is merged by level, in one order, and read as data."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import pytest

from exneat_cli.errors import ExneatError
from exneat_cli.records import UNPERTURBED, RobustnessRow, merge_robustness, read_robustness, write_csv, write_history


def test_floats_in_csv_keep_every_bit(tmp_path: Path) -> None:
    values = [0.1 + 0.2, math.pi, 1e-300, -0.0, 5.0]
    write_csv(tmp_path / "t.csv", ["a"], [[value] for value in values])
    with (tmp_path / "t.csv").open() as file:
        assert [float(row["a"]) for row in csv.DictReader(file)] == values


def test_history_has_the_known_columns_in_their_order_and_an_algorithms_own_before_the_last(tmp_path: Path) -> None:
    known = "generation,best_fitness,mean_fitness,median_fitness,best_so_far,episodes,env_steps,species,"
    known += "connections,hidden_nodes,failed_episodes,extinctions"
    row = {"wall_seconds": 0.1, "sigma": 0.5, **dict.fromkeys(reversed(known.split(",")), 1)}
    write_history(tmp_path / "history.csv", [row])
    assert (tmp_path / "history.csv").read_text().splitlines()[0] == f"{known},sigma,wall_seconds"


def row(parameter: str, level: float, fitness: float = 0.5, episodes: int = 20) -> RobustnessRow:
    return RobustnessRow("neat", 3, parameter, level, episodes, fitness, 0.1, fitness, 0.1)


def test_a_new_row_replaces_the_old_one_of_its_level_and_no_other(tmp_path: Path) -> None:
    path = tmp_path / "robustness.csv"
    merge_robustness(path, [row("gap", 1.0), row("gap", 0.0), row(UNPERTURBED, 0.0)])
    merge_robustness(path, [row("gap", 1.0, 0.9), row("a", 2.0)])
    assert read_robustness(path) == [row(UNPERTURBED, 0.0), row("a", 2.0), row("gap", 0.0), row("gap", 1.0, 0.9)]


def test_the_bytes_do_not_depend_on_the_order_of_the_rows(tmp_path: Path) -> None:
    rows = [row(name, level, level / 3) for name in ("p_e", "gap") for level in (-1e300, 0.1 + 0.2, 5e-324, 7.0)]
    merge_robustness(tmp_path / "a.csv", rows)
    for each in reversed(rows):
        merge_robustness(tmp_path / "b.csv", [each])
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()
    assert sorted(read_robustness(tmp_path / "a.csv")) == sorted(rows)


HEADER = ",".join(RobustnessRow._fields) + "\n"


@pytest.mark.parametrize("text", ["", "a,b\n1", "\x00", f"{HEADER}neat,0,gap,nan,1,0,0,0,0\n", f"{HEADER}neat,0\n"])
def test_a_damaged_file_is_named(tmp_path: Path, text: str) -> None:
    path = tmp_path / "robustness.csv"
    assert read_robustness(path) == []
    path.write_text(text)
    with pytest.raises(ExneatError, match=r"robustness\.csv: (expected a table|damaged, at \[row\]\[column\])"):
        read_robustness(path)
