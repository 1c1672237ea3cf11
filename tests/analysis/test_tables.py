"""Tables from made-up runs: statistics by hand, what is left empty, missing runs, captions and equal bytes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pandas as pd
import pytest

from exneat_cli.analysis.catalogue import Built, Column, TablePlan, TableRow, read_catalogue
from exneat_cli.analysis.study import MissingRunsError, Study
from exneat_cli.analysis.tables import build_comparison, build_table
from exneat_cli.errors import ExneatError
from tests.analysis.fake_studies import contents, finish, finish_all, plan_study, run_of

CATALOGUE = Path(__file__).parents[2] / "experiments" / "catalogue.yaml"
SWEPT = {"noisy": Column(of="robustness", sweep="sensor_noise", level=0.3)}
PLAIN = {"training": Column(of="training"), "test": Column(of="test"), "efficiency": Column(of="efficiency")}
ROWS = (TableRow("track", "calm", "neat"), TableRow("track", "calm", "exneat"))


def built(study: Study, directory: Path, columns: Mapping[str, Column], *rows: TableRow, note: str = "") -> Built:
    plan = TablePlan("table-9.1", "Track", dict(columns), rows or ROWS, note)
    return build_table(plan, {"track": study}, directory / "report")


def csv_of(table: Built, *index: str) -> pd.DataFrame:
    return pd.read_csv(table.paths[0], dtype={"mean": str, "published": str, "efficiency": str}).set_index(list(index))


def lines_of(study: Study, directory: Path, columns: Mapping[str, Column], *rows: TableRow) -> pd.DataFrame:
    return csv_of(built(study, directory, columns, *rows), "variant", "quantity")


def test_each_line_holds_what_was_published_and_what_runs_gave(tmp_path: Path) -> None:
    study = plan_study(tmp_path)
    for seed, (neat, exneat) in enumerate([(0.1, 0.7), (0.2, 0.8), (0.6, 0.9)]):
        finish(run_of(study, "calm", "neat", seed), (0.05, neat), test=neat / 2)
        finish(run_of(study, "calm", "exneat", seed), (exneat, exneat), test=exneat / 2)
    rows = (
        TableRow("track", "calm", "neat", {"training": 0.7869, "efficiency": ">20"}),
        TableRow("track", "calm", "exneat", {"training": 1.0, "efficiency": 7}),
    )
    table = built(study, tmp_path, PLAIN, *rows)
    assert [row[1:3] for row in table.rows] == [(variant, q) for variant in ("NEAT", "ExNEAT") for q in PLAIN]
    neat, _, neat_efficiency, exneat, exneat_test, exneat_efficiency = table.rows
    assert neat[:5] == ("no noise", "NEAT", "training", "0.7869", "0.300")
    assert neat[6:] == ("0.300", "3", "", "", "")
    assert exneat[3:] == ("1.0", "0.800", "[0.700, 0.900]", "0.800", "3", "0.500", "0.100", "1.00")
    assert exneat_test[3:5] == ("", "0.400")
    assert neat_efficiency[3:] == (">20", "2", "", "", "3", "", "", "")
    assert exneat_efficiency[3:] == ("7", "1", "", "", "3", "", "", "")


def test_a_baseline_can_be_a_row_without_weakening_the_tests_of_the_others(tmp_path: Path) -> None:
    study = finish_all(plan_study(tmp_path))
    table = lines_of(study, tmp_path, PLAIN, *(TableRow("track", "calm", variant) for variant in study.variants))
    assert table.loc[("ExNEAT", "test"), "p_holm"] == pytest.approx(0.1)
    assert table.loc[("random actions", "test"), "mean"] == "0.45"
    assert table.loc[("random actions", "test"), ["low", "p_holm"]].isna().all()
    assert table.loc[("random actions", "efficiency"), ["mean", "published"]].isna().all()


def test_variants_can_have_references_of_their_own(tmp_path: Path) -> None:
    variants = {"neat": "NEAT", "exneat": "ExNEAT", "neat_2": "NEAT 2", "exneat_2": "ExNEAT 2"}
    study = finish_all(plan_study(tmp_path, variants=variants, baselines=(), references={"exneat_2": "neat_2"}))
    rows = [TableRow("track", condition, variant) for condition in study.conditions for variant in variants]
    table = built(study, tmp_path, PLAIN, *rows)
    lines = csv_of(table, "condition", "variant", "quantity").loc["no noise"]
    assert lines.loc[("ExNEAT", "test"), "margin"] == pytest.approx(0.1)
    assert lines.loc[("ExNEAT 2", "test"), "margin"] == pytest.approx(0.1)
    assert lines.loc[("ExNEAT 2", "efficiency"), "mean"] == lines.loc[("ExNEAT", "efficiency"), "mean"] == "3"
    assert lines.loc[("NEAT 2", "test"), ["margin", "p_holm", "a12"]].isna().all()
    assert "compared with NEAT, ExNEAT 2 with NEAT 2: margin" in table.caption
    assert "training ExNEAT +0.100 over NEAT; ExNEAT 2 +0.100 over NEAT 2, test ExNEAT +0.100" in table.caption


def test_what_a_baseline_reaches_can_be_taken_away(tmp_path: Path) -> None:
    study = finish_all(plan_study(tmp_path))
    over = {"test": Column(of="test"), "over": Column(of="test", minus="random")}
    table = lines_of(study, tmp_path, over)
    for column in ("mean", "low", "high"):
        test, above = (float(table.loc[("ExNEAT", quantity), column]) for quantity in over)
        assert test - above == pytest.approx(0.45)
    assert table.loc[("ExNEAT", "over"), "p_holm"] == table.loc[("ExNEAT", "test"), "p_holm"]
    with pytest.raises(ExneatError, match="minus of track: expected one of"):
        lines_of(study, tmp_path, {"over": Column(of="test", minus="wind")})


@pytest.mark.parametrize(("seeds", "said"), [(3, True), (4, False)])
def test_too_few_runs_for_any_p_are_named(tmp_path: Path, seeds: int, said: bool) -> None:
    table = built(finish_all(plan_study(tmp_path, seeds=seeds)), tmp_path, PLAIN)
    assert ("With 3 runs against 3, p cannot be below 0.1, whatever the results." in table.caption) == said


def test_efficiency_is_when_the_mean_of_runs_reaches_that_of_the_first_variant_if_ever(tmp_path: Path) -> None:
    study = plan_study(tmp_path, seeds=2, variants={"neat": "NEAT", "exneat": "ExNEAT", "fb": "fb"}, baselines=())
    for seed, curve in enumerate([(0.9, 0.9, 0.9), (0.0, 0.1, 0.2)]):
        finish(run_of(study, "calm", "neat", seed), (0.1, 0.1, 0.5))
        finish(run_of(study, "calm", "exneat", seed), curve)
        finish(run_of(study, "calm", "fb", seed), (0.1, 0.2, 0.4))
    table = lines_of(study, tmp_path, PLAIN, *(TableRow("track", "calm", variant) for variant in study.variants))
    assert [table.loc[(label, "efficiency"), "mean"] for label in study.variants.values()] == ["3", "2", ">3"]


def test_csv_keeps_every_digit_where_markdown_rounds_and_zero_has_no_sign(tmp_path: Path) -> None:
    study = plan_study(tmp_path, seeds=1)
    for variant, end in (("neat", 812.3456), ("exneat", -0.0111)):
        finish(run_of(study, "calm", variant, 0), (end,), test=end / 1000)
    table = built(study, tmp_path, PLAIN)
    assert [row[4] for row in table.rows] == ["812.3", "0.812", "1", "0.0", "0.000", ">1"]
    exact, readable, _ = (path.read_text() for path in table.paths)
    assert ",-0.0111," in exact
    assert "| 0.0 |" in readable


def test_robustness_is_that_of_its_sweep_level_and_value(tmp_path: Path) -> None:
    places = {("sensor_noise", 0.0): 0.9, ("sensor_noise", 0.1 + 0.2): 0.6, ("gap", 0.3): 0.1}
    study = finish_all(plan_study(tmp_path), {place: (fitness, 10 * fitness) for place, fitness in places.items()})
    full = Column(of="robustness", sweep="sensor_noise", level=0.3, value="full_reward")
    table = lines_of(study, tmp_path, {**SWEPT, "full": full})
    assert [table.loc[("NEAT", name), "mean"] for name in ("noisy", "full")] == ["0.6", "6.0"]
    assert table.loc[("NEAT", "noisy"), "best_5"] == pytest.approx(0.6), "all, as there are fewer than five"


def test_the_view_of_the_thesis_takes_the_five_runs_best_on_validation(tmp_path: Path) -> None:
    study = plan_study(tmp_path, seeds=7)
    for seed, validation in enumerate([0.1, 0.9, 0.8, 0.2, 0.7, 0.6, 0.5]):
        for variant in ("neat", "exneat"):
            levels = {("sensor_noise", 0.3): (float(seed**2), 0.0)}
            finish(run_of(study, "calm", variant, seed), (0.5,), validation=validation, levels=levels)
    line = lines_of(study, tmp_path, SWEPT).loc[("NEAT", "noisy")]
    assert line["best_5"] == pytest.approx((1 + 4 + 16 + 25 + 36) / 5)
    assert float(line["mean"]) == pytest.approx(13.0)


@pytest.mark.parametrize(("finished", "missing"), [("neat", "ExNEAT"), ("exneat", "NEAT")])
def test_a_table_needs_runs_of_its_variants_and_of_the_one_that_they_are_compared_with(
    tmp_path: Path, finished: str, missing: str
) -> None:
    study = plan_study(tmp_path)
    finish(run_of(study, "calm", finished, 0), (0.5,))
    with pytest.raises(MissingRunsError, match=rf"calm.* of {missing}\n  exneat sweep experiment=track budget=quick"):
        built(study, tmp_path, PLAIN, TableRow("track", "calm", "exneat"))
    assert not (tmp_path / "report").exists()


@pytest.mark.parametrize("levels", [None, {("sensor_noise", 0.2): (0.4, 0.0)}, {("gap", 0.3): (0.4, 0.0)}])
def test_a_level_that_was_not_measured_is_an_error_with_sweep_level_and_command(
    tmp_path: Path, levels: dict[tuple[str, float], tuple[float, float]] | None
) -> None:
    study = finish_all(plan_study(tmp_path), levels)
    with pytest.raises(MissingRunsError, match=r"sensor_noise, level 0.3.*NEAT, ExNEAT\n  exneat sweep"):
        built(study, tmp_path, SWEPT)


@pytest.mark.parametrize("place", [("walk", "calm", "neat"), ("track", "stormy", "neat"), ("track", "calm", "neta")])
def test_a_plan_that_names_something_unknown_is_refused(tmp_path: Path, place: tuple[str, str, str]) -> None:
    with pytest.raises(ExneatError, match=r"table-9.1: .*expected one of .*, got"):
        built(finish_all(plan_study(tmp_path)), tmp_path, PLAIN, TableRow(*place))


def test_the_caption_counts_runs_and_warns_of_few(tmp_path: Path) -> None:
    few = built(finish_all(plan_study(tmp_path / "few")), tmp_path / "few", PLAIN, note="A note.")
    assert few.caption.startswith("Budget quick; finished runs per condition: NEAT 3; ExNEAT 3.")
    assert few.caption.endswith("A note.")
    assert "All variants had equal budgets of 400 training episodes per run" in few.caption
    assert few.caption in few.paths[1].read_text()
    published = TableRow("track", "calm", "neat", {"efficiency": 7})
    enough = built(finish_all(plan_study(tmp_path, seeds=10)), tmp_path, PLAIN, published)
    for words in ("not exactly comparable", "published figures rest on a larger budget"):
        assert words in enough.caption
        assert words not in few.caption
    assert "too narrow below 10 runs" in few.caption
    assert "too narrow" not in enough.caption


def test_a_bar_in_a_label_does_not_break_the_markdown(tmp_path: Path) -> None:
    study = finish_all(plan_study(tmp_path, conditions={"calm": "no|noise"}))
    lines = built(study, tmp_path, PLAIN).paths[1].read_text().splitlines()
    assert len({line.replace("\\|", "").count("|") for line in lines if line.startswith("|")}) == 1


def test_every_table_of_the_catalogue_can_be_built_and_keeps_what_was_published(tmp_path: Path) -> None:
    plans = [each for each in read_catalogue(CATALOGUE).values() if isinstance(each, TablePlan)]
    assert len(plans) == 6
    levels = {(sweep, 0.2): (700.0, 1600.0) for sweep in ("reset_noise", "sensor_noise")}
    for each in plans:
        names = {row.variant: row.variant for row in each.rows}, {row.condition: row.condition for row in each.rows}
        directory, experiment = tmp_path / each.name, each.rows[0].experiment
        variants, baselines = names[0] | {"linear_fusion": "linear fusion"}, ("linear_fusion",)
        planned = plan_study(
            directory, variants=variants, baselines=baselines, conditions=names[1], experiment=experiment
        )
        table = build_table(each, {experiment: finish_all(planned, levels)}, tmp_path / "report")
        published = [str(figure) for row in each.rows for figure in row.published.values()]
        assert sorted(row[3] for row in table.rows if row[3]) == sorted(published)
        assert len(table.rows) == len(each.rows) * len(each.columns)
        assert {len(row) for row in table.rows} == {len(table.header)}


def test_every_variant_is_compared_in_every_condition(tmp_path: Path) -> None:
    table = build_comparison(finish_all(plan_study(tmp_path)), tmp_path / "report")
    assert [path.name for path in table.paths] == [f"comparison-track.{kind}" for kind in ("csv", "md", "tex")]
    assert {len(row) for row in table.rows} == {len(table.header)}
    assert [row[:3] for row in table.rows] == [
        (condition, variant, runs)
        for condition in ("no noise", "much noise")
        for variant, runs in (("NEAT", "3"), ("ExNEAT", "3"), ("random actions", "1"))
    ]
    lines = csv_of(table, "condition", "variant")
    exneat, random = lines.loc[("no noise", "ExNEAT")], lines.loc[("no noise", "random actions")]
    assert list(exneat[["training_mean", "test_mean", "test_p_holm", "test_a12"]]) == pytest.approx(
        [0.413, 0.363, 0.1, 1.0]
    )
    assert exneat["efficiency"] == "3"
    assert random["test_mean"] == pytest.approx(0.45)
    assert random[["training_mean", "test_low", "test_p_holm", "efficiency"]].isna().all()


def test_full_reward_is_compared_where_the_task_has_one_alone(tmp_path: Path) -> None:
    for has_full_reward in (True, False):
        study = finish_all(plan_study(tmp_path / str(has_full_reward), has_full_reward=has_full_reward))
        table = build_comparison(study, tmp_path)
        assert ("full reward" in table.header) == ("Fitness is forward reward" in table.caption) == has_full_reward
        assert ("full_reward_mean" in csv_of(table, "condition")) == has_full_reward


def test_what_has_not_been_run_is_left_out_or_empty_and_nothing_is_compared_with_it(tmp_path: Path) -> None:
    study = plan_study(tmp_path)
    with pytest.raises(MissingRunsError, match=r"track.*\n  exneat sweep experiment=track"):
        build_comparison(study, tmp_path / "report")
    finish(run_of(study, "noisy", "exneat", 0), (0.5,), test=0.4)
    lines = csv_of(build_comparison(plan_study(tmp_path), tmp_path / "report"), "condition", "variant")
    assert set(lines.index.get_level_values("condition")) == {"much noise"}
    assert lines.loc[("much noise", "ExNEAT"), "test_mean"] == pytest.approx(0.4)
    assert lines[["test_p_holm", "test_a12", "efficiency"]].isna().all(axis=None)
    assert lines.loc[("much noise", "NEAT"), "runs"] == 0


def test_the_same_data_gives_the_same_bytes(tmp_path: Path) -> None:
    for each in ("one", "other"):
        study = finish_all(plan_study(tmp_path / each), {("sensor_noise", 0.3): (0.4, 0.0)})
        built(study, tmp_path / each, {**PLAIN, **SWEPT})
        build_comparison(study, tmp_path / each / "report")
    assert contents(tmp_path / "one" / "report") == contents(tmp_path / "other" / "report")
