"""What disturbs an agent: one layer for training and testing, and sweeps of one of its settings."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

from exneat_cli.errors import ConfigError, check_real, is_finite
from exneat_cli.tasks import HasInitialPose, Task


@dataclass(frozen=True)
class Noise:
    """What disturbs the agent.

    Attributes:
        sensor_std: sd of the normal noise on every reading at every step, in the reading's own unit.
        reset_scale: size of the noise on the initial pose, uniform on positions (rad, m) and normal on
            velocities (rad/s, m/s); 0.1 is the default of Gymnasium's Ant.

    Raises:
        ConfigError: a value is negative or not finite.
    """

    sensor_std: float = 0.0
    reset_scale: float = 0.1

    def __post_init__(self) -> None:
        check_real("noise.sensor_std", self.sensor_std, 0.0)
        check_real("noise.reset_scale", self.reset_scale, 0.0)


@dataclass(frozen=True)
class Sweep:
    """A setting of the task or of the noise, the very ones that training uses, and the levels that it goes through.

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
    """Task and noise with the sweep's setting at another level.

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
