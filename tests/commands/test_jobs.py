"""One run as the commands do it: which figures are drawn, and when."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from exneat_cli.commands.jobs import Job
from exneat_cli.errors import ExneatError
from exneat_cli.records import RunDirectory
from exneat_cli.rollouts import Sweep
from exneat_cli.runs import RunSettings

JOB = Job("swept", RunSettings(), (Sweep("reset_noise", "noise.reset_scale", (0.1,), "reset noise"),), episodes=1)
NAMES = ["training", "path", "network", "robustness"]


@pytest.fixture
def drawn(tmp_path: Path) -> RunDirectory:
    """A directory with all data and all figures, as far as their names and times go."""
    directory = RunDirectory(tmp_path)
    directory.plots.mkdir()
    data = (directory.history, directory.trace, directory.champion, directory.robustness)
    for path in data:
        path.touch()
        os.utime(path, (1000, 1000))
    for name in NAMES:
        (directory.plots / f"{name}.svg").touch()
    return directory


def test_what_is_drawn_already_is_not_missing(drawn: RunDirectory) -> None:
    assert JOB.missing_figures(drawn) == []


@pytest.mark.parametrize("name", NAMES)
def test_a_figure_that_is_not_there_is_missing(drawn: RunDirectory, name: str) -> None:
    (drawn.plots / f"{name}.svg").unlink()
    assert JOB.missing_figures(drawn) == [name]


def test_a_figure_of_robustness_that_is_older_than_its_data_is_missing(drawn: RunDirectory) -> None:
    os.utime(drawn.plots / "robustness.svg", (999, 999))
    assert JOB.missing_figures(drawn) == ["robustness"]


def test_a_figure_without_data_is_not_missing(tmp_path: Path) -> None:
    assert JOB.missing_figures(RunDirectory(tmp_path)) == []


def test_nothing_is_drawn_while_another_process_may_change_the_data(drawn: RunDirectory) -> None:
    picture = drawn.plots / "training.svg"
    picture.unlink()
    with drawn.held(), pytest.raises(ExneatError, match="another process is writing there"):
        JOB.draw(drawn)
    assert not picture.exists()
