"""Predator and prey: foraging, where prey stand still, and hunting, where they move.

The agent starts in the centre of an open square with a wall around. Prey emit odour (channel 1) and sound
(channel 2) in Gaussian patches; in foraging each emits one of them, alternating by index, in hunting both.

Observation and action, index by index: `exneat_cli.tasks.grid.world`. Order of events and scoring:
`exneat_cli.tasks.grid.prey_dynamics`. Source: Zhang (2025), section 3.2.2, with p_c as the decay of cues.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from exneat_cli.errors import ConfigError, check_choice, check_real, check_whole
from exneat_cli.tasks.grid import prey_dynamics
from exneat_cli.tasks.grid.prey_field import Field, new_field
from exneat_cli.tasks.grid.world import CHANNELS, GridTask
from exneat_cli.tasks.task import Simulation

MOTIONS = ("levy", "brownian")
MOST_CUES = 2**25
"""Numbers that one world may hold, 256 MiB."""


@dataclass(frozen=True)
class Foraging(GridTask):
    """Parameters of foraging.

    Attributes:
        name: always ``foraging``.
        size: open tiles per side, 3 to 99.
        n_prey: at most size * size - 1.
        steps: moves of the agent, at least 1; what every prey emits is kept for all of them, 256 MiB at most.
        p_e: chance per prey, step and channel that the cue has a direction, 0 to 1.
        p_c: decay of the cues per step, 0 (they stay) to 1 (they vanish at once).
        patch_width: tiles per side of an emission, odd, 1 to 15.

    Raises:
        ConfigError: a value is out of range.
    """

    name: str = "foraging"
    size: int = 10
    n_prey: int = 10
    steps: int = 50
    p_e: float = 0.8
    p_c: float = 0.5
    patch_width: int = 5

    terms: ClassVar[tuple[str, ...]] = ("caught",)
    emits_both: ClassVar[bool] = False

    def __post_init__(self) -> None:
        check_choice("task.name", self.name, ["foraging"])
        self._check_field()

    def _check_field(self) -> None:
        check_whole("task.size", self.size, 3, 99)
        check_whole("task.n_prey", self.n_prey, 1, self.size**2 - 1)
        check_whole("task.steps", self.steps, 1, 1_000_000)
        check_real("task.p_e", self.p_e, 0.0, 1.0)
        check_real("task.p_c", self.p_c, 0.0, 1.0)
        check_whole("task.patch_width", self.patch_width, 1, 15)
        if self.patch_width % 2 == 0:
            raise ConfigError("task.patch_width", "an odd number", self.patch_width, "a patch has a tile in its centre")
        self._check_cues((self.size + 2) ** 2 * (CHANNELS if self.emits_both else 1))

    def _check_cues(self, per_prey: int) -> None:
        fix = "the cues of every prey, tile and step are kept: make steps, size or n_prey smaller"
        most_prey, most_steps = MOST_CUES // per_prey, MOST_CUES // (per_prey * self.n_prey)
        if self.n_prey > most_prey:
            raise ConfigError("task.n_prey", f"at most {most_prey} for this size", self.n_prey, fix)
        if self.steps > most_steps:
            raise ConfigError("task.steps", f"at most {most_steps} for this size and n_prey", self.steps, fix)

    @property
    def trace_columns(self) -> tuple[str, ...]:  # type: ignore[override]
        """The agent's row and column, then row, column and freedom (1 free, 0 caught) of each prey."""
        prey = [f"prey_{k}_{what}" for k in range(self.n_prey) for what in ("row", "column", "free")]
        return ("row", "column", *prey)

    @property
    def longest_episode(self) -> int:
        """`steps`."""
        return self.steps

    def tiles(self, world: Field) -> NDArray[np.float64]:
        """(N, N, 3) path (1 or 0) and both channels of the cue field as the agent sensed it last."""
        signals = np.zeros_like(world.grid.signals)
        prey_dynamics.paint(world, signals)
        return np.stack([world.grid.path, *signals], axis=2)

    def open(self, *, training: bool) -> Simulation:
        """Open a new field."""
        return _simulation(self._field(motion=0.0, levy=False))

    def _field(self, *, motion: float, levy: bool) -> Field:
        return new_field(
            self.size,
            self.n_prey,
            self.patch_width,
            emission=self.p_e,
            decay=self.p_c,
            motion=motion,
            levy=levy,
            both_channels=self.emits_both,
            max_steps=self.steps,
        )


@dataclass(frozen=True)
class Hunting(Foraging):
    """Parameters of hunting: those of foraging, and how prey move.

    Attributes:
        p_m: chance that a free prey moves in a step, 0 to 1.
        motion: ``levy`` (straight flights of 1 to 7 tiles) or ``brownian`` (a new direction each time).

    Raises:
        ConfigError: a value is out of range.
    """

    name: str = "hunting"
    p_m: float = 0.5
    motion: str = "levy"

    emits_both: ClassVar[bool] = True

    def __post_init__(self) -> None:
        check_choice("task.name", self.name, ["hunting"])
        self._check_field()
        check_real("task.p_m", self.p_m, 0.0, 1.0)
        check_choice("task.motion", self.motion, MOTIONS)

    def open(self, *, training: bool) -> Simulation:
        """Open a new field."""
        return _simulation(self._field(motion=self.p_m, levy=self.motion == "levy"))


def _simulation(field: Field) -> Simulation:
    functions = (prey_dynamics.reset, prey_dynamics.rewind, prey_dynamics.observe, prey_dynamics.step)
    return Simulation(field, *functions, prey_dynamics.locate)
