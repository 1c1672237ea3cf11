"""Figures of a run: there, and the same bytes each time."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import pytest

from exneat_cli.analysis import draw_path, draw_robustness, draw_training
from exneat_cli.records import UNPERTURBED, RobustnessRow, RunDirectory, merge_robustness, write_csv, write_history
from tests.analysis.fake_studies import contents, has_white_edges, history_row, texts_of


def labels(count: int) -> dict[str, str]:
    return {f"sweep_{k}": f"label {k}" for k in range(count)}


def a_run(directory: Path, sweeps: int = 1, generations: int = 8, place: str = "ground") -> RunDirectory:
    run = RunDirectory(directory)
    directory.mkdir(parents=True)
    numbers = range(1, generations + 1)
    rows = [history_row(g, 10.0 * g, 2.0 * g, 1.5 * g, 10.0 * g, g, g, 1, 96, 4, 0, 0, 0.1 * g) for g in numbers]
    write_history(run.history, rows)
    swept = [(sweep, level) for sweep in labels(sweeps) for level in (0.0, 0.5, 1.0)]
    figures = [(place, 0.8 - 0.2 * place[1]) for place in [(UNPERTURBED, 0.0), *swept]]
    merge_robustness(run.robustness, [RobustnessRow("exneat", 0, *at, 20, f, 0.1, f, 0.1) for at, f in figures])
    if place == "tiles":
        columns = ["row", "column", "path", "channel_1", "channel_2"]
        write_csv(run.tiles, columns, [(r, c, int(r != c), 0.1 * r, 0.1 * c) for r in range(4) for c in range(5)])
        columns = ["step", "row", "column", "goal_row", "goal_column", "prey_1_row", "prey_1_column", "prey_1_free"]
        write_csv(run.trace, columns, [(t, t % 4, t // 2, 3, 4, 2, t % 3, int(t < 4)) for t in range(8)])
    else:
        columns = ["step", "x", "y"] if place == "ground" else ["step", "speed", "cost"]
        write_csv(run.trace, columns, [(t, 0.1 * t, 0.01 * t * t) for t in range(50)])
    return run


def draw_all(run: RunDirectory) -> list[Path]:
    return [*draw_training(run, "forward reward"), *draw_path(run), *draw_robustness(run, labels(4), "forward reward")]


@pytest.mark.parametrize("place", ["ground", "tiles", "nowhere"])
def test_the_same_data_gives_the_same_bytes_whatever_a_user_set_and_nothing_is_cut_off(
    tmp_path: Path, place: str
) -> None:
    one, other = (a_run(tmp_path / copy / "run", sweeps=4, place=place) for copy in ("a", "b"))
    written = draw_all(one)
    assert [path.stem for path in written] == ["training"] * 2 + ["path"] * 2 + ["robustness"] * 2
    assert all(has_white_edges(path) for path in written if path.suffix == ".png")
    assert "training fitness (forward reward)" in texts_of(one.plots / "training.svg")
    with mpl.rc_context({"text.usetex": True, "font.family": "cursive", "font.size": 30.0, "axes.grid": True}):
        draw_all(other)
    assert contents(one.plots) == contents(other.plots)


def test_a_run_of_a_single_generation_can_be_drawn(tmp_path: Path) -> None:
    assert draw_training(a_run(tmp_path / "run", generations=1), "fitness")


@pytest.mark.parametrize("count", [1, 2, 5])
def test_robustness_has_a_panel_for_each_sweep_and_none_for_the_unperturbed_row(tmp_path: Path, count: int) -> None:
    picture, drawing = draw_robustness(a_run(tmp_path / "run", sweeps=count), labels(count), "forward reward")
    assert has_white_edges(picture)
    texts = texts_of(drawing)
    assert [label for label in labels(9).values() if label in texts] == list(labels(count).values())
    assert texts.count("forward reward") == count
    assert "none" not in texts


def test_without_labels_sweeps_are_called_by_their_names(tmp_path: Path) -> None:
    assert "sweep_0" in texts_of(draw_robustness(a_run(tmp_path / "run"), {}, "fitness")[1])


def test_a_run_that_was_never_swept_has_no_picture_of_robustness(tmp_path: Path) -> None:
    run = a_run(tmp_path / "run", sweeps=0)
    assert draw_robustness(run, {}, "fitness") == []
    assert not run.plots.exists()


def test_of_a_level_that_was_tested_twice_the_longer_test_is_shown(tmp_path: Path) -> None:
    once, twice = (a_run(tmp_path / place / "run") for place in ("a", "b"))
    merge_robustness(twice.robustness, [RobustnessRow("exneat", 0, "sweep_0", 0.5, 2, 9.0, 0.1, 9.0, 0.1)])
    for run in (once, twice):
        draw_robustness(run, {}, "fitness")
    assert contents(once.plots) == contents(twice.plots)


def test_figures_say_what_their_marks_mean_and_what_the_run_is(tmp_path: Path) -> None:
    run = a_run(tmp_path / "hunting" / "exneat-all-none-s3-0a1b2c", place="tiles")
    training, path = draw_training(run, "fitness")[1], draw_path(run)[1]
    robustness = draw_robustness(run, labels(1), "fitness", {"sweep_0": 0.5})[1]
    for figure in (training, path, robustness):
        assert any("hunting, exneat-all-none, seed 3" in text for text in texts_of(figure))
        assert not any("0a1b2c" in text for text in texts_of(figure))
    assert "training fitness" in texts_of(training)
    assert {"prey", "prey, caught here", "goal", "agent", "start", "end"} <= set(texts_of(path))
    assert texts_of(path).count("cue at the end") == 1
    assert "as in training" in texts_of(robustness)
    assert "as in training" not in texts_of(draw_robustness(run, labels(1), "fitness")[1])
