"""Ant, Gymnasium's four-legged body, with the settings of the thesis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from exneat_cli.tasks.robots.robot import RobotTask


@dataclass(frozen=True)
class AntTask(RobotTask):
    """Gymnasium's Ant-v5 as used in the thesis; the parameters are those of any robot.

    By position, x ahead and y to the left, leg 1 is front left, leg 2 back left, leg 3 back right and leg 4 front
    right; the names of the model's bodies differ.
    """

    name: str = "ant"
    model: str = "ant"
    frame: str = "world"
    contact_forces: bool = True
    reward: str = "thesis"

    def identity(self) -> dict[str, Any]:
        """The parameters; those that were added later are left out where they keep the original Ant."""
        later = ("model", "frame", "symmetry", "contact_forces", "parts", "control_period")
        now, before = self.to_plain(), AntTask().to_plain()
        return {key: value for key, value in super().identity().items() if key not in later or now[key] != before[key]}
