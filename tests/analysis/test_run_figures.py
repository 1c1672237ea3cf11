"""Figures of a run: there, and the same bytes each time."""

from __future__ import annotations

from pathlib import Path

import pytest
from exneat_cli.analysis.figures import tick_levels
from matplotlib.figure import Figure

from exneat_cli.analysis import draw_path, draw_robustness, draw_training
from exneat_cli.records import RunDirectory, merge_robustness, read_robustness, write_csv, write_history
from tests.analysis.fake_studies import history_row
from tests.analysis.figure_studies import has_white_edges, write_robustness


def a_run(directory: Path) -> RunDirectory:
    run = RunDirectory(directory)
    directory.mkdir(parents=True)
    rows = [history_row(g, 10.0 * g, 2.0 * g, 1.5 * g, 10.0 * g, g, g, 1, 96, 4, 0, 0, 0.1 * g) for g in range(1, 9)]
    write_history(run.history, rows)
    write_csv(
        run.trace, ["step", "x", "y", "z", "forward_reward"], [(t, 0.1 * t, 0.01 * t * t, 0.5, 2.0) for t in range(50)]
    )
    return run


def test_each_figure_is_written_as_png_and_svg(tmp_path: Path) -> None:
    run = a_run(tmp_path / "run")
    written = draw_training(run, "forward reward") + draw_path(run)
    assert sorted(path.name for path in written) == ["path.png", "path.svg", "training.png", "training.svg"]
    assert (run.plots / "training.png").read_bytes().startswith(b"\x89PNG")
    assert "training fitness (forward reward)" in (run.plots / "training.svg").read_text()


def test_the_same_data_gives_the_same_bytes(tmp_path: Path) -> None:
    one, other = a_run(tmp_path / "a" / "run"), a_run(tmp_path / "b" / "run")
    for run in (one, other):
        draw_training(run, "forward reward")
        draw_path(run)
    for path in one.plots.iterdir():
        assert path.read_bytes() == (other.plots / path.name).read_bytes(), path.name


def test_a_run_of_a_single_generation_can_be_drawn(tmp_path: Path) -> None:
    run = a_run(tmp_path / "run")
    write_history(run.history, [history_row(1, 2.0, 1.0, 1.5, 2.0, 10, 500, 1, 96, 4, 0, 0, 0.1)])
    assert draw_training(run, "fitness")


def sweeps(count: int) -> dict[str, str]:
    return {f"sweep_{k}": f"label {k}" for k in range(count)}


@pytest.mark.parametrize("count", [1, 2, 3, 5])
def test_robustness_has_a_panel_for_each_sweep_and_none_for_the_unperturbed_row(tmp_path: Path, count: int) -> None:
    run = a_run(tmp_path / "run")
    write_robustness(run, "exneat", 0, 0.8, sweeps(count))
    written = draw_robustness(run, sweeps(count), "forward reward")
    assert [path.name for path in written] == ["robustness.png", "robustness.svg"]
    assert has_white_edges(written[0])
    text = written[1].read_text()
    assert [label for label in sweeps(9).values() if f"<!-- {label} -->" in text] == list(sweeps(count).values())
    assert text.count("<!-- forward reward -->") == count
    assert "<!-- none -->" not in text


def test_a_sweep_without_a_label_is_called_by_its_name(tmp_path: Path) -> None:
    run = a_run(tmp_path / "run")
    write_robustness(run, "exneat", 0, 0.8, sweeps(1))
    assert "<!-- sweep_0 -->" in draw_robustness(run, {}, "fitness")[1].read_text()


def test_a_run_that_was_never_swept_has_no_picture_of_robustness(tmp_path: Path) -> None:
    run = a_run(tmp_path / "run")
    write_robustness(run, "random", 0, 0.8, {})
    assert draw_robustness(run, {}, "fitness") == []
    assert not run.plots.exists()


def test_equal_robustness_gives_equal_bytes(tmp_path: Path) -> None:
    one, other = a_run(tmp_path / "a" / "run"), a_run(tmp_path / "b" / "run")
    for run in (one, other):
        write_robustness(run, "exneat", 0, 0.8, sweeps(4))
    for first, second in zip(*(draw_robustness(run, {}, "fitness") for run in (one, other)), strict=True):
        assert first.read_bytes() == second.read_bytes()


def test_of_a_level_that_was_tested_twice_the_longer_test_is_shown(tmp_path: Path) -> None:
    once, twice = a_run(tmp_path / "a" / "run"), a_run(tmp_path / "b" / "run")
    for run in (once, twice):
        write_robustness(run, "exneat", 0, 0.8, sweeps(1))
    hasty = [row._replace(episodes=2, fitness_mean=9.0) for row in read_robustness(twice.robustness)]
    merge_robustness(twice.robustness, hasty)
    for first, second in zip(*(draw_robustness(run, {}, "fitness") for run in (once, twice)), strict=True):
        assert first.read_bytes() == second.read_bytes()


def test_an_axis_of_whole_levels_has_no_ticks_between_them() -> None:
    tiles, shares = Figure().subplots(1, 2)
    for axes, levels in ((tiles, [2.0, 3.0, 4.0]), (shares, [0.0, 0.5, 1.0])):
        axes.plot(levels, levels)
        tick_levels(axes, levels)
    assert all(tick.is_integer() for tick in tiles.get_xticks())
    assert not all(tick.is_integer() for tick in shares.get_xticks())
