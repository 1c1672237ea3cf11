"""What a study sees of its runs, and what is said about budgets."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import msgspec
import pandas as pd
import pytest

from exneat_cli.analysis.study import budget_sentence, read_csv
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


def spent(**episodes: list[int]) -> pd.DataFrame:
    """What the runs of each variant spent in one condition: 10 steps in each episode."""
    rows = [(variant, count, 10 * count) for variant, counts in episodes.items() for count in counts]
    return pd.DataFrame(rows, columns=["variant", "episodes", "env_steps"])


def test_equal_budgets_are_said_to_be_equal_with_the_steps_of_each_variant() -> None:
    assert budget_sentence([spent(NEAT=[8000, 8000], ExNEAT=[8000])]) == (
        "All variants had equal budgets of 8,000 training episodes per run; "
        "environment steps per run, on average: NEAT 80,000; ExNEAT 80,000."
    )


def test_budgets_are_unequal_if_a_single_run_had_other_episodes() -> None:
    assert budget_sentence([spent(NEAT=[300, 400], ExNEAT=[400])]) == (
        "The variants had unequal budgets of training episodes per run (NEAT 300 to 400; ExNEAT 400); "
        "environment steps per run, on average: NEAT 3,500; ExNEAT 4,000."
    )


def test_variants_are_compared_within_conditions_not_across_them() -> None:
    short, long = spent(NEAT=[100], ExNEAT=[100]), spent(NEAT=[200], ExNEAT=[200])
    assert budget_sentence([short, long]).startswith("All variants had equal budgets of 100 to 200 training")
    crossed = [spent(NEAT=[100], ExNEAT=[200]), spent(NEAT=[200], ExNEAT=[100])]
    assert budget_sentence(crossed).startswith("The variants had unequal budgets")


def test_variants_that_never_meet_in_a_condition_are_not_called_equal() -> None:
    for conditions in ([spent(NEAT=[100]), spent()], [spent(NEAT=[100]), spent(ExNEAT=[100])]):
        assert budget_sentence(conditions).startswith("No two variants have finished runs of the same condition")
    for nothing in ([], [spent()]):
        assert budget_sentence(nothing) == "No run has spent anything on training."


def test_what_was_spent_is_that_of_finished_trained_runs(tmp_path: Path) -> None:
    study = plan_study(tmp_path)
    finish(run_of(study, "calm", "neat", 0), (0.1, 0.2), episodes=40, env_steps=700)
    finish(run_of(study, "calm", "neat", 2), (0.1, 0.2), episodes=50, env_steps=800)
    finish(run_of(study, "noisy", "exneat", 0), (0.1, 0.2))
    finish(run_of(study, "calm", "random", 0))
    assert study.spent_in("calm", study.variants).to_numpy().tolist() == [["NEAT", 40, 700], ["NEAT", 50, 800]]
