"""What the four grid worlds share: tiles, sensing, choosing and moving.

A world has N x N tiles. Every tile carries two signals and is path or wall; the border is wall. The agent
stands on a path tile and senses the first neighbour on each side.

Observation (8 numbers, clipped to [0, 1]):

| index | meaning |
|---|---|
| 0, 1 | channel 1 and 2 of the tile to the left |
| 2, 3 | the same to the right |
| 4, 5 | the same above |
| 6, 7 | the same below |

Action (5 numbers, the value of each move): 0 left, 1 right, 2 up, 3 down, 4 stay. The largest wins, after
U(0, 1e-3) is added to each so that ties break fairly. A step into a wall stays.

Source: Zhang (2025), section 3.2.
"""

from __future__ import annotations

from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exneat_cli.compiling import compiled, compiled_lean
from exneat_cli.tasks.task import Part, Task

CHANNELS = 2
STAY = 4
MOVES = ("left", "right", "up", "down", "stay")
POSITIONS = {"left": (-1.0, 0.0), "right": (1.0, 0.0), "up": (0.0, 1.0), "down": (0.0, -1.0)}
ROW_STEPS = (0, 0, -1, 1, 0)
COLUMN_STEPS = (-1, 1, 0, 0, 0)
"""Change of row and column for each move; rows grow downwards."""

ROW, COLUMN, STEPS = range(3)
"""Entries of `Grid.agent`: where the agent is, and how many steps it has taken."""


class Grid(NamedTuple):
    """Tiles and the agent on them.

    Attributes:
        signals: (2, N, N), what each tile emits; 0 on walls.
        path: (N, N), 1 where one can walk, 0 on walls.
        agent: row, column and steps taken.
    """

    signals: NDArray[np.float64]
    path: NDArray[np.int64]
    agent: NDArray[np.int64]


def empty_grid(size: int) -> Grid:
    """A grid of size x size tiles, all of them wall."""
    return Grid(np.zeros((CHANNELS, size, size)), np.zeros((size, size), np.int64), np.zeros(3, np.int64))


class GridTask(Task):
    """The part of every grid world that follows from its sensors and moves alone."""

    tie_noise: ClassVar[float] = 1e-3
    recurrent: ClassVar[bool] = True
    observation_limits: ClassVar[tuple[float, float]] = (0.0, 1.0)
    observation_size: ClassVar[int] = 4 * CHANNELS
    actuator_names: ClassVar[tuple[str, ...]] = MOVES

    @property
    def parts(self) -> tuple[Part, ...]:
        """Left, right, up and down, with two channels and the value of moving there."""
        return tuple(
            Part(name, (CHANNELS * k, CHANNELS * k + 1), (k,), position)
            for k, (name, position) in enumerate(POSITIONS.items())
        )

    @property
    def action_bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Random values between 0 and 1 choose all five moves equally often."""
        return np.zeros(len(MOVES)), np.ones(len(MOVES))

    @property
    def resting_action(self) -> NDArray[np.float64]:
        """The action that stays where it is."""
        action = np.zeros(len(MOVES))
        action[STAY] = 1.0
        return action

    def tiles(self, world: Any) -> NDArray[np.float64]:
        """(N, N, 3) path (1 or 0) and both channels of every tile as they are now."""
        tiles: NDArray[np.float64] = np.stack([world.grid.path, *world.grid.signals], axis=2)
        return tiles


@compiled_lean
def sense(signals: NDArray[np.float64], agent: NDArray[np.int64], observation: NDArray[np.float64]) -> None:
    """Write both channels of the four neighbours, unclipped."""
    for side in range(4):
        row = agent[ROW] + ROW_STEPS[side]
        column = agent[COLUMN] + COLUMN_STEPS[side]
        observation[CHANNELS * side] = signals[0, row, column]
        observation[CHANNELS * side + 1] = signals[1, row, column]


@compiled_lean
def move(path: NDArray[np.int64], agent: NDArray[np.int64], action: NDArray[np.float64]) -> bool:
    """Take the step with the largest value, or stay in front of a wall; counts the step.

    Returns:
        Whether all values were finite; if not, nothing moves.
    """
    choice = 0
    for k in range(action.size):
        if not np.isfinite(action[k]):
            return False
        if action[k] > action[choice]:
            choice = k
    row = agent[ROW] + ROW_STEPS[choice]
    column = agent[COLUMN] + COLUMN_STEPS[choice]
    if path[row, column] == 1:
        agent[ROW] = row
        agent[COLUMN] = column
    agent[STEPS] += 1
    return True


@compiled
def measure_distances(
    path: NDArray[np.int64], row: int, column: int, distances: NDArray[np.int64], queue: NDArray[np.int64]
) -> int:
    """Write the walking distance of every path tile to (row, column), -1 where there is no way.

    Args:
        path: (N, N).
        row: of a path tile.
        column: of the same.
        distances: (N, N), overwritten.
        queue: (N * N, 2), scratch.

    Returns:
        The largest distance.
    """
    distances[:] = -1
    distances[row, column] = 0
    queue[0, 0], queue[0, 1] = row, column
    head, tail = 0, 1
    furthest = 0
    while head < tail:
        r, c = queue[head, 0], queue[head, 1]
        head += 1
        furthest = distances[r, c]
        for side in range(4):
            next_row, next_column = r + ROW_STEPS[side], c + COLUMN_STEPS[side]
            if path[next_row, next_column] == 1 and distances[next_row, next_column] < 0:
                distances[next_row, next_column] = furthest + 1
                queue[tail, 0], queue[tail, 1] = next_row, next_column
                tail += 1
    return furthest
