"""The compiled episode of both mazes: reset, rewind, observe, step and locate.

A maze is solved when the agent stands on the goal. The episode ends there, or `t_fast + SPARE_STEPS` steps
after its start, `t_fast` being the walking distance from start to goal. Its fitness, paid at the last
step, is ``0.5 * time + 0.5 * progress``:

* time = 1 - (t - t_fast) / SPARE_STEPS if solved at step t, else 0
* progress = 1 - d(end) / d_max, d the walking distance to the goal, d_max its largest value in the maze

Standing still on a track scores 0.25. The formula printed in the thesis (Zhang, 2025, section 3.2.1) has
the sign of the time term reversed: taken literally, a failure would score over 0.7.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from exneat_cli.compiling import compiled, compiled_lean
from exneat_cli.tasks.grid.world import (
    COLUMN,
    COLUMN_STEPS,
    ROW,
    ROW_STEPS,
    STEPS,
    Grid,
    empty_grid,
    measure_distances,
    move,
    sense,
)
from exneat_cli.tasks.task import ENDED, FAILED, RUNNING

SPARE_STEPS = 2
"""Steps allowed beyond the fastest way (Zhang, 2025, section 3.2.1)."""
GOAL_ROW, GOAL_COLUMN, FASTEST, FURTHEST, START_ROW, START_COLUMN = range(6)
"""Entries of `Maze.goal`: where it is, walking distance from the start, largest distance in the maze, the start."""
LEAST_CUE, MOST_CUE = 0.1, 0.5
"""Ends of a track's ramp, from the tile beside the centre to the goal."""


class Maze(NamedTuple):
    """A maze, and what its kind is made from.

    Attributes:
        grid: tiles and agent.
        distances: (N, N) walking distances to the goal, -1 on walls.
        queue: (N * N, 2) scratch.
        goal: see `GOAL_ROW`.
        gap: silent tiles before the goal of a track.
        cue_noise: sd of the noise on the cues of path tiles.
        cues_removed, walls_removed: shares of a general maze's cues and inner walls.
        time_share: weight of time in the fitness; progress has the rest.
    """

    grid: Grid
    distances: NDArray[np.int64]
    queue: NDArray[np.int64]
    goal: NDArray[np.int64]
    gap: int
    cue_noise: float
    cues_removed: float
    walls_removed: float
    time_share: float


def new_maze(
    size: int,
    *,
    gap: int = 0,
    cue_noise: float = 0.0,
    cues_removed: float = 0.0,
    walls_removed: float = 0.0,
    time_share: float = 0.5,
) -> Maze:
    """Storage for a maze of size x size tiles."""
    return Maze(
        grid=empty_grid(size),
        distances=np.zeros((size, size), np.int64),
        queue=np.zeros((size * size, 2), np.int64),
        goal=np.zeros(6, np.int64),
        gap=gap,
        cue_noise=float(cue_noise),
        cues_removed=float(cues_removed),
        walls_removed=float(walls_removed),
        time_share=float(time_share),
    )


@compiled
def reset_track(maze: Maze, rng: Generator) -> None:
    """Draw a track: goal left or right, and which channel leads."""
    grid = maze.grid
    size = grid.path.shape[0]
    middle = size // 2
    reach = middle - 1
    grid.path[:] = 0
    grid.path[middle, 1 : size - 1] = 1
    grid.signals[:] = 0.0
    side = 1 if rng.random() < 0.5 else -1
    leading = 0 if rng.random() < 0.5 else 1
    for k in range(1, reach + 1):
        cue = MOST_CUE if reach == 1 else LEAST_CUE + (MOST_CUE - LEAST_CUE) * (k - 1) / (reach - 1)
        grid.signals[leading, middle, middle + side * k] = cue
        grid.signals[1 - leading, middle, middle + k] = cue
        grid.signals[1 - leading, middle, middle - k] = cue
    for k in range(max(0, reach - maze.gap), reach):
        grid.signals[:, middle, middle + side * k] = 0.0
    _add_cue_noise(maze, rng)
    _begin(maze, middle, middle, middle, middle + side * reach)


@compiled
def reset_general(maze: Maze, rng: Generator) -> None:
    """Draw a perfect maze, start and goal in two of its corners, and the cues towards the goal."""
    grid = maze.grid
    size = grid.path.shape[0]
    carve(grid.path, rng)
    _remove_walls(maze, rng)
    goal = int(rng.integers(0, 4))
    start = (goal + 1 + int(rng.integers(0, 3))) % 4
    goal_row, goal_column = _corner(goal, size)
    start_row, start_column = _corner(start, size)
    _begin(maze, start_row, start_column, goal_row, goal_column)
    furthest = maze.goal[FURTHEST]
    grid.signals[:] = 0.0
    for row in range(size):
        for column in range(size):
            if grid.path[row, column] == 1:
                cue = (furthest - maze.distances[row, column]) / furthest / 2.0
                grid.signals[:, row, column] = cue
    _remove_cues(maze, rng)
    _add_cue_noise(maze, rng)


