"""Figures of the report: what axes show of runs, what figures refuse, what they say, and that they repeat."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import matplotlib.image
import msgspec
import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from msgspec.structs import replace as changed

from exneat_cli.analysis.catalogue import FIGURE_KINDS, FigurePlan, Panel
from exneat_cli.analysis.report_figures import draw_figure
from exneat_cli.analysis.report_panels import common_curves, draw_panel
from exneat_cli.analysis.study import MissingRunsError, Study
from exneat_cli.analysis.styles import Paper, read_style_sheet, variant_styles
from exneat_cli.errors import ExneatError
from tests.analysis.fake_studies import (
    LEVELS,
    SWEEPS,
    a_study,
    contents,
    finish_all,
    has_white_edges,
    plan_study,
    texts_of,
)

TRAINED, SWEPT = Panel("track", "calm"), Panel("track", "calm", sweep="sensor_noise")
PANELS = {
    "training": (TRAINED, Panel("track", "noisy")),
    "training_runs": (TRAINED,),
    "robustness": (SWEPT, Panel("track", "noisy", sweep="gap")),
    "cluster": (SWEPT,),
    "area": (TRAINED,),
    "network": (Panel("track", "calm", variant="neat"), Panel("track", "calm", variant="exneat")),
}


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Study:
    """All runs finished, with all levels; no test changes their files."""
    return a_study(tmp_path_factory.mktemp("study"))


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
        assert [path.name for path in built.paths] == [f"figure-4.3-{kind}.5.{of}" for of in ("png", "svg", "pdf")]
        assert has_white_edges(built.paths[0])
    assert contents(tmp_path / "a" / "report") == contents(tmp_path / "b" / "report")


@pytest.mark.parametrize("kind", ["training", "training_runs", "area", "network"])
def test_a_variant_without_a_finished_run_is_named_with_the_command_that_makes_it(
    study: Study, tmp_path: Path, kind: str
) -> None:
    with pytest.raises(MissingRunsError, match=r"no finished run of ExNEAT\n  exneat sweep experiment=track"):
        caption(a_plan(kind), without(study, "exneat"), tmp_path)
    assert not (tmp_path / "report").exists()


@pytest.mark.parametrize("kind", ["robustness", "cluster"])
def test_runs_that_were_never_swept_are_missing_even_where_baselines_were(tmp_path: Path, kind: str) -> None:
    study = a_study(tmp_path)
    for run in (*study.of("calm", "neat"), *study.of("calm", "exneat")):
        run.directory.robustness.unlink()
    with pytest.raises(MissingRunsError, match=r"no finished sweep of sensor_noise\n  exneat sweep experiment=track"):
        caption(a_plan(kind), study, tmp_path)


def test_training_can_be_drawn_over_each_measure_of_effort(study: Study, tmp_path: Path) -> None:
    labels = {"generation": "generation", "episodes": "training episodes", "env_steps": "environment steps (control"}
    for axis, label in labels.items():
        said = caption(a_plan("training"), study, tmp_path, axis)
        assert ("latest value" in said) == (axis != "generation")
        drawn = texts_of(tmp_path / "report" / "figure-4.3-training.5.svg")
        assert any(text.startswith(label) for text in drawn)
    with pytest.raises(ExneatError, match="axis: expected one of generation, episodes, env_steps, got 'hours'"):
        caption(a_plan("training"), study, tmp_path, "hours")


def test_the_caption_says_how_many_runs_of_what_budget_there_are(study: Study, tmp_path: Path) -> None:
    said = caption(a_plan("robustness"), study, tmp_path)
    assert said.startswith("Made up, robustness. Panel 1, no noise, number of runs: NEAT 3; ExNEAT 3; random actions 1")
    assert "Panel 2, much noise" in said
    assert "Intervals are too narrow below 10 runs" in said
    assert "Budget: quick. All variants had equal budgets of 400 training episodes per run" in said
    assert "too narrow" not in caption(a_plan("area"), study, tmp_path), "it has no intervals"


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
    study: Study, tmp_path: Path, kind: str, change: dict[str, str], message: str
) -> None:
    plan = a_plan(kind)
    with pytest.raises(ExneatError, match=message):
        caption(changed(plan, panels=(changed(plan.panels[0], **change),)), study, tmp_path)


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


def drawn(study: Study, kind: str, panel: Panel = SWEPT, axis: str = "generation") -> tuple[Axes, dict[str, int]]:
    axes = Figure().add_subplot()
    return axes, draw_panel(kind, axes, panel, study, variant_styles(study.variants, study.baselines), axis)


def test_a_variant_that_the_experiment_does_not_sweep_is_left_out(tmp_path: Path) -> None:
    study = a_study(tmp_path)
    for run in study.of("calm", "neat"):
        run.directory.robustness.unlink()
    for kind in ("robustness", "cluster"):
        assert drawn(study, kind)[1] == {"exneat": 3, "random": 1}


def test_means_and_bands_are_those_of_the_runs(study: Study) -> None:
    axes, _ = drawn(study, "training")
    history = study.history("calm")
    best = history[history["variant"] == "exneat"].pivot(index="generation", columns="seed", values="best_so_far")
    np.testing.assert_allclose(axes.get_lines()[1].get_ydata(), best.mean(axis=1))
    band = axes.collections[1].get_paths()[0].vertices
    for generation, runs in best.iterrows():
        low, *_, high = sorted(set(band[band[:, 0] == generation][:, 1]))
        assert runs.min() - 1e-9 <= low < runs.mean() < high <= runs.max() + 1e-9


@pytest.mark.parametrize("kind", ["training", "robustness"])
def test_a_single_run_has_a_line_and_no_band(tmp_path: Path, kind: str) -> None:
    axes, _ = drawn(a_study(tmp_path, seeds=1), kind)
    assert len(axes.get_lines()) >= 2
    assert not axes.collections


def test_every_run_is_drawn_beside_the_mean(tmp_path: Path) -> None:
    axes, counts = drawn(a_study(tmp_path, seeds=4), "training_runs")
    assert counts == {"neat": 4, "exneat": 4}
    assert sum(line.get_linewidth() < 1.0 for line in axes.get_lines()) == 8
    assert sum(line.get_linewidth() > 2.0 for line in axes.get_lines()) == 2


def test_between_generations_a_run_keeps_its_latest_value_and_none_is_continued_past_its_end() -> None:
    history = pd.DataFrame(
        {
            "seed": [0, 0, 0, 1, 1, 1],
            "generation": [1, 2, 3, 1, 2, 3],
            "env_steps": [10, 20, 30, 15, 25, 60],
            "best_so_far": [1.0, 2.0, 3.0, 10.0, 20.0, 30.0],
        }
    )
    steps, generations = (
        common_curves(history.pivot_table(index=axis, columns="seed", values="best_so_far"))
        for axis in ("env_steps", "generation")
    )
    assert steps.index.tolist() == [15, 20, 25, 30]
    assert steps.T.to_numpy().tolist() == [[1.0, 2.0, 2.0, 3.0], [10.0, 10.0, 20.0, 20.0]]
    assert generations.index.tolist() == [1, 2, 3]


@pytest.mark.parametrize("seeds", [5, 7])
def test_the_dashed_line_is_the_mean_of_the_five_runs_best_on_validation_unless_these_are_all(
    tmp_path: Path, seeds: int
) -> None:
    axes, _ = drawn(a_study(tmp_path, seeds=seeds), "robustness")
    dashed = [line for line in axes.get_lines() if line.get_linestyle() == "--" and len(line.get_ydata())]
    fading = 1.0 - np.array(LEVELS)
    np.testing.assert_allclose(axes.get_lines()[0].get_ydata(), fading * (0.3 + 0.013 * np.mean(range(seeds))))
    assert len(dashed) == (2 if seeds > 5 else 0)
    for line in dashed[:1]:
        np.testing.assert_allclose(line.get_ydata(), fading * (0.3 + 0.013 * np.mean([2, 3, 4, 5, 6])))


def marks_of_training(study: Study, kind: str) -> list[float]:
    lines = [line for line in drawn(study, kind)[0].get_lines() if line.get_label() == "as in training"]
    return [float(x) for line in lines for x in set(line.get_xdata())]


def test_the_level_of_training_is_marked(study: Study) -> None:
    # In clusters levels stand at whole numbers, whatever is between them.
    for kind, marks in {"robustness": {0.1: [0.1], 9.0: [9.0]}, "cluster": {0.1: [1.0], 0.05: [0.5], 9.0: []}}.items():
        assert marks_of_training(study, kind) == []
        for level, expected in marks.items():
            trained = {key: {"sensor_noise": level, "gap": 0.2} for key in study.conditions}
            assert marks_of_training(replace(study, trained=trained), kind) == expected


def test_a_panel_can_ask_for_full_reward_and_leave_out_high_levels(study: Study) -> None:
    study = replace(study, has_full_reward=True, fitness_name="forward reward")
    panels = [changed(SWEPT, value=value, highest=0.3) for value in ("fitness", "full_reward")]
    fitness, full = (drawn(study, "robustness", panel)[0] for panel in panels)
    assert list(fitness.get_lines()[0].get_xdata()) == [0.0, 0.1, 0.2, 0.3]
    assert (fitness.get_ylabel(), full.get_ylabel()) == ("forward reward", "full reward")
    assert fitness.get_xlabel() == SWEEPS["sensor_noise"]
    one, other = (np.asarray(axes.get_lines()[0].get_ydata()) for axes in (fitness, full))
    np.testing.assert_allclose(other, 2 * one)


def test_in_a_cluster_every_run_has_a_point_at_every_level_and_variants_do_not_mix(tmp_path: Path) -> None:
    axes, _ = drawn(a_study(tmp_path, seeds=4), "cluster")
    neat, exneat = [each for each in axes.collections if len(each.get_offsets()) == 4 * len(LEVELS)]
    for level in range(len(LEVELS)):
        left, right = (np.asarray(each.get_offsets())[4 * level : 4 * level + 4, 0] for each in (neat, exneat))
        assert level - 0.5 < left.min() < left.max() < right.min() < right.max() < level + 0.5
    assert [tick.get_text() for tick in axes.get_xticklabels()] == [f"{level:g}" for level in LEVELS]


def test_the_area_of_a_run_is_the_mean_of_its_best_so_far(study: Study) -> None:
    axes, counts = drawn(study, "area")
    assert counts == {"neat": 3, "exneat": 3}
    np.testing.assert_allclose(
        np.asarray(axes.collections[0].get_offsets())[:, 1], 0.75 * np.array([0.3, 0.313, 0.326])
    )


def test_a_variant_has_one_colour_in_all_panels_whoever_stands_beside_it(study: Study) -> None:
    found = set()
    for kind in FIGURE_KINDS[:-1]:
        for each in (study, replace(study, variants={"exneat": "ExNEAT", "random": "random actions"})):
            axes, _ = drawn(each, kind)
            entries = {label[1:]: handle for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)}
            handles = entries["ExNEAT"]  # after a mark that keeps labels in legends
            colour = handles.get_color() if hasattr(handles, "get_color") else handles.get_facecolor()[0][:3]
            found.add(to_hex(colour))
    assert len(found) == 1


@pytest.mark.parametrize("kind", ["training", "robustness", "cluster", "area"])
def test_labels_of_users_are_shown_as_they_are(study: Study, tmp_path: Path, kind: str) -> None:
    labels = {"neat": "_NEAT", "exneat": r"$\foo$ $$ 5%", "random": "__$"}
    draw_figure(a_plan(kind), {"track": replace(study, variants=labels)}, tmp_path / "report")
    drawn = texts_of(tmp_path / "report" / f"figure-4.3-{kind}.5.svg")
    for variant, label in labels.items():
        assert (label in drawn) == (variant != "random" or kind in ("robustness", "cluster"))


@pytest.mark.parametrize(("columns", "width"), [(1, 3.5), (2, 7.16)])
def test_a_figure_for_paper_is_as_wide_as_its_columns_has_no_title_and_nothing_is_cut_off(
    tmp_path: Path, columns: int, width: float
) -> None:
    study = {"track": a_study(tmp_path, seeds=6)}
    for kind in ("training", "robustness", "cluster"):
        picture, drawing, _ = draw_figure(a_plan(kind), study, tmp_path / "report", paper=Paper(columns)).paths
        assert has_white_edges(picture)
        assert f"Made up, {kind}" not in texts_of(drawing)
        size = re.search(r'width="([\d.]+)pt"', drawing.read_text())
        assert size is not None
        assert float(size[1]) == pytest.approx(72 * width)


def test_what_a_style_sheet_says_counts_more(study: Study, tmp_path: Path) -> None:
    sheet = tmp_path / "mine.mplstyle"
    cycle = "axes.prop_cycle: cycler('color', ['123456', '234567'])"
    sheet.write_text(f"font.size: 13  # large\naxes.titlesize: medium\n\n# a comment\naxes.grid: False\n{cycle}\n")
    paper = Paper(2, read_style_sheet(sheet))
    drawing = draw_figure(a_plan("training"), {"track": study}, tmp_path / "report", paper=paper).paths[1]
    assert "font-size: 13px" in drawing.read_text()
    assert "stroke: #123456" in drawing.read_text()
    assert "stroke: #234567" in drawing.read_text()


def test_values_of_curves_are_shown_where_they_are_on_the_picture(tmp_path: Path) -> None:
    study = a_study(tmp_path, conditions={"calm": "calm"})
    plan = FigurePlan("mine", "robustness", "Made up", (SWEPT, SWEPT))
    built = draw_figure(plan, {"track": study}, tmp_path / "report")
    one, other = built.strips[: len(LEVELS)], built.strips[len(LEVELS) :]
    assert [strip.text for strip in one] == [strip.text for strip in other]
    means = (
        study.robustness("calm").query("parameter == @SWEPT.sweep").groupby(["level", "variant"])["fitness_mean"].mean()
    )
    for level, strip in zip(LEVELS, one, strict=True):
        values = [f"{label}: {means[level, name]:.4g}" for name, label in study.variants.items()]
        assert strip.text.splitlines() == [f"{study.sweeps[str(SWEPT.sweep)]} {level:g}", *values]
    picture = matplotlib.image.imread(built.paths[0])[..., :3].mean(axis=2)
    height, width = picture.shape
    for first, last in ((one[0], one[-1]), (other[0], other[-1])):  # from the axis on the left, down to that below
        column, row = round(first.left / 100 * width), round((first.top + first.height) / 100 * height)
        assert picture[row // 2 : row - 8, column - 2 : column + 3].min(axis=1).max() < 0.3
        assert (
            picture[row - 2 : row + 3, column + 8 : round((last.left + last.width) / 100 * width)].min(axis=0).max()
            < 0.3
        )


def test_curves_have_no_values_where_a_style_sheet_cuts_the_margins_off(study: Study, tmp_path: Path) -> None:
    paper = Paper(sheet={"savefig.bbox": "tight"})
    assert not draw_figure(a_plan("training"), {"track": study}, tmp_path / "report", paper=paper).strips
