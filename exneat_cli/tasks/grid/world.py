"""What the grid worlds share: tiles, senses, moves, and the base class of a new world.

A world has N x N tiles. Every tile carries two signals and is path or wall; the border is wall. The agent
stands on a path tile and senses the adjacent tile on each side.

Observation (8 numbers without a unit, clipped to [0, 1]):

| index | meaning |
|---|---|
| 0, 1 | channel 1 and 2 of the tile to the left |
| 2, 3 | the same to the right |
| 4, 5 | the same above |
| 6, 7 | the same below |

Action (5 numbers, the value of each move): 0 left, 1 right, 2 up, 3 down, 4 stay. The largest wins, after
U(0, 1e-3) is added to each so that ties break fairly. A step into a wall leaves the agent in place.

A new world is a file with a frozen dataclass that derives from `GridTask` (the track of `exneat_cli.tasks.grid.mazes`
is the shortest to start from), a line in `exneat_cli.tasks.TASKS`, and a YAML file in `conf/task`.

Source: Zhang (2025), section 3.2.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from exneat_cli.compiling import compiled, compiled_lean
from exneat_cli.tasks.grid.picture import GridCamera, Snapshot
from exneat_cli.tasks.task import Camera, Part, Task

CHANNELS = 2
STAY = 4
MOVES = ("left", "right", "up", "down", "stay")
ROW_STEPS = (0, 0, -1, 1, 0)
COLUMN_STEPS = (-1, 1, 0, 0, 0)
"""Change of row and column for each move; rows grow downwards."""

ROW, COLUMN, STEPS = range(3)
"""Entries of a world's `agent`, (3,): where it is, and how many steps it has taken."""


class GridTask(Task):
    """A grid world: the sensors, moves and parts that all of them share.

    The storage that `open` gives is a named tuple with at least `path`, (N, N), 1 where one can walk and 0 on walls;
    `signals`, (2, N, N), what each tile emits, 0 on walls; and `agent`, see `ROW`.
    """

    tie_noise: ClassVar[float] = 1e-3
    recurrent: ClassVar[bool] = True
    observation_limits: ClassVar[tuple[float, float]] = (0.0, 1.0)
    observation_size: ClassVar[int] = 4 * CHANNELS
    actuator_names: ClassVar[tuple[str, ...]] = MOVES
    sensor_names: ClassVar[tuple[str, ...]] = tuple(
        f"{way}, channel {1 + channel}" for way in MOVES[:STAY] for channel in range(CHANNELS)
    )
    parts: ClassVar[tuple[Part, ...]] = (
        Part("left", sensors=(0, 1), actuators=(0,), position=(-1.0, 0.0)),
        Part("right", sensors=(2, 3), actuators=(1,), position=(1.0, 0.0)),
        Part("up", sensors=(4, 5), actuators=(2,), position=(0.0, 1.0)),
        Part("down", sensors=(6, 7), actuators=(3,), position=(0.0, -1.0)),
    )
    """Each senses two channels and gives the value of moving there."""
    came_later: ClassVar[dict[str, Any]] = {}
    """Parameters added later, with the value that keeps the earlier behaviour; at that value they are not hashed."""

    def identity(self) -> dict[str, Any]:
        """The parameters, except those in `came_later` that change nothing."""
        plain = super().identity()
        return {name: value for name, value in plain.items() if (name, value) not in self.came_later.items()}

    @property
    def action_bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Random values between 0 and 1 choose all five moves equally often."""
        return np.zeros(len(MOVES)), np.ones(len(MOVES))

    @property
    def resting_action(self) -> NDArray[np.float64]:
        """The action of staying in place."""
        return np.asarray(np.eye(len(MOVES))[STAY])

    def tiles(self, world: Any) -> NDArray[np.float64]:
        """(N, N, 3) current path (1 or 0) and both channels of every tile."""
        return np.asarray(np.stack([world.path, *world.signals], axis=2))

    def snapshot(self, world: Any) -> Snapshot:
        """The current tiles, agent and targets."""
        return self.tiles(world), (int(world.agent[ROW]), int(world.agent[COLUMN])), self.targets(world)

    def camera(self, width: int, height: int) -> Camera:
        """Draws tiles, see `exneat_cli.tasks.grid.picture`."""
        return GridCamera(width, height)

    def targets(self, world: Any) -> list[tuple[int, int]]:
        """Row and column of everything that the agent still looks for, to be drawn."""
        return []


@compiled
def draw_tiles(eligible: NDArray[np.int64], count: int, rng: Generator) -> NDArray[np.int64]:
    """(count, 2) rows and columns of different tiles, drawn from the nonzero entries of `eligible`, (N, N)."""
    tiles = np.argwhere(eligible)
    # The first steps of a Fisher-Yates shuffle.
    for k in range(count):
        other = k + int(rng.integers(0, tiles.shape[0] - k))
        for axis in range(2):
            tiles[k, axis], tiles[other, axis] = tiles[other, axis], tiles[k, axis]
    return tiles[:count]


@compiled_lean
def observe(world, observation):  # type: ignore[no-untyped-def]
    """Write both channels of the four neighbours, unclipped, into `observation`, (8,)."""
    signals, agent = world.signals, world.agent
    for side in range(4):
        row = agent[ROW] + ROW_STEPS[side]
        column = agent[COLUMN] + COLUMN_STEPS[side]
        for channel in range(CHANNELS):
            observation[CHANNELS * side + channel] = signals[channel, row, column]


@compiled_lean
def move(path: NDArray[np.int64], agent: NDArray[np.int64], action: NDArray[np.float64]) -> bool:
    """Take the step with the largest value, or stay if a wall is in the way; counts the step.

    Returns whether all values were finite; if not, nothing moves.
    """
    # The largest value wins; the noise that breaks ties was added before.
    choice = 0
    for k in range(action.size):
        if not np.isfinite(action[k]):
            return False
        if action[k] > action[choice]:
            choice = k
    # A step into a wall leaves the agent in place, but counts.
    row = agent[ROW] + ROW_STEPS[choice]
    column = agent[COLUMN] + COLUMN_STEPS[choice]
    if path[row, column] == 1:
        agent[ROW] = row
        agent[COLUMN] = column
    agent[STEPS] += 1
    return True
