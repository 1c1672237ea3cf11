"""Robustness: one brain in the same episodes, while one setting goes through a list of levels.

A perturbation is a setting of the task or of the noise, the very ones that training uses.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from exneat_cli.brains import Brain, RandomActions
from exneat_cli.errors import ConfigError, is_finite
from exneat_cli.rollouts.executor import Executor
from exneat_cli.rollouts.noise import Noise
from exneat_cli.rollouts.outcomes import Outcomes
from exneat_cli.rollouts.runner import Runner
from exneat_cli.seeding import EpisodeSeeds
from exneat_cli.tasks import HasInitialPose, Task


@dataclass(frozen=True)
class Sweep:
    """A setting and the levels that it goes through.

    Attributes:
        name: e.g. ``sensor_noise``.
        parameter: the setting, below ``task.`` or ``noise.``.
        levels: its values, all different.

    Raises:
        ConfigError: there are no levels, or one is no finite number or comes twice.
    """

    name: str
    parameter: str
    levels: tuple[float, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "levels", tuple(self.levels))
        if not self.levels:
            raise ConfigError("sweep.levels", f"at least one level of {self.parameter}", list(self.levels))
        for level in self.levels:
            if isinstance(level, bool) or not isinstance(level, int | float) or not is_finite(level):
                raise ConfigError("sweep.levels", f"finite numbers, levels of {self.parameter}", level)
        if len(set(self.levels)) < len(self.levels):
            raise ConfigError("sweep.levels", "levels that all differ", list(self.levels))


def perturbed(task: Task, noise: Noise, sweep: Sweep, level: float) -> tuple[Task, Noise]:
    """Task and noise with one setting at another level.

    Raises:
        ConfigError: the task has no such setting, or it refuses the level.
    """
    section, _, name = sweep.parameter.partition(".")
    part = {"task": task, "noise": noise}.get(section)
    if part is None or name not in {field.name for field in dataclasses.fields(part)}:  # type: ignore[arg-type]
        raise ConfigError("sweep", f"a sweep that fits task={task.name}", sweep.name, f"it has no {sweep.parameter}")
    if sweep.parameter == "noise.reset_scale" and not isinstance(task, HasInitialPose):
        raise ConfigError("sweep", f"a sweep that fits task={task.name}", sweep.name, "it has no initial pose")
    changed = dataclasses.replace(part, **{name: level})  # type: ignore[type-var]
    return (changed, noise) if section == "task" else (task, changed)  # type: ignore[return-value]


def run_levels(
    acting: Sequence[Brain] | RandomActions,
    task: Task,
    noise: Noise,
    sweep: Sweep,
    executor: Executor,
    episodes: Sequence[EpisodeSeeds],
) -> Iterator[tuple[float, Outcomes]]:
    """Each level with what came out of the episodes, which have no early stopping.

    Args:
        acting: see `Runner.run`.
        task: as it was trained.
        noise: as it was trained.
        sweep: what changes.
        executor: where episodes run.
        episodes: the same at every level.

    Raises:
        ConfigError: the task refuses a level; before anything was run.
    """
    settings = [perturbed(task, noise, sweep, level) for level in sweep.levels]
    for level, (changed_task, changed_noise) in zip(sweep.levels, settings, strict=True):
        with Runner(changed_task, changed_noise, executor, training=False) as runner:
            yield level, runner.run(acting, episodes)
