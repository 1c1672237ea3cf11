"""Perturbation: one layer for training and testing."""

from __future__ import annotations

from dataclasses import dataclass

from exneat_cli.errors import check_real


@dataclass(frozen=True)
class Noise:
    """What disturbs the agent.

    Attributes:
        sensor_std: sd of the normal noise on every input at every step, in the input's own unit.
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
