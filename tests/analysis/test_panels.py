"""What axes of the report show of runs: their means, their spread, and each of them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from msgspec.structs import replace as changed

from exneat_cli.analysis.catalogue import Panel
from exneat_cli.analysis.panels import common_curves, draw_panel
from exneat_cli.analysis.study import Study
from tests.analysis.fake_studies import LEVELS, SWEEPS, a_study

SWEPT = Panel("track", "calm", sweep="sensor_noise")
KINDS = ("training", "training_runs", "area", "robustness", "cluster")


def drawn(study: Study, kind: str, panel: Panel = SWEPT, axis: str = "generation") -> tuple[Axes, dict[str, int]]:
    axes = Figure().add_subplot()
    return axes, draw_panel(kind, axes, panel, study, axis)


def test_a_variant_that_the_experiment_does_not_sweep_is_left_out(tmp_path: Path) -> None:
    study = a_study(tmp_path)
    for run in study.of("calm", "neat"):
        run.directory.robustness.unlink()
    for kind in ("robustness", "cluster"):
        assert drawn(study, kind)[1] == {"exneat": 3, "random": 1}


def test_means_and_bands_are_those_of_the_runs(tmp_path: Path) -> None:
    study = a_study(tmp_path)
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
    curves = common_curves(history, "env_steps")
    assert curves.index.tolist() == [15, 20, 25, 30]
    assert curves.T.to_numpy().tolist() == [[1.0, 2.0, 2.0, 3.0], [10.0, 10.0, 20.0, 20.0]]
    assert common_curves(history, "generation").index.tolist() == [1, 2, 3]


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


def test_a_panel_can_ask_for_full_reward_and_leave_out_high_levels(tmp_path: Path) -> None:
    study = a_study(tmp_path, has_full_reward=True)
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


def test_the_area_of_a_run_is_the_mean_of_its_best_so_far(tmp_path: Path) -> None:
    axes, counts = drawn(a_study(tmp_path), "area")
    assert counts == {"neat": 3, "exneat": 3}
    np.testing.assert_allclose(
        np.asarray(axes.collections[0].get_offsets())[:, 1], 0.75 * np.array([0.3, 0.313, 0.326])
    )


def test_a_variant_has_one_colour_in_all_panels_whoever_stands_beside_it(tmp_path: Path) -> None:
    study = a_study(tmp_path)
    found = set()
    for kind in KINDS:
        for each in (study, replace(study, variants={"exneat": "ExNEAT", "random": "random actions"})):
            axes, _ = drawn(each, kind)
            handles = dict(zip(*reversed(axes.get_legend_handles_labels()), strict=True))["ExNEAT"]
            colour = handles.get_color() if hasattr(handles, "get_color") else handles.get_facecolor()[0][:3]
            found.add(to_hex(colour))
    assert len(found) == 1
