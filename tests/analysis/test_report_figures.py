"""Figures of the report: what they refuse, what they say, and that they repeat."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import msgspec
import pytest
from msgspec.structs import replace as changed

from exneat_cli.analysis.catalogue import FIGURE_KINDS, FigurePlan, Panel
from exneat_cli.analysis.report_figures import draw_figure
from exneat_cli.analysis.study import MissingRunsError, Study
from exneat_cli.errors import ExneatError
from tests.analysis.fake_studies import a_study, contents, finish_all, has_white_edges, plan_study

TRAINED, SWEPT = Panel("track", "calm"), Panel("track", "calm", sweep="sensor_noise")
PANELS = {
    "training": (TRAINED, Panel("track", "noisy")),
    "training_runs": (TRAINED,),
    "robustness": (SWEPT, Panel("track", "noisy", sweep="gap")),
    "cluster": (SWEPT,),
    "area": (TRAINED,),
    "network": (Panel("track", "calm", variant="neat"), Panel("track", "calm", variant="exneat")),
}


def a_plan(kind: str) -> FigurePlan:
    return FigurePlan(f"figure-4.3-{kind}.5", kind, f"Made up, {kind}", PANELS[kind])


def caption(plan: FigurePlan, study: Study, directory: Path, axis: str = "generation") -> str:
    return draw_figure(plan, {"track": study}, directory / "report", axis).caption


def without(study: Study, variant: str) -> Study:
    """The study before the runs of one variant began."""
    return replace(study, runs=tuple(run for run in study.runs if run.variant != variant))


@pytest.mark.parametrize("kind", FIGURE_KINDS)
def test_equal_data_in_two_places_gives_equal_bytes_and_nothing_is_cut_off(tmp_path: Path, kind: str) -> None:
    for place in ("a", "b"):
        built = draw_figure(a_plan(kind), {"track": a_study(tmp_path / place, seeds=6)}, tmp_path / place / "report")
        assert [path.name for path in built.paths] == [f"figure-4.3-{kind}.5.png", f"figure-4.3-{kind}.5.svg"]
        assert has_white_edges(built.paths[0])
    assert contents(tmp_path / "a" / "report") == contents(tmp_path / "b" / "report")


@pytest.mark.parametrize("kind", ["training", "training_runs", "area", "network"])
def test_a_variant_without_a_finished_run_is_named_with_the_command_that_makes_it(tmp_path: Path, kind: str) -> None:
    with pytest.raises(MissingRunsError, match=r"no finished run of ExNEAT\n  exneat sweep experiment=track"):
        caption(a_plan(kind), without(a_study(tmp_path), "exneat"), tmp_path)
    assert not (tmp_path / "report").exists()


@pytest.mark.parametrize("kind", ["robustness", "cluster"])
def test_runs_that_were_never_swept_are_missing_even_where_baselines_were(tmp_path: Path, kind: str) -> None:
    study = a_study(tmp_path)
    for run in (*study.of("calm", "neat"), *study.of("calm", "exneat")):
        run.directory.robustness.unlink()
    with pytest.raises(MissingRunsError, match=r"no finished sweep of sensor_noise\n  exneat sweep experiment=track"):
        caption(a_plan(kind), study, tmp_path)


def test_training_can_be_drawn_over_each_measure_of_effort(tmp_path: Path) -> None:
    labels = {"generation": "generation", "episodes": "training episodes", "env_steps": "environment steps (control"}
    for axis, label in labels.items():
        said = caption(a_plan("training"), a_study(tmp_path / axis), tmp_path, axis)
        assert ("latest value" in said) == (axis != "generation")
        assert f"<!-- {label}" in (tmp_path / "report" / "figure-4.3-training.5.svg").read_text()
    with pytest.raises(ExneatError, match="axis: expected one of generation, episodes, env_steps, got 'hours'"):
        caption(a_plan("training"), a_study(tmp_path), tmp_path, "hours")


def test_the_caption_says_how_many_runs_of_what_budget_there_are(tmp_path: Path) -> None:
    said = caption(a_plan("robustness"), a_study(tmp_path), tmp_path)
    assert said.startswith("Made up, robustness. Panel 1, no noise, number of runs: NEAT 3; ExNEAT 3; random actions 1")
    assert "Panel 2, much noise" in said
    assert "Intervals are too narrow below 10 runs" in said
    assert "Budget: quick. All variants had equal budgets of 400 training episodes per run" in said
    assert "too narrow" not in caption(a_plan("area"), a_study(tmp_path / "area"), tmp_path), "it has no intervals"


def test_the_champion_shown_is_that_of_the_run_best_on_validation(tmp_path: Path) -> None:
    study = plan_study(tmp_path, seeds=4)
    finish_all(study)
    directory = study.runs[1].directory
    directory.update_manifest(result=msgspec.structs.replace(directory.read_result(), validation=99.0))
    said = caption(a_plan("network"), study, tmp_path)
    assert "NEAT, no noise: seed 1, best on validation of 4 runs, budget quick, test fitness 0.75." in said
    assert "ExNEAT, no noise: seed 3, best on validation of 4 runs" in said


@pytest.mark.parametrize(
    ("kind", "change", "message"),
    [
        ("training", {"experiment": "ant"}, "figure-4.3-training.5: experiment: expected one of track, got 'ant'"),
        ("training", {"condition": "mud"}, "condition of track: expected one of calm, noisy, got 'mud'"),
        ("robustness", {"sweep": "rain"}, "sweep of track: expected one of sensor_noise, gap, got 'rain'"),
        ("robustness", {"value": "full_reward"}, "the task of track has no full reward"),
        ("network", {"variant": "random"}, "trained variant of track: expected one of neat, exneat, got 'random'"),
    ],
)
def test_a_panel_that_names_what_is_not_there_is_refused_with_what_is(
    tmp_path: Path, kind: str, change: dict[str, str], message: str
) -> None:
    plan = a_plan(kind)
    with pytest.raises(ExneatError, match=message):
        caption(changed(plan, panels=(changed(plan.panels[0], **change),)), a_study(tmp_path), tmp_path)


def test_an_experiment_of_baselines_alone_has_nothing_to_show(tmp_path: Path) -> None:
    with pytest.raises(MissingRunsError, match="no variant of track is trained"):
        caption(a_plan("training"), a_study(tmp_path, variants={"random": "random actions"}), tmp_path)


def test_a_figure_with_variants_of_its_own_shows_and_needs_no_others(tmp_path: Path) -> None:
    study = a_study(tmp_path, variants={"neat": "NEAT", "exneat": "ExNEAT", "fb": "front and back"}, baselines=())
    said = caption(changed(a_plan("training"), variants=("neat", "fb")), without(study, "exneat"), tmp_path)
    assert "front and back 3" in said
    assert "ExNEAT" not in said
    with pytest.raises(ExneatError, match="trained variant of track: expected one of neat, exneat, fb, got 'all'"):
        caption(changed(a_plan("training"), variants=("all",)), study, tmp_path)