@compiled
def carve(path: NDArray[np.int64], rng: Generator) -> None:
    """Make `path`, (N, N), a uniformly drawn spanning tree over the cells on odd rows and columns.

    Source: Aldous, "The random walk construction of uniform spanning trees", 1990; Broder, "Generating
    random spanning trees", 1989.
    """
    cells = path.shape[0] // 2
    path[:] = 0
    row, column = 2 * int(rng.integers(0, cells)) + 1, 2 * int(rng.integers(0, cells)) + 1
    path[row, column] = 1
    left = cells * cells - 1
    while left > 0:
        side = int(rng.integers(0, 4))
        next_row, next_column = row + 2 * ROW_STEPS[side], column + 2 * COLUMN_STEPS[side]
        if next_row < 0 or next_column < 0 or next_row >= path.shape[0] or next_column >= path.shape[0]:
            continue
        if path[next_row, next_column] == 0:
            path[next_row, next_column] = 1
            path[(row + next_row) // 2, (column + next_column) // 2] = 1
            left -= 1
        row, column = next_row, next_column


@compiled
def _corner(index, size):  # type: ignore[no-untyped-def]
    row = 1 if index < 2 else size - 2
    column = 1 if index % 2 == 0 else size - 2
    return row, column


@compiled
def _begin(maze, start_row, start_column, goal_row, goal_column):  # type: ignore[no-untyped-def]
    goal = maze.goal
    goal[START_ROW], goal[START_COLUMN] = start_row, start_column
    goal[GOAL_ROW], goal[GOAL_COLUMN] = goal_row, goal_column
    goal[FURTHEST] = measure_distances(maze.grid.path, goal_row, goal_column, maze.distances, maze.queue)
    goal[FASTEST] = maze.distances[start_row, start_column]
    rewind(maze)


@compiled
def _draw_share(candidates, count, share, rng):  # type: ignore[no-untyped-def]
    """Bring a random share of the first `count` candidates to the front; returns how many."""
    chosen = int(np.rint(share * count))
    for k in range(chosen):
        other = k + int(rng.integers(0, count - k))
        for axis in range(2):
            candidates[k, axis], candidates[other, axis] = candidates[other, axis], candidates[k, axis]
    return chosen


@compiled
def _remove_walls(maze, rng):  # type: ignore[no-untyped-def]
    if maze.walls_removed == 0.0:
        return
    path, count = maze.grid.path, 0
    for row in range(1, path.shape[0] - 1):
        for column in range(1, path.shape[0] - 1):
            if path[row, column] == 0 and (row + column) % 2 == 1:
                maze.queue[count, 0], maze.queue[count, 1] = row, column
                count += 1
    for k in range(_draw_share(maze.queue, count, maze.walls_removed, rng)):
        path[maze.queue[k, 0], maze.queue[k, 1]] = 1


@compiled
def _remove_cues(maze, rng):  # type: ignore[no-untyped-def]
    if maze.cues_removed == 0.0:
        return
    path, count = maze.grid.path, 0
    for row in range(path.shape[0]):
        for column in range(path.shape[0]):
            if path[row, column] == 1:
                maze.queue[count, 0], maze.queue[count, 1] = row, column
                count += 1
    for k in range(_draw_share(maze.queue, count, maze.cues_removed, rng)):
        maze.grid.signals[:, maze.queue[k, 0], maze.queue[k, 1]] = 0.0


@compiled
def _add_cue_noise(maze, rng):  # type: ignore[no-untyped-def]
    if maze.cue_noise == 0.0:
        return
    grid = maze.grid
    for row in range(grid.path.shape[0]):
        for column in range(grid.path.shape[0]):
            if grid.path[row, column] == 1:
                for channel in range(2):
                    noisy = grid.signals[channel, row, column] + rng.normal(0.0, maze.cue_noise)
                    grid.signals[channel, row, column] = max(noisy, 0.0)


@compiled_lean
def rewind(maze: Maze) -> None:
    """Put the agent back to its start."""
    agent, goal = maze.grid.agent, maze.goal
    agent[ROW], agent[COLUMN], agent[STEPS] = goal[START_ROW], goal[START_COLUMN], 0


@compiled_lean
def observe(maze: Maze, observation: NDArray[np.float64]) -> None:
    """Write the cues of the four neighbours."""
    sense(maze.grid.signals, maze.grid.agent, observation)


@compiled_lean
def step(maze: Maze, action: NDArray[np.float64], terms: NDArray[np.float64]) -> int:
    """One move; `terms` become the rewards of time and progress, 0 before the last step."""
    terms[:] = 0.0
    if not move(maze.grid.path, maze.grid.agent, action):
        return FAILED
    agent, goal = maze.grid.agent, maze.goal
    distance = maze.distances[agent[ROW], agent[COLUMN]]
    late = agent[STEPS] - goal[FASTEST]
    if distance > 0 and late < SPARE_STEPS:
        return RUNNING
    if distance == 0:
        terms[0] = maze.time_share * (1.0 - late / SPARE_STEPS)
    terms[1] = (1.0 - maze.time_share) * (1.0 - distance / goal[FURTHEST])
    return ENDED


@compiled
def locate(maze: Maze, row: NDArray[np.float64]) -> None:
    """Write row and column of the agent, then of the goal."""
    row[0] = maze.grid.agent[ROW]
    row[1] = maze.grid.agent[COLUMN]
    row[2] = maze.goal[GOAL_ROW]
    row[3] = maze.goal[GOAL_COLUMN]
