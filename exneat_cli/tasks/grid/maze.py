"""What both mazes share: the way to the goal, scoring, and the compiled episode after its reset.

A maze is solved when the agent stands on the goal. The episode ends there, or `t_fast + SPARE_STEPS` steps
after its start, `t_fast` being the walking distance from start to goal. Its fitness, paid at the last
step, is ``0.5 * time + 0.5 * progress``:

* time = 1 - (t - t_fast) / SPARE_STEPS if solved at step t, else 0
* progress = 1 - d(end) / d_max, where d is the walking distance to the goal and d_max its maximum in the maze

Standing still on a track scores 0.25. The formula printed in the thesis (Zhang, 2025, section 3.2.1) has
the sign of the time term reversed: taken literally, a failure would score over 0.7.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exneat_cli.compiling import compiled, compiled_lean
from exneat_cli.tasks.grid.world import COLUMN, COLUMN_STEPS, ROW, ROW_STEPS, STEPS, move
from exneat_cli.tasks.task import ENDED, FAILED, RUNNING

SPARE_STEPS = 2
"""Steps allowed beyond the fastest way (Zhang, 2025, section 3.2.1)."""
GOAL_ROW, GOAL_COLUMN, FASTEST, FURTHEST, START_ROW, START_COLUMN = range(6)
"""Entries of `Maze.goal`: its place, walking distance from the start, largest distance in the maze, the start."""


class Maze(NamedTuple):
    """A maze of N x N tiles, and the parameters from which it is drawn."""

    path: NDArray[np.int64]  #: (N, N), see `exneat_cli.tasks.grid.world.GridTask`
    signals: NDArray[np.float64]  #: (2, N, N), see there
    agent: NDArray[np.int64]  #: (3,), see there
    distances: NDArray[np.int64]  #: (N, N) walking distances to the goal, -1 on walls
    goal: NDArray[np.int64]  #: (6,), see `GOAL_ROW`
    time_share: float  #: weight of time in the fitness; progress has the rest
    cue_noise: float  #: sd of the noise on the cues of path tiles
    gap: int  #: silent tiles before the goal of a track
    second_leads: bool  #: the second channel leads on every track; otherwise it is drawn
    weights: tuple[float, float]  #: of the cues on both channels of a general maze
    cues_removed: float  #: share of the path tiles of a general maze
    walls_removed: float  #: share of the walls between its cells


@compiled
def begin(maze: Maze, start: tuple[int, int], goal: tuple[int, int]) -> None:
    """Set start and goal, (row, column) of path tiles, measure all distances, and put the agent on the start."""
    maze.goal[START_ROW], maze.goal[START_COLUMN] = start
    maze.goal[GOAL_ROW], maze.goal[GOAL_COLUMN] = goal
    maze.goal[FURTHEST] = measure_distances(maze.path, goal, maze.distances)
    maze.goal[FASTEST] = maze.distances[start]
    rewind(maze)


@compiled
def measure_distances(path: NDArray[np.int64], goal: tuple[int, int], distances: NDArray[np.int64]) -> int:
    """Write the walking distance of every tile of `path` to `goal` into `distances`, both (N, N); -1 if unreachable.

    Returns:
        The largest distance.
    """
    # Breadth first: tiles leave the queue in the order of their distance, so the last one is the furthest.
    queue = np.empty((path.size, 2), np.int64)
    queue[0, 0], queue[0, 1] = goal
    head, tail = 0, 1
    distances[:] = -1
    distances[goal] = 0
    furthest = 0
    while head < tail:
        row, column = queue[head, 0], queue[head, 1]
        head += 1
        furthest = distances[row, column]
        for side in range(4):
            next_row, next_column = row + ROW_STEPS[side], column + COLUMN_STEPS[side]
            if path[next_row, next_column] == 1 and distances[next_row, next_column] < 0:
                distances[next_row, next_column] = furthest + 1
                queue[tail, 0], queue[tail, 1] = next_row, next_column
                tail += 1
    return furthest


@compiled_lean
def rewind(maze: Maze) -> None:
    """Put the agent back to its start."""
    agent, goal = maze.agent, maze.goal
    agent[ROW], agent[COLUMN], agent[STEPS] = goal[START_ROW], goal[START_COLUMN], 0


@compiled_lean
def step(maze: Maze, action: NDArray[np.float64], terms: NDArray[np.float64]) -> int:
    """Move once; `terms`, (2,), become the rewards of time and progress, 0 before the last step."""
    terms[:] = 0.0
    if not move(maze.path, maze.agent, action):
        return FAILED
    # The episode goes on until the goal is reached or the spare steps are used up.
    agent, goal = maze.agent, maze.goal
    distance = maze.distances[agent[ROW], agent[COLUMN]]
    late = agent[STEPS] - goal[FASTEST]
    if distance > 0 and late < SPARE_STEPS:
        return RUNNING
    # Time is rewarded only on arrival, progress always.
    if distance == 0:
        terms[0] = maze.time_share * (1.0 - late / SPARE_STEPS)
    terms[1] = (1.0 - maze.time_share) * (1.0 - distance / goal[FURTHEST])
    return ENDED


@compiled
def locate(maze: Maze, row: NDArray[np.float64]) -> None:
    """Write row and column of the agent, then of the goal."""
    row[0] = maze.agent[ROW]
    row[1] = maze.agent[COLUMN]
    row[2] = maze.goal[GOAL_ROW]
    row[3] = maze.goal[GOAL_COLUMN]
