"""Tables of the catalogue from made-up runs: figures by hand, missing runs, equal bytes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pandas as pd
import pytest
import yaml

from exneat_cli.analysis.catalogue import Column, TablePlan, TableRow, read_catalogue
from exneat_cli.analysis.study import MissingRunsError, Study
from exneat_cli.analysis.tables import build_table
from exneat_cli.errors import ExneatError
from tests.analysis.fake_studies import finish, finish_all, plan_study, run_of, seen_anew

EXPERIMENTS = Path(__file__).parents[2] / "experiments"
SWEPT = {"noisy": Column(of="robustness", sweep="sensor_noise", level=0.3)}
PLAIN = {"training": Column(of="training"), "test": Column(of="test"), "efficiency": Column(of="efficiency")}


def plan(columns: Mapping[str, Column], *rows: TableRow, note: str = "") -> TablePlan:
    rows = rows or (TableRow("track", "calm", "neat"), TableRow("track", "calm", "exneat"))
    return TablePlan("table-9.1", "Track", columns, rows, note)


def built_csv(directory: Path, study: Study, columns: Mapping[str, Column], *rows: TableRow) -> pd.DataFrame:
    table = build_table(plan(columns, *rows), {"track": study}, directory / "report")
    return pd.read_csv(table.paths[0], dtype={"mean": str, "published": str}).set_index(["variant", "quantity"])


def test_each_line_holds_what_was_published_and_what_runs_gave(tmp_path: Path) -> None:
    study = plan_study(tmp_path)
    for seed, (neat, exneat) in enumerate([(0.1, 0.7), (0.2, 0.8), (0.6, 0.9)]):
        finish(run_of(study, "calm", "neat", seed), (0.05, neat), test=neat / 2)
        finish(run_of(study, "calm", "exneat", seed), (exneat, exneat), test=exneat / 2)
    rows = (
        TableRow("track", "calm", "neat", {"training": 0.7869, "efficiency": ">20"}),
        TableRow("track", "calm", "exneat", {"training": 1.0, "efficiency": 7}),
    )
    table = build_table(plan(PLAIN, *rows), {"track": study}, tmp_path / "report")
    by_place = {row[1:3]: row for row in table.rows}
    assert [row[1:3] for row in table.rows] == [(variant, q) for variant in ("NEAT", "ExNEAT") for q in PLAIN]
    assert by_place["NEAT", "training"][:5] == ("no noise", "NEAT", "training", "0.7869", "0.300")
    assert by_place["NEAT", "training"][6:] == ("0.300", "3", "", "")
    assert by_place["ExNEAT", "training"][3:] == ("1.0", "0.800", "[0.700, 0.900]", "0.800", "3", "0.100", "1.00")
    assert by_place["ExNEAT", "test"][3:5] == ("", "0.400")
    assert by_place["NEAT", "efficiency"][3:] == (">20", "2", "", "", "3", "", "")
    assert by_place["ExNEAT", "efficiency"][3:] == ("7", "1", "", "", "3", "", "")


def test_a_baseline_can_be_a_row_without_weakening_the_tests_of_the_others(tmp_path: Path) -> None:
    study = finish_all(plan_study(tmp_path))
    rows = [TableRow("track", "calm", variant) for variant in study.variants]
    table = built_csv(tmp_path, study, PLAIN, *rows)
    assert table.loc[("ExNEAT", "test"), "p_holm"] == pytest.approx(0.1)
    assert table.loc[("random actions", "test"), "mean"] == "0.45"
    assert table.loc[("random actions", "test"), ["low", "p_holm"]].isna().all()
    assert table.loc[("random actions", "efficiency"), ["mean", "published"]].isna().all()


def test_an_variant_that_never_reaches_the_first_one_takes_more_than_all_generations(tmp_path: Path) -> None:
    study = plan_study(tmp_path, seeds=1)
    finish(run_of(study, "calm", "neat", 0), (0.1, 0.2, 0.9))
    finish(run_of(study, "calm", "exneat", 0), (0.1, 0.2, 0.8))
    table = built_csv(tmp_path, study, PLAIN)
    assert table.loc[("ExNEAT", "efficiency"), "mean"] == ">3"
    assert table.loc[("NEAT", "efficiency"), "mean"] == "3"


def test_efficiency_looks_at_the_mean_of_runs_not_at_single_runs(tmp_path: Path) -> None:
    study = plan_study(tmp_path, seeds=2)
    for seed in range(2):
        finish(run_of(study, "calm", "neat", seed), (0.1, 0.1, 0.5))
    finish(run_of(study, "calm", "exneat", 0), (0.9, 0.9, 0.9))
    finish(run_of(study, "calm", "exneat", 1), (0.0, 0.1, 0.2))
    assert built_csv(tmp_path, study, PLAIN).loc[("ExNEAT", "efficiency"), "mean"] == "2"


def test_csv_keeps_every_digit_where_markdown_rounds(tmp_path: Path) -> None:
    study = plan_study(tmp_path, seeds=1)
    for variant in ("neat", "exneat"):
        finish(run_of(study, "calm", variant, 0), (1 / 3,))
    table = build_table(plan(PLAIN), {"track": study}, tmp_path / "report")
    assert "0.3333333333333333," in table.paths[0].read_text()
    assert "| 0.333 |" in table.paths[1].read_text()
    assert "0.3333" not in table.paths[1].read_text()


def test_large_figures_are_rounded_to_one_decimal(tmp_path: Path) -> None:
    study = plan_study(tmp_path, seeds=1)
    for variant, end in (("neat", 812.3456), ("exneat", -3.2111)):
        finish(run_of(study, "calm", variant, 0), (end,))
    table = build_table(plan({"training": Column(of="training")}), {"track": study}, tmp_path / "report")
    assert [row[4] for row in table.rows] == ["812.3", "-3.2"]


def test_robustness_is_that_of_its_sweep_level_and_value(tmp_path: Path) -> None:
    levels = {
        ("sensor_noise", 0.0): (0.9, 9.0),
        ("sensor_noise", 0.1 + 0.2): (0.6, 6.0),
        ("reset_noise", 0.3): (0.1, 1.0),
    }
    study = finish_all(plan_study(tmp_path), levels)
    columns = {**SWEPT, "full": Column(of="robustness", sweep="sensor_noise", level=0.3, value="full_reward")}
    table = built_csv(tmp_path, study, columns)
    assert table.loc[("NEAT", "noisy"), "mean"] == "0.6"
    assert table.loc[("NEAT", "full"), "mean"] == "6.0"


def test_the_view_of_the_thesis_takes_the_five_runs_best_on_validation(tmp_path: Path) -> None:
    study = plan_study(tmp_path, seeds=7)
    validation = [0.1, 0.9, 0.8, 0.2, 0.7, 0.6, 0.5]
    for seed in range(7):
        for variant in ("neat", "exneat"):
            levels = {("sensor_noise", 0.3): (float(seed**2), 0.0)}
            finish(run_of(study, "calm", variant, seed), (0.5,), validation=validation[seed], levels=levels)
    table = built_csv(tmp_path, study, SWEPT)
    assert table.loc[("NEAT", "noisy"), "best_5"] == pytest.approx((1 + 4 + 16 + 25 + 36) / 5)
    assert float(table.loc[("NEAT", "noisy"), "mean"]) == pytest.approx(13.0)


def test_with_fewer_than_five_runs_the_view_of_the_thesis_takes_all(tmp_path: Path) -> None:
    study = finish_all(plan_study(tmp_path), {("sensor_noise", 0.3): (0.4, 0.0)})
    assert built_csv(tmp_path, study, SWEPT).loc[("NEAT", "noisy"), "best_5"] == pytest.approx(0.4)


def test_an_variant_without_a_finished_run_is_an_error_with_the_command(tmp_path: Path) -> None:
    study = plan_study(tmp_path)
    finish(run_of(study, "calm", "neat", 0), (0.5,))
    with pytest.raises(MissingRunsError, match=r"(?s)calm.*ExNEAT\n  exneat sweep experiment=track budget=quick"):
        build_table(plan(PLAIN), {"track": seen_anew(study)}, tmp_path / "report")
    assert not (tmp_path / "report").exists()


def test_an_variant_needs_the_one_that_it_is_compared_with(tmp_path: Path) -> None:
    study = plan_study(tmp_path)
    finish(run_of(study, "calm", "exneat", 0), (0.5,))
    with pytest.raises(MissingRunsError, match="NEAT"):
        build_table(plan(PLAIN, TableRow("track", "calm", "exneat")), {"track": study}, tmp_path / "report")


@pytest.mark.parametrize("levels", [None, {("sensor_noise", 0.2): (0.4, 0.0)}, {("reset_noise", 0.3): (0.4, 0.0)}])
def test_a_level_that_was_not_measured_is_an_error_with_sweep_level_and_command(
    tmp_path: Path, levels: dict[tuple[str, float], tuple[float, float]] | None
) -> None:
    study = finish_all(plan_study(tmp_path), levels)
    with pytest.raises(MissingRunsError, match=r"(?s)sensor_noise, level 0.3.*NEAT, ExNEAT\n  exneat sweep"):
        build_table(plan(SWEPT), {"track": study}, tmp_path / "report")


@pytest.mark.parametrize(
    "row",
    [
        TableRow("walk", "calm", "neat"),
        TableRow("track", "stormy", "neat"),
        TableRow("track", "calm", "neta"),
        TableRow("track", "calm", "neat", {"trainnig": 1.0}),
    ],
)
def test_a_plan_that_names_something_unknown_is_refused(tmp_path: Path, row: TableRow) -> None:
    study = finish_all(plan_study(tmp_path))
    with pytest.raises(ExneatError, match=r"table-9.1.*expected"):
        build_table(plan(PLAIN, row), {"track": study}, tmp_path / "report")


def test_a_table_of_nothing_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ExneatError, match="at least one row"):
        build_table(plan({}), {"track": finish_all(plan_study(tmp_path))}, tmp_path / "report")


def test_a_robustness_column_without_a_level_is_refused(tmp_path: Path) -> None:
    columns = {"noisy": Column(of="robustness", sweep="sensor_noise")}
    with pytest.raises(ExneatError, match="a sweep and a level"):
        build_table(plan(columns), {"track": finish_all(plan_study(tmp_path))}, tmp_path / "report")


def test_the_caption_counts_runs_and_warns_of_few(tmp_path: Path) -> None:
    few = build_table(plan(PLAIN, note="A note."), {"track": finish_all(plan_study(tmp_path / "few"))}, tmp_path / "a")
    many = finish_all(plan_study(tmp_path / "many", seeds=10))
    enough = build_table(plan(PLAIN), {"track": many}, tmp_path / "b")
    assert few.caption.startswith("Budget quick; finished runs per condition: NEAT 3; ExNEAT 3.")
    assert "too narrow below 10 runs" in few.caption
    assert few.caption.endswith("A note.")
    assert "not exactly comparable" in few.caption
    assert "All variants had equal budgets of 400 training episodes per run" in few.caption
    assert few.caption in few.paths[1].read_text()
    assert "NEAT 10; ExNEAT 10." in enough.caption
    assert "too narrow" not in enough.caption
    assert "  " not in enough.caption


def test_the_caption_tells_unequal_budgets(tmp_path: Path) -> None:
    study = plan_study(tmp_path, seeds=1)
    finish(run_of(study, "calm", "neat", 0), (0.5,), episodes=300)
    finish(run_of(study, "calm", "exneat", 0), (0.5,), episodes=400)
    table = build_table(plan(PLAIN), {"track": study}, tmp_path / "report")
    assert "unequal budgets of training episodes per run (NEAT 300; ExNEAT 400)" in table.caption


def test_the_same_data_gives_the_same_bytes(tmp_path: Path) -> None:
    levels = {("sensor_noise", 0.3): (0.4, 0.0)}
    for each in ("one", "other"):
        study = finish_all(plan_study(tmp_path / each), levels)
        build_table(plan({**PLAIN, **SWEPT}), {"track": study}, tmp_path / f"report-{each}")
    for path in (tmp_path / "report-one").iterdir():
        assert path.read_bytes() == (tmp_path / "report-other" / path.name).read_bytes(), path.name


def test_a_bar_in_a_label_does_not_break_the_markdown(tmp_path: Path) -> None:
    study = finish_all(plan_study(tmp_path, conditions={"calm": "no|noise"}))
    lines = build_table(plan(PLAIN), {"track": study}, tmp_path / "report").paths[1].read_text().splitlines()
    widths = {line.replace("\\|", "").count("|") for line in lines if line.startswith("|")}
    assert len(widths) == 1


def study_of(experiment: str, directory: Path) -> Study:
    content = yaml.safe_load((EXPERIMENTS / f"{experiment}.yaml").read_text(encoding="utf-8"))
    study = plan_study(
        directory,
        variants={name: str(variant["label"]) for name, variant in content["variants"].items()},
        baselines=[name for name in content["variants"] if name in ("random", "linear_fusion", "motionless")],
        conditions={name: str(condition["label"]) for name, condition in content["conditions"].items()},
        experiment=experiment,
    )
    swept = {("reset_noise", 0.2): (700.0, 1600.0), ("sensor_noise", 0.2): (650.0, 1500.0)}
    return finish_all(study, swept)


def test_every_table_of_the_catalogue_can_be_built_and_keeps_what_was_published(tmp_path: Path) -> None:
    plans = [each for each in read_catalogue(EXPERIMENTS / "catalogue.yaml").values() if isinstance(each, TablePlan)]
    experiments = sorted({row.experiment for each in plans for row in each.rows})
    studies = {name: study_of(name, tmp_path) for name in experiments}
    assert len(plans) == 5
    for each in plans:
        table = build_table(each, studies, tmp_path / "report")
        published = [str(figure) for row in each.rows for figure in row.published.values()]
        printed = [row[3] for row in table.rows if row[3]]
        assert sorted(printed) == sorted(published)
        assert len(table.rows) == len(each.rows) * len(each.columns)
        assert {len(row) for row in table.rows} == {len(table.header)}
