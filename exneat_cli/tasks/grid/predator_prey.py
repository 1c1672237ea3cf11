"""Predator and prey: foraging, where prey stand still, and hunting, where they move.

The agent starts in the centre of an open square surrounded by a wall. Prey emit odour (channel 1) and sound
(channel 2) in Gaussian patches; in foraging each emits one of them, alternating by index, in hunting both.

Each step begins with the world: a share `p_c` of the cue field persists; each free prey on the agent's tile is
caught; each other one may move, is caught if it enters the agent's tile, and adds a patch of cue around itself, or
the same patch with its values shuffled, which carries no direction. Then the agent senses and moves; stepping
onto a prey catches it. The episode ends when all are caught, or after `steps` moves. Its fitness, paid at the
last step, is the share of prey caught.

With ``rules=library``, prey are caught only at the beginning of a step, before they move: not when they move onto the
agent, nor when the agent's last move reaches them. Prey may start on the agent's tile.

The reset draws all paths and cues in advance (`exneat_cli.tasks.grid.prey_field`), so a step only looks up four tiles.
A caught prey's cues are those from just before it was caught, and fade.

For observations and actions see `exneat_cli.tasks.grid.world`.
Source: Zhang (2025), section 3.2.2, and the library behind it, Multimodal_mazes by M. Ghosh (``rules=library``, and p_c
as the share that persists; the thesis calls it a decay).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from exneat_cli.compiling import compiled, compiled_lean
from exneat_cli.errors import ConfigError, check_choice, check_real, check_whole
from exneat_cli.tasks.grid.prey_field import FREE, PREY_COLUMN, PREY_ROW, Field, bell, draw_prey
from exneat_cli.tasks.grid.world import CHANNELS, COLUMN, COLUMN_STEPS, ROW, ROW_STEPS, STEPS, GridTask, move
from exneat_cli.tasks.task import ENDED, FAILED, RUNNING, Simulation

MOTIONS = ("levy", "brownian")
RULES = ("own", "library")
MOST_CUES = 2**25
"""Most numbers that one world may hold (256 MiB)."""


@dataclass(frozen=True)
class Foraging(GridTask):
    """Parameters of foraging.

    Attributes:
        name: always ``foraging``.
        size: open tiles per side, 3 to 99.
        n_prey: at most size * size - 1.
        steps: moves of the agent, at least 1; the cues of all steps are kept in memory, 256 MiB at most.
        p_e: chance per prey, step and channel that the cue has a direction, 0 to 1.
        p_c: persistence, the share of the cues that is left after a step, 0 (they vanish at once) to 1 (they stay).
        patch_width: tiles per side of an emission, odd, 1 to 15.
        rules: ``own`` or ``library``: when prey are caught and where they start.

    Raises:
        ConfigError: a value is out of range.
    """

    name: str = "foraging"
    size: int = 7
    n_prey: int = 10
    steps: int = 50
    p_e: float = 1.0
    p_c: float = 0.0
    patch_width: int = 5
    rules: str = "own"

    terms: ClassVar[tuple[str, ...]] = ("caught",)
    channels: ClassVar[int] = 1
    """Number of channels on which each prey emits."""
    p_m = 0.0
    motion = "brownian"
    """Prey never move in foraging; in `Hunting` these are settings."""
    came_later: ClassVar[dict[str, Any]] = {"rules": "own"}

    def __post_init__(self) -> None:
        check_choice("task.name", self.name, [type(self).name])
        check_whole("task.size", self.size, 3, 99)
        check_whole("task.n_prey", self.n_prey, 1, self.size**2 - 1)
        check_whole("task.steps", self.steps, 1, 1_000_000)
        check_real("task.p_e", self.p_e, 0.0, 1.0)
        check_real("task.p_c", self.p_c, 0.0, 1.0)
        check_whole("task.patch_width", self.patch_width, 1, 15)
        check_choice("task.rules", self.rules, RULES)
        if self.patch_width % 2 == 0:
            raise ConfigError("task.patch_width", "an odd number", self.patch_width, "a patch has a tile in its centre")
        per_prey = (self.size + 2) ** 2 * self.channels
        most_prey, most_steps = MOST_CUES // per_prey, MOST_CUES // (per_prey * self.n_prey)
        fix = "the cues of every prey, tile and step are kept: make steps, size or n_prey smaller"
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

    def open(self, *, training: bool) -> Simulation:
        """Open a new field."""
        tiles, prey = (self.size + 2, self.size + 2), self.n_prey
        field = Field(
            path=np.zeros(tiles, np.int64),
            agent=np.zeros(3, np.int64),
            prey=np.zeros((prey, 3), np.int64),
            start=np.zeros((prey, 2), np.int64),
            places=np.zeros((self.steps, prey, 2), np.int64),
            cues=np.zeros((self.steps, *tiles, prey * self.channels)),
            last_free=np.zeros(prey, np.int64),
            strength=np.zeros(prey),
            patch=bell(self.patch_width),
            channels=self.channels,
            emission=float(self.p_e),
            keep=float(self.p_c),
            motion=float(self.p_m),
            levy=self.motion == "levy",
            library=self.rules == "library",
        )
        return Simulation(field, reset, rewind, observe, step, locate)

    def tiles(self, world: Field) -> NDArray[np.float64]:
        """(N, N, 3) path (1 or 0) and both channels of the cue field as last sensed by the agent."""
        tiles = np.stack([world.path, *np.zeros((CHANNELS, *world.path.shape))], axis=2)
        for emitter in range(world.cues.shape[3]):
            k = emitter // self.channels
            tiles[..., 1 + emitter % CHANNELS] += world.strength[k] * world.cues[world.last_free[k], ..., emitter]
        return tiles

    def targets(self, world: Field) -> list[tuple[int, int]]:
        """The prey that are free."""
        return [(int(row), int(column)) for row, column, free in world.prey if free]


@dataclass(frozen=True)
class Hunting(Foraging):
    """Parameters of hunting: those of foraging, and how prey move.

    Attributes:
        name: always ``hunting``.
        p_m: chance that a free prey moves in a step, 0 to 1.
        motion: ``levy`` (straight flights of 1 to 7 tiles) or ``brownian`` (a new direction each time).

    Raises:
        ConfigError: a value is out of range.
    """

    name: str = "hunting"
    p_e: float = 0.8
    p_m: float = 0.5
    motion: str = "levy"

    channels: ClassVar[int] = 2

    def __post_init__(self) -> None:
        super().__post_init__()
        check_real("task.p_m", self.p_m, 0.0, 1.0)
        check_choice("task.motion", self.motion, MOTIONS)


@compiled
def reset(field: Field, rng: Generator) -> None:
    """Draw prey, their paths and their cues, and start."""
    draw_prey(field, rng)
    rewind(field)


@compiled_lean
def rewind(field: Field) -> None:
    """Put the agent in the centre and all prey, free, where they started."""
    agent, prey = field.agent, field.prey
    agent[ROW] = agent[COLUMN] = field.path.shape[0] // 2
    agent[STEPS] = 0
    for k in range(prey.shape[0]):
        prey[k, PREY_ROW], prey[k, PREY_COLUMN], prey[k, FREE] = field.start[k, 0], field.start[k, 1], 1
        field.strength[k] = 1.0
    advance(field)


@compiled_lean
def advance(field: Field) -> int:
    """Advance prey and cues to what the agent senses next; returns the number of prey that are then free."""
    agent, prey, strength, last_free = field.agent, field.prey, field.strength, field.last_free
    t = agent[STEPS]
    free = 0
    for k in range(prey.shape[0]):
        if prey[k, FREE] == 1:
            # A free prey moves as the reset has drawn, and stays free unless the agent is where it now is, or, by the
            # library's rules, where it was before.
            before = prey[k, PREY_ROW] == agent[ROW] and prey[k, PREY_COLUMN] == agent[COLUMN]
            row, column = field.places[t, k, 0], field.places[t, k, 1]
            if not (field.library and before):
                prey[k, PREY_ROW], prey[k, PREY_COLUMN] = row, column
            if not (before if field.library else row == agent[ROW] and column == agent[COLUMN]):
                last_free[k] = t
                free += 1
                continue
            # Caught: it no longer emits, so its cues of the step before fade; before the first step there are none.
            prey[k, FREE] = 0
            if t == 0:
                last_free[k] = 0
                strength[k] = 0.0
        strength[k] *= field.keep
    return free


@compiled_lean
def observe(field: Field, observation: NDArray[np.float64]) -> None:
    """Write the cue field on the four neighbours: for each channel, the sum over emitters."""
    agent, cues = field.agent, field.cues
    last_free, strength = field.last_free, field.strength
    row, column = agent[ROW], agent[COLUMN]
    observation[:] = 0.0
    for k in range(last_free.size):
        t, share = last_free[k], strength[k]
        for emitter in range(k * field.channels, (k + 1) * field.channels):
            channel = emitter % CHANNELS
            for side in range(4):
                cue = cues[t, row + ROW_STEPS[side], column + COLUMN_STEPS[side], emitter]
                observation[CHANNELS * side + channel] += share * cue


@compiled_lean
def step(field: Field, action: NDArray[np.float64], terms: NDArray[np.float64]) -> int:
    """Move once, and advance the world to the next move; `terms`, (1,), becomes the share caught, 0 before the end."""
    prey, agent = field.prey, field.agent
    terms[:] = 0.0
    if not move(field.path, agent, action):
        return FAILED
    # Stepping onto a prey catches it; by the library's rules, only when the next step begins.
    free = 0
    for k in range(prey.shape[0]):
        if not field.library and prey[k, PREY_ROW] == agent[ROW] and prey[k, PREY_COLUMN] == agent[COLUMN]:
            prey[k, FREE] = 0
        free += prey[k, FREE]
    # Prey may move onto the agent, which also ends the episode if they were the last.
    if agent[STEPS] < field.cues.shape[0] and free > 0:
        free = advance(field)
        if free > 0:
            return RUNNING
    terms[0] = 1.0 - free / prey.shape[0]
    return ENDED


@compiled
def locate(field: Field, row: NDArray[np.float64]) -> None:
    """Write the agent's row and column, then row, column and freedom of every prey."""
    row[0] = field.agent[ROW]
    row[1] = field.agent[COLUMN]
    for k in range(field.prey.shape[0]):
        for entry in range(3):
            row[2 + 3 * k + entry] = field.prey[k, entry]
