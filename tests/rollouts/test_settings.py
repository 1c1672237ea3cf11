"""Sweeps of one setting: the very one that training uses, refused where the task has none."""

from __future__ import annotations

import math

import pytest

from exneat_cli.errors import ConfigError
from exneat_cli.rollouts import Noise, Sweep, perturbed
from exneat_cli.tasks import TASKS, AntTask, Task, TrackMaze


def test_a_perturbation_changes_its_own_setting_alone() -> None:
    task, noise = perturbed(TrackMaze(size=17), Noise(0.05), Sweep("gap", "task.gap", (3,)), 3)
    assert (task, noise) == (TrackMaze(size=17, gap=3), Noise(0.05))
    task, noise = perturbed(AntTask(), Noise(0.05), Sweep("reset_noise", "noise.reset_scale", (0.3,)), 0.3)
    assert (task, noise) == (AntTask(), Noise(0.05, 0.3))


@pytest.mark.parametrize(
    ("task", "parameter", "level", "message"),
    [
        *((AntTask(), name, 1, "a sweep that fits task=ant") for name in ("task.gap", "seed", "gap", "")),
        *(
            (TASKS[name](), "noise.reset_scale", 0.3, "no initial pose")
            for name in TASKS
            if name not in ("ant", "robot")
        ),
        (TrackMaze(), "task.gap", 99, r"task\.gap: expected a whole number"),
    ],
)
def test_what_the_task_lacks_or_refuses_is_refused_by_name(
    task: Task, parameter: str, level: float, message: str
) -> None:
    with pytest.raises(ConfigError, match=message):
        perturbed(task, Noise(), Sweep("odd", parameter, (level,)), level)


@pytest.mark.parametrize("levels", [(), (0.1, 0.1), (math.nan,), (math.inf,), ("0.1",), (True,), (None,), (0, 0.0)])
def test_levels_are_finite_numbers_that_differ(levels: tuple[float, ...]) -> None:
    with pytest.raises(ConfigError, match=r"sweep\.levels"):
        Sweep("sensor_noise", "noise.sensor_std", levels)
