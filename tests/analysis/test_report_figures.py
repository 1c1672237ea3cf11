"""Figures of the report: what they show, what they refuse, and that they repeat."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from exneat_cli.analysis.catalogue import FIGURE_KINDS, FigurePlan, Panel
from exneat_cli.analysis.report_figures import draw_figure
from exneat_cli.analysis.robustness_panels import draw_clusters, draw_levels
from exneat_cli.analysis.study import MissingRunsError, Study
from exneat_cli.analysis.training_panels import draw_areas, draw_each_run, draw_means
from exneat_cli.errors import ExneatError
from tests.analysis.figure_studies import COMMAND, a_study, has_white_edges

PANELS = {
    "training": (Panel("made_up", "noise"), Panel("made_up", "long")),
    "training_runs": (Panel("made_up", "noise"),),
    "robustness": (Panel("made_up", "noise", sweep="sensor_noise"), Panel("made_up", "long", sweep="gap")),
    "cluster": (Panel("made_up", "noise", sweep="sensor_noise"),),
    "area": (Panel("made_up", "noise"),),
    "network": (Panel("made_up", "noise", variant="neat"), Panel("made_up", "noise", variant="exneat")),
}
VARIANTS = {"neat": "NEAT", "exneat": "ExNEAT single", "random": "random actions"}
SWEPT = Panel("made_up", "noise", sweep="sensor_noise")
TRAINED = Panel("made_up", "noise")


def a_plan(kind: str) -> FigurePlan:
    return FigurePlan(f"figure-4.3-{kind}.5", kind, f"Made up, {kind}", PANELS[kind])


def empty_axes() -> Axes:
    return Figure().add_subplot()


def without(study: Study, variant: str) -> Study:
    """The study before the runs of one variant began."""
    return replace(study, runs=tuple(run for run in study.runs if run.variant != variant))


def test_there_is_a_figure_here_for_every_kind_of_the_catalogue() -> None:
    assert set(PANELS) == set(FIGURE_KINDS)


@pytest.mark.parametrize("kind", FIGURE_KINDS)
def test_equal_data_in_two_places_gives_equal_bytes(tmp_path: Path, kind: str) -> None:
    for place in ("a", "b"):
        study = a_study(tmp_path / place, seeds=6)
        built = draw_figure(a_plan(kind), {"made_up": study}, tmp_path / place / "report")
        assert [path.name for path in built.paths] == [f"figure-4.3-{kind}.5.png", f"figure-4.3-{kind}.5.svg"]
    for path in (tmp_path / "a" / "report").iterdir():
        assert path.read_bytes() == (tmp_path / "b" / "report" / path.name).read_bytes(), path.name


@pytest.mark.parametrize("kind", FIGURE_KINDS)
def test_nothing_reaches_the_edge_of_the_picture(tmp_path: Path, kind: str) -> None:
    built = draw_figure(a_plan(kind), {"made_up": a_study(tmp_path, seeds=6)}, tmp_path / "report")
    assert has_white_edges(built.paths[0])


@pytest.mark.parametrize("kind", ["training", "training_runs", "area", "network"])
def test_an_variant_without_a_finished_run_is_named_with_the_command_that_makes_it(tmp_path: Path, kind: str) -> None:
    study = without(a_study(tmp_path), "exneat")
    with pytest.raises(MissingRunsError, match="no finished run of ExNEAT single") as raised:
        draw_figure(a_plan(kind), {"made_up": study}, tmp_path / "report")
    assert COMMAND in str(raised.value)
    assert not (tmp_path / "report").exists()


@pytest.mark.parametrize("kind", ["robustness", "cluster"])
def test_runs_that_were_never_swept_are_missing_even_where_baselines_were(tmp_path: Path, kind: str) -> None:
    study = a_study(tmp_path, swept=["random"])
    with pytest.raises(MissingRunsError, match="no finished sweep of sensor_noise") as raised:
        draw_figure(a_plan(kind), {"made_up": study}, tmp_path / "report")
    assert COMMAND in str(raised.value)


@pytest.mark.parametrize(
    ("axis", "label"),
    [
        ("generation", "generation"),
        ("episodes", "training episodes"),
        ("env_steps", "environment steps (control steps)"),
    ],
)
def test_training_can_be_drawn_over_each_measure_of_effort(tmp_path: Path, axis: str, label: str) -> None:
    study = a_study(tmp_path)
    axes = empty_axes()
    draw_means(axes, TRAINED, study, axis)
    assert axes.get_xlabel() == label
    built = draw_figure(a_plan("training"), {"made_up": study}, tmp_path / "report", axis)
    assert ("latest value" in built.caption) == (axis != "generation")


def test_an_unknown_axis_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ExneatError, match="axis: expected one of generation, episodes, env_steps, got 'hours'"):
        draw_figure(a_plan("training"), {"made_up": a_study(tmp_path)}, tmp_path, "hours")


def colours(axes: Axes) -> dict[str, str]:
    handles, labels = axes.get_legend_handles_labels()
    found = {}
    for handle, label in zip(handles, labels, strict=True):
        colour = handle.get_color() if hasattr(handle, "get_color") else handle.get_facecolor()[0][:3]
        found[label] = to_hex(colour)
    return {label: colour for label, colour in found.items() if label in VARIANTS.values()}


def test_an_variant_has_one_colour_in_all_figures(tmp_path: Path) -> None:
    study = a_study(tmp_path)
    drawn = [empty_axes() for _ in range(5)]
    draw_means(drawn[0], TRAINED, study, "generation")
    draw_each_run(drawn[1], TRAINED, study, "generation")
    draw_areas(drawn[2], TRAINED, study, "generation")
    draw_levels(drawn[3], SWEPT, study)
    draw_clusters(drawn[4], SWEPT, study)
    for axes in drawn:
        assert {"NEAT", "ExNEAT single"} <= set(colours(axes))
    for label in VARIANTS.values():
        assert len({colours(axes)[label] for axes in drawn if label in colours(axes)}) == 1


def test_the_caption_says_how_many_runs_of_what_budget_there_are(tmp_path: Path) -> None:
    study = a_study(tmp_path, seeds=3)
    caption = draw_figure(a_plan("robustness"), {"made_up": study}, tmp_path / "report").caption
    assert caption.startswith(
        "Made up, robustness. Panel 1, sensor noise 0.05, number of runs: NEAT 3; ExNEAT single 3;"
    )
    assert "Panel 2, 17 tiles" in caption
    assert "Budget: quick. All variants had equal budgets of 8,000 training episodes per run" in caption


def test_the_caption_says_so_when_variants_were_trained_for_longer_than_others(tmp_path: Path) -> None:
    study = a_study(tmp_path)
    for run in study.of("noise", "exneat"):
        run.directory.update_manifest(budget_spent={"episodes": 9000, "env_steps": 1, "wall_seconds": 1.0})
    caption = draw_figure(a_plan("area"), {"made_up": study}, tmp_path / "report").caption
    assert "unequal budgets of training episodes per run (NEAT 8,000; ExNEAT single 9,000)" in caption


@pytest.mark.parametrize(
    ("kind", "seeds", "warns"),
    [("training", 9, True), ("training", 10, False), ("robustness", 9, True), ("robustness", 10, False)],
)
def test_the_caption_calls_intervals_of_fewer_than_ten_runs_too_narrow(
    tmp_path: Path, kind: str, seeds: int, warns: bool
) -> None:
    caption = draw_figure(a_plan(kind), {"made_up": a_study(tmp_path, seeds=seeds)}, tmp_path / "report").caption
    assert ("too narrow" in caption) == warns


def test_the_champion_shown_is_that_of_the_run_best_on_validation(tmp_path: Path) -> None:
    study = a_study(tmp_path, seeds=4)
    manifest = study.of("noise", "neat")[1].directory
    manifest.update_manifest(result={**manifest.read_manifest()["result"], "validation": 99.0})
    caption = draw_figure(a_plan("network"), {"made_up": study}, tmp_path / "report").caption
    assert "NEAT, sensor noise 0.05: seed 1, best on validation of 4 runs" in caption
    assert "ExNEAT single, sensor noise 0.05: seed 3, best on validation of 4 runs" in caption
    assert "test fitness 0.75" in caption


@pytest.mark.parametrize(
    ("kind", "change", "message"),
    [
        ("training", {"experiment": "ant"}, "figure-4.3-training.5: experiment: expected one of made_up, got 'ant'"),
        ("training", {"condition": "mud"}, "condition of made_up: expected one of noise, long, got 'mud'"),
        ("robustness", {"sweep": "rain"}, "sweep of made_up: expected one of sensor_noise, gap, got 'rain'"),
        ("robustness", {"value": "full_reward"}, "the task of made_up has no full reward"),
        ("network", {"variant": "random"}, "trained variant of made_up: expected one of neat, exneat, got 'random'"),
    ],
)
def test_a_panel_that_names_what_is_not_there_is_refused_with_what_is(
    tmp_path: Path, kind: str, change: dict[str, str], message: str
) -> None:
    plan = a_plan(kind)
    plan = replace(plan, panels=(replace(plan.panels[0], **change),))
    with pytest.raises(ExneatError, match=message):
        draw_figure(plan, {"made_up": a_study(tmp_path)}, tmp_path / "report")


def test_an_experiment_of_baselines_alone_has_nothing_to_show(tmp_path: Path) -> None:
    study = a_study(tmp_path, variants={"random": "random actions"})
    with pytest.raises(MissingRunsError, match="no variant of made_up is trained"):
        draw_figure(a_plan("training"), {"made_up": study}, tmp_path / "report")


def test_a_figure_with_variants_of_its_own_shows_and_needs_no_others(tmp_path: Path) -> None:
    study = a_study(
        tmp_path / "runs", variants={"neat": "NEAT", "exneat": "ExNEAT", "fb": "front and back"}, baselines=()
    )
    plan = replace(a_plan("training"), variants=("neat", "fb"))
    caption = draw_figure(plan, {"made_up": without(study, "exneat")}, tmp_path).caption
    assert "front and back 3" in caption
    assert "ExNEAT" not in caption
    with pytest.raises(ExneatError, match="trained variant of made_up: expected one of neat, exneat, fb, got 'all'"):
        draw_figure(replace(plan, variants=("all",)), {"made_up": study}, tmp_path)
