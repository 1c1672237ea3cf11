"""Figures of a run: there, and the same bytes each time."""

from __future__ import annotations

from pathlib import Path

from exneat_cli.analysis import draw_path, draw_training
from exneat_cli.records import HistoryRow, RunDirectory, write_csv, write_history


def a_run(directory: Path) -> RunDirectory:
    run = RunDirectory(directory)
    directory.mkdir(parents=True)
    rows = [HistoryRow(g, 10.0 * g, 2.0 * g, 1.5 * g, 10.0 * g, g, g, 1, 96, 4, 0, 0, 0.1 * g) for g in range(1, 9)]
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
    write_history(run.history, [HistoryRow(1, 2.0, 1.0, 1.5, 2.0, 10, 500, 1, 96, 4, 0, 0, 0.1)])
    assert draw_training(run, "fitness")
