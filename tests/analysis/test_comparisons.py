"""The table of a whole experiment: what is left out, what is left empty, and what it says."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from exneat_cli.analysis.artefacts import Built
from exneat_cli.analysis.comparisons import build_comparison
from exneat_cli.analysis.study import MissingRunsError, Study
from tests.analysis.fake_studies import finish, finish_all, plan_study, run_of


def csv_of(table: Built) -> pd.DataFrame:
    return pd.read_csv(table.paths[0], dtype={"efficiency": str}).set_index(["condition", "variant"])


def test_every_variant_is_compared_in_every_condition(tmp_path: Path) -> None:
    table = build_comparison(finish_all(plan_study(tmp_path)), tmp_path / "report")
    assert [path.name for path in table.paths] == ["comparison-track.csv", "comparison-track.md"]
    assert [row[:3] for row in table.rows] == [
        (condition, variant, runs)
        for condition in ("no noise", "much noise")
        for variant, runs in (("NEAT", "3"), ("ExNEAT", "3"), ("random actions", "1"))
    ]
    figures = csv_of(table).loc[("no noise", "ExNEAT")]
    assert figures["training_mean"] == pytest.approx(0.413)
    assert figures["test_mean"] == pytest.approx(0.363)
    assert figures["test_p_holm"] == pytest.approx(0.1)
    assert figures["test_a12"] == 1.0
    assert figures["efficiency"] == "2"


def test_a_baseline_has_a_test_figure_but_no_training_no_p_and_no_efficiency(tmp_path: Path) -> None:
    figures = csv_of(build_comparison(finish_all(plan_study(tmp_path)), tmp_path / "report")).loc[
        ("no noise", "random actions")
    ]
    assert figures["test_mean"] == pytest.approx(0.45)
    assert figures[["training_mean", "test_low", "test_p_holm", "efficiency"]].isna().all()


def test_conditions_without_a_finished_run_are_left_out(tmp_path: Path) -> None:
    study = plan_study(tmp_path)
    finish(run_of(study, "noisy", "neat", 0), (0.5,))
    assert {row[0] for row in build_comparison(study, tmp_path / "report").rows} == {"much noise"}


def test_without_the_first_variant_there_are_figures_but_no_comparison(tmp_path: Path) -> None:
    study = plan_study(tmp_path)
    finish(run_of(study, "calm", "exneat", 0), (0.5,), test=0.4)
    figures = csv_of(build_comparison(study, tmp_path / "report"))
    assert figures.loc[("no noise", "ExNEAT"), "test_mean"] == pytest.approx(0.4)
    assert figures[["test_p_holm", "test_a12", "efficiency"]].isna().all(axis=None)
    assert figures.loc[("no noise", "NEAT"), "runs"] == 0


def test_baselines_alone_can_be_compared(tmp_path: Path) -> None:
    study = plan_study(tmp_path)
    finish(run_of(study, "calm", "random", 0), test=0.2)
    table = build_comparison(study, tmp_path / "report")
    assert "No run has spent anything" in table.caption


def test_nothing_finished_is_an_error_with_the_command(tmp_path: Path) -> None:
    with pytest.raises(MissingRunsError, match=r"track.*\n  exneat sweep experiment=track"):
        build_comparison(plan_study(tmp_path), tmp_path / "report")


@pytest.mark.parametrize("has_full_reward", [False, True])
def test_full_reward_is_shown_only_where_the_task_has_one(tmp_path: Path, has_full_reward: bool) -> None:
    study = finish_all(plan_study(tmp_path, has_full_reward=has_full_reward))
    table = build_comparison(study, tmp_path / "report")
    assert ("full reward" in table.header) == has_full_reward
    assert ("full_reward_mean" in csv_of(table)) == has_full_reward
    assert {len(row) for row in table.rows} == {len(table.header)}


def test_the_same_data_gives_the_same_bytes(tmp_path: Path) -> None:
    def files(study: Study, directory: Path) -> list[bytes]:
        return [path.read_bytes() for path in build_comparison(study, directory).paths]

    one, other = (finish_all(plan_study(tmp_path / name)) for name in ("one", "other"))
    assert files(one, tmp_path / "a") == files(other, tmp_path / "b")
