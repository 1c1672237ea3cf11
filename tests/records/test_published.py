"""Published rows: what they hold of a run, in which order, and that publishing again changes nothing."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import pytest

from exneat_cli.errors import ExneatError
from exneat_cli.records import PublishedRun, publish, published_run, read_published
from tests.analysis.fake_studies import falling, finish, plan_study, run_of

LEVELS = {("gap", 0.1), ("gap", 0.3)}


def rows_of(directory: Path, seeds: int = 3) -> list[PublishedRun]:
    study = plan_study(directory, seeds=seeds)
    for seed in range(seeds):
        run = run_of(study, "calm", "neat", seed)
        finish(run, (0.1, 0.1 + 0.2), test=0.2, levels=falling(0.5 + seed))
    runs = [run_of(study, "calm", "neat", seed).directory for seed in range(seeds)]
    return [published_run(run, ("calm", "neat", "quick"), LEVELS, 20) for run in runs]


def by_seed(row: PublishedRun) -> int:
    return row.seed


def test_a_row_holds_what_the_run_came_to_to_the_last_digit(tmp_path: Path) -> None:
    row = rows_of(tmp_path)[1]
    assert row.place == ("calm", "neat", 1, "quick")
    assert (row.generations, row.episodes, row.env_steps, row.training, row.test_mean) == (2, 400, 9000, 0.1 + 0.2, 0.2)
    assert row.best_so_far == [0.1, 0.1 + 0.2]
    expected = [("gap", level, 1.5 * (1.0 - level), 2 * 1.5 * (1.0 - level)) for level in (0.1, 0.3)]
    assert sorted(row.levels) == expected
    publish(tmp_path / "results" / "track.csv", [row], by_seed)
    assert read_published(tmp_path / "results" / "track.csv") == [row]


def test_rows_are_in_order_however_they_come_and_again_changes_no_byte(tmp_path: Path) -> None:
    rows, path = rows_of(tmp_path, seeds=8), tmp_path / "results" / "track.csv"
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(lambda row: publish(path, [row], by_seed), reversed(rows)))
    assert read_published(path) == rows
    before, when = path.read_bytes(), path.stat().st_mtime_ns
    publish(path, rows, by_seed)
    assert (path.read_bytes(), path.stat().st_mtime_ns) == (before, when)


def test_a_row_replaces_that_of_its_place_alone(tmp_path: Path) -> None:
    rows, path = rows_of(tmp_path), tmp_path / "track.csv"
    publish(path, rows, by_seed)
    changed = rows[1]._replace(training=0.9)
    publish(path, [changed], by_seed)
    assert read_published(path) == [rows[0], changed, rows[2]]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [("seed", "sed", "expected a table of condition"), ("calm,neat,0", "calm,neat,x", r"\[row\]\[column\]")],
)
def test_a_damaged_file_is_refused_and_left_alone(tmp_path: Path, old: str, new: str, said: str) -> None:
    rows, path = rows_of(tmp_path), tmp_path / "track.csv"
    publish(path, rows, by_seed)
    path.write_text(path.read_text().replace(old, new, 1))
    damaged = path.read_bytes()
    with pytest.raises(ExneatError, match=said):
        publish(path, rows, by_seed)
    assert path.read_bytes() == damaged


def test_a_study_takes_published_rows_of_the_same_settings_for_runs_that_are_not_there(tmp_path: Path) -> None:
    rows = rows_of(tmp_path / "there")
    planned = plan_study(tmp_path / "gone", variants={"neat": "NEAT"}, baselines=())
    same = tuple(replace(run, configuration_hash="0") for run in planned.runs)
    study = replace(planned, runs=same, rows=tuple(rows), levels={"gap": (0.1, 0.3)}, sweep_episodes=20)
    assert [run.seed for run in study.of("calm", "neat")] == [0, 1, 2]
    assert study.results["test"].tolist() == [0.2] * 3
    assert study.history("calm").groupby("seed")["best_so_far"].max().tolist() == [0.1 + 0.2] * 3
    assert study.robustness("calm")["fitness_mean"].max() == pytest.approx(2.5 * 0.9)
    assert not study.on_disk().reached
    assert not replace(study, runs=tuple(replace(run, configuration_hash="1") for run in same)).reached
    assert not replace(study, budget="paper").reached
