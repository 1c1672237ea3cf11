"""Baselines: untrained agents that follow a rule."""

from __future__ import annotations

from dataclasses import dataclass

from exneat_cli.algorithms.algorithm import Algorithm
from exneat_cli.algorithms.neat.settings import EvolutionSettings
from exneat_cli.errors import ConfigError, check_choice
from exneat_cli.tasks import Task
from exneat_cli.wiring import Geometry, Plan, Wiring, refuse_modules

BASELINES = ("random", "motionless", "linear_fusion")


@dataclass(frozen=True)
class Baseline(Algorithm):
    """A rule, found by its name in `exneat_cli.brains.rules`."""

    name: str = "random"
    modular = False

    def __post_init__(self) -> None:
        check_choice("algorithm.name", self.name, BASELINES)

    @property
    def rule(self) -> str:
        """The rule's name, which is the algorithm's."""
        return self.name

    def plan(self, task: Task, geometry: Geometry, linkage: str, wiring: Wiring, evolution: EvolutionSettings) -> Plan:
        """A plan without modules."""
        refuse_modules(self.name, geometry, linkage, wiring)
        if self.name == "linear_fusion" and any(len(part.actuators) != 1 for part in task.parts):
            fix = "it moves to where the sum of a part's sensors is largest, so only grid worlds have it"
            raise ConfigError("algorithm", "exneat, neat or random", self.name, fix)
        return Plan((), task.sensed_size, len(task.actuator_names))
