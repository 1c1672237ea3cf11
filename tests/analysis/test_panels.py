"""What axes of the report show of runs: their means, their spread, and each of them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from exneat_cli.analysis.catalogue import Panel
from exneat_cli.analysis.robustness_panels import draw_clusters, draw_levels
from exneat_cli.analysis.training_panels import common_curves, draw_areas, draw_each_run, draw_means
from tests.analysis.figure_studies import LEVELS, SWEEPS, a_study

SWEPT = Panel("made_up", "noise", sweep="sensor_noise")
TRAINED = Panel("made_up", "noise")


def empty_axes() -> Axes:
    return Figure().add_subplot()


def test_an_unfinished_run_does_not_count(tmp_path: Path) -> None:
    study = a_study(tmp_path, seeds=2)
    study.runs[0].directory.update_manifest(status="interrupted")
    assert draw_means(empty_axes(), TRAINED, study, "generation") == {"neat": 1, "exneat": 2}


def test_an_variant_that_the_experiment_does_not_sweep_is_left_out(tmp_path: Path) -> None:
    study = a_study(tmp_path, swept=["exneat", "random"])
    assert draw_levels(empty_axes(), SWEPT, study) == {"exneat": 3, "random": 1}
    assert draw_clusters(empty_axes(), SWEPT, study) == {"exneat": 3, "random": 1}


def test_means_and_bands_are_those_of_the_runs(tmp_path: Path) -> None:
    study = a_study(tmp_path)
    axes = empty_axes()
    draw_means(axes, TRAINED, study, "generation")
    best = study.history("noise", "exneat").pivot_table(index="generation", columns="seed", values="best_so_far")
    line = axes.get_lines()[1]
    np.testing.assert_allclose(line.get_ydata(), best.mean(axis=1))
    band = axes.collections[1].get_paths()[0].vertices
    for generation, runs in best.iterrows():
        low, *_, high = sorted(set(band[band[:, 0] == generation][:, 1]))
        assert runs.min() - 1e-9 <= low < runs.mean() < high <= runs.max() + 1e-9


def test_a_single_run_has_a_line_and_no_band(tmp_path: Path) -> None:
    study = a_study(tmp_path, seeds=1)
    for draw in (
        lambda axes: draw_means(axes, TRAINED, study, "generation"),
        lambda axes: draw_levels(axes, SWEPT, study),
    ):
        axes = empty_axes()
        draw(axes)
        assert len(axes.get_lines()) >= 2
        assert not axes.collections


def test_every_run_is_drawn_beside_the_mean(tmp_path: Path) -> None:
    axes = empty_axes()
    counts = draw_each_run(axes, TRAINED, a_study(tmp_path, seeds=4), "generation")
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
    curves = common_curves(history, "env_steps")
    assert curves.x.tolist() == [15, 20, 25, 30]
    assert curves.values.tolist() == [[1.0, 2.0, 2.0, 3.0], [10.0, 10.0, 20.0, 20.0]]
    assert common_curves(history, "generation").x.tolist() == [1, 2, 3]


def dashed(axes: Axes) -> list[np.ndarray]:
    lines = [line for line in axes.get_lines() if line.get_linestyle() == "--"]
    return [np.asarray(line.get_ydata()) for line in lines if len(line.get_ydata())]


def test_the_dashed_line_is_the_mean_of_the_five_runs_best_on_validation(tmp_path: Path) -> None:
    axes = empty_axes()
    draw_levels(axes, SWEPT, a_study(tmp_path, seeds=7))
    height = 0.4
    fading = height * (1.0 - np.array(LEVELS))
    np.testing.assert_allclose(axes.get_lines()[0].get_ydata(), fading + 0.01 * height * np.mean(range(7)))
    np.testing.assert_allclose(dashed(axes)[0], fading + 0.01 * height * np.mean([2, 3, 4, 5, 6]))
    assert len(dashed(axes)) == 2


def test_there_is_no_dashed_line_where_five_runs_are_all_of_them(tmp_path: Path) -> None:
    axes = empty_axes()
    draw_levels(axes, SWEPT, a_study(tmp_path, seeds=5))
    assert not dashed(axes)


def test_levels_beyond_the_highest_are_left_out(tmp_path: Path) -> None:
    axes = empty_axes()
    draw_levels(axes, replace(SWEPT, highest=0.3), a_study(tmp_path))
    assert axes.get_lines()[0].get_xdata().tolist() == [0.0, 0.1, 0.2, 0.3]


def test_full_reward_is_drawn_and_named_where_the_panel_asks_for_it(tmp_path: Path) -> None:
    study = a_study(tmp_path, scale=1000.0)
    fitness, full = empty_axes(), empty_axes()
    draw_levels(fitness, SWEPT, study)
    draw_levels(full, replace(SWEPT, value="full_reward"), study)
    assert (fitness.get_ylabel(), full.get_ylabel()) == ("forward reward", "full reward")
    assert fitness.get_xlabel() == SWEEPS["sensor_noise"]
    one, other = (np.asarray(axes.get_lines()[0].get_ydata()) for axes in (fitness, full))
    np.testing.assert_allclose(other, 2 * one)


def test_in_a_cluster_every_run_has_a_point_at_every_level_and_variants_do_not_mix(tmp_path: Path) -> None:
    axes = empty_axes()
    draw_clusters(axes, SWEPT, a_study(tmp_path, seeds=4))
    neat, exneat = [each for each in axes.collections if len(each.get_offsets()) == 4 * len(LEVELS)]
    for level in range(len(LEVELS)):
        left, right = (np.asarray(each.get_offsets())[4 * level : 4 * level + 4, 0] for each in (neat, exneat))
        assert level - 0.5 < left.min() < left.max() < right.min() < right.max() < level + 0.5
    assert [tick.get_text() for tick in axes.get_xticklabels()] == [f"{level:g}" for level in LEVELS]


def test_the_area_of_a_run_is_the_mean_of_its_best_so_far(tmp_path: Path) -> None:
    study = a_study(tmp_path)
    axes = empty_axes()
    assert draw_areas(axes, TRAINED, study, "generation") == {"neat": 3, "exneat": 3}
    expected = [pd.read_csv(run.directory.history)["best_so_far"].mean() for run in study.of("noise", "neat")]
    np.testing.assert_allclose(np.asarray(axes.collections[0].get_offsets())[:, 1], expected)
