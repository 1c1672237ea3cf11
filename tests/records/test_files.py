"""What is written is whole, and every bit of it is there."""

from __future__ import annotations

import csv
import math
from pathlib import Path
from unittest import mock

import pytest

from exneat_cli.errors import ExneatError
from exneat_cli.records import write_csv, write_history, write_json, write_whole


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


def test_floats_in_csv_keep_every_bit(tmp_path: Path) -> None:
    values = [0.1 + 0.2, math.pi, 1e-300, -0.0, 5.0]
    write_csv(tmp_path / "t.csv", ["a"], [[value] for value in values])
    with (tmp_path / "t.csv").open() as file:
        assert [float(row["a"]) for row in csv.DictReader(file)] == values


def test_json_with_nan_is_refused_before_anything_is_written(tmp_path: Path) -> None:
    with pytest.raises(ValueError):
        write_json(tmp_path / "m.json", {"x": math.nan})
    assert not list(tmp_path.iterdir())


def test_history_has_the_known_columns_in_their_order_and_an_algorithms_own_before_the_last(tmp_path: Path) -> None:
    known = "generation,best_fitness,mean_fitness,median_fitness,best_so_far,episodes,env_steps,species,"
    known += "connections,hidden_nodes,failed_episodes,extinctions"
    row = {"wall_seconds": 0.1, "sigma": 0.5, **dict.fromkeys(reversed(known.split(",")), 1)}
    write_history(tmp_path / "history.csv", [row])
    assert (tmp_path / "history.csv").read_text().splitlines()[0] == f"{known},sigma,wall_seconds"
