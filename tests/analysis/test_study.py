"""What a study sees of its runs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import msgspec
import pytest

from exneat_cli.analysis.study import read_csv
from exneat_cli.errors import ExneatError
from tests.analysis.fake_studies import falling, finish, finish_all, plan_study, run_of


def test_runs_that_are_not_done_or_were_trained_for_longer_do_not_count(tmp_path: Path) -> None:
    study = finish_all(plan_study(tmp_path, seeds=3))
    run_of(study, "calm", "neat", 0).directory.update_manifest(status="interrupted")
    run_of(study, "calm", "neat", 1).directory.update_manifest(generations=99)
    study = replace(study, runs=tuple(replace(run, generations=4) for run in study.runs if run.variant == "neat"))
    for run in study.runs[2:]:
        run.directory.update_manifest(generations=4)
    assert [run.seed for run in study.of("calm", "neat")] == [2]


def test_the_best_on_validation_come_first_equal_ones_by_seed_and_those_without_a_figure_last(tmp_path: Path) -> None:
    study = plan_study(tmp_path, seeds=4)
    for seed, validation in enumerate((0.2, 0.7, 0.9, 0.7)):
        finish(run_of(study, "calm", "neat", seed), (0.5,), validation=validation)
    directory = run_of(study, "calm", "neat", 2).directory
    directory.update_manifest(result=msgspec.structs.replace(directory.read_result(), validation=None))
    assert [run.seed for run in study.best_first("calm", "neat")] == [1, 3, 0, 2]


def test_rows_of_other_levels_and_numbers_of_episodes_are_left_out(tmp_path: Path) -> None:
    study = finish_all(plan_study(tmp_path, seeds=1), falling)
    planned = replace(study, levels={"gap": (0.1, 0.3)}, sweep_episodes=20)
    rows = planned.robustness("calm")
    assert set(rows["parameter"]) == {"gap"}
    assert sorted(set(rows["level"])) == [0.1, 0.3]
    assert replace(planned, sweep_episodes=100).robustness("calm").empty
    assert len(study.robustness("calm")) == 3 * 2 * 6


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"", "damaged: No columns"),
        (b"step,x\n1,0.1\n1,1,2,3,4\n", "damaged: .*Expected 2 fields"),
        (b"step,x\n1,\xff\xfe\n", "damaged: .*utf-8"),
        (b"step,y\n1,1\n", "damaged: expected numbers in a column x"),
        (b"step,x\n1,much\n", "damaged: expected numbers in a column x"),
        (None, "cannot be read"),
    ],
)
def test_a_table_that_is_damaged_or_missing_is_refused_by_its_path(
    tmp_path: Path, content: bytes | None, reason: str
) -> None:
    path = tmp_path / "history.csv"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(ExneatError, match=rf"history\.csv: {reason}"):
        read_csv(path, ("step", "x"))
