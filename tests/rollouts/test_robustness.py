"""Sweeps of one setting: the same perturbation as in training, levels checked before anything runs."""

from __future__ import annotations

import math

import numpy as np
import pytest

from exneat_cli.brains import linear_fusion
from exneat_cli.errors import ConfigError
from exneat_cli.rollouts import Executor, Noise, Runner, Sweep, perturbed, run_levels
from exneat_cli.seeding import shared_episodes
from exneat_cli.tasks import TASKS, AntTask, Hunting, TrackMaze


def test_a_level_gives_what_a_run_trained_with_that_setting_would_see() -> None:
    task, brain = Hunting(), linear_fusion(8, 5, Hunting().parts)
    episodes = shared_episodes("test", 5)
    sweep = Sweep("p_m", "task.p_m", (0.0, 1.0))
    levels = dict(run_levels([brain], task, Noise(0.05), sweep, Executor("serial"), episodes))
    for p_m, outcomes in levels.items():
        with Runner(Hunting(p_m=p_m), Noise(0.05), Executor("serial"), training=False) as runner:
            np.testing.assert_array_equal(outcomes.fitness, runner.run([brain], episodes).fitness)


def test_a_perturbation_changes_its_own_setting_alone() -> None:
    task, noise = perturbed(TrackMaze(size=17), Noise(0.05), Sweep("gap", "task.gap", (3,)), 3)
    assert (task, noise) == (TrackMaze(size=17, gap=3), Noise(0.05))
    task, noise = perturbed(AntTask(), Noise(0.05), Sweep("reset_noise", "noise.reset_scale", (0.3,)), 0.3)
    assert (task, noise) == (AntTask(), Noise(0.05, 0.3))


@pytest.mark.parametrize("name", [name for name in TASKS if name != "ant"])
def test_reset_noise_fits_no_grid_world(name: str) -> None:
    with pytest.raises(ConfigError, match="no initial pose"):
        perturbed(TASKS[name](), Noise(), Sweep("reset_noise", "noise.reset_scale", (0.3,)), 0.3)


@pytest.mark.parametrize("parameter", ["task.gap", "task.nothing", "seed", "evolution.elitism", "gap", ""])
def test_a_setting_that_the_task_lacks_is_refused_by_name(parameter: str) -> None:
    with pytest.raises(ConfigError, match="a sweep that fits task=ant"):
        perturbed(AntTask(), Noise(), Sweep("odd", parameter, (1,)), 1)


def test_a_level_out_of_range_is_refused_before_the_first_level_runs() -> None:
    task = TrackMaze()
    sweep = Sweep("gap", "task.gap", (0, 99))
    with pytest.raises(ConfigError, match=r"task\.gap"):
        next(run_levels([linear_fusion(8, 5, task.parts)], task, Noise(), sweep, Executor("serial"), []))


@pytest.mark.parametrize("levels", [(), (0.1, 0.1), (math.nan,), (math.inf,), ("0.1",), (True,), (None,), (0, 0.0)])
def test_levels_are_finite_numbers_that_differ(levels: tuple[float, ...]) -> None:
    with pytest.raises(ConfigError, match=r"sweep\.levels"):
        Sweep("sensor_noise", "noise.sensor_std", levels)
