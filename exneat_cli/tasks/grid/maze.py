"""What both mazes share: the way to the goal, scoring, and the compiled episode after its reset.

A maze is solved when the agent stands on the goal. The episode ends there, or `t_fast + SPARE_STEPS` steps
after its start, `t_fast` being the walking distance from start to goal. Its fitness, paid at the last
step, is ``0.5 * time + 0.5 * progress``:

* time = 1 - (t - t_fast) / SPARE_STEPS if solved at step t, else 0
* progress = 1 - d(end) / d_max, d the walking distance to the goal, d_max its largest value in the maze

Standing still on a track scores 0.25. The formula printed in the thesis (Zhang, 2025, section 3.2.1) has
the sign of the time term reversed: taken literally, a failure would score over 0.7.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from exneat_cli.compiling import compiled, compiled_lean
from exneat_cli.errors import ConfigError, check_choice, check_real, check_whole
from exneat_cli.tasks.grid.world import CHANNELS, COLUMN, COLUMN_STEPS, ROW, ROW_STEPS, STEPS, move, sense_neighbours
from exneat_cli.tasks.task import ENDED, FAILED, RUNNING, Simulation

SPARE_STEPS = 2
"""Steps allowed beyond the fastest way (Zhang, 2025, section 3.2.1)."""
TIME_SHARES = {"time_and_progress": 0.5, "time": 1.0}
"""What `task.fitness` may be -> weight of time in the fitness; progress has the rest."""
TERMS = ("time_reward", "progress_reward")
TRACE_COLUMNS = ("row", "column", "goal_row", "goal_column")
"""Of the agent, then of the goal."""
GOAL_ROW, GOAL_COLUMN, FASTEST, FURTHEST, START_ROW, START_COLUMN = range(6)
"""Entries of `Maze.goal`: where it is, walking distance from the start, largest distance in the maze, the start."""


class Maze(NamedTuple):
    """A maze of N x N tiles, and what its kind is made from.

    Attributes:
        path, signals, agent: see `exneat_cli.tasks.grid.world.GridTask`.
        distances: (N, N) walking distances to the goal, -1 on walls.
        queue: (N * N, 2) scratch.
        goal: see `GOAL_ROW`.
        time_share: see `TIME_SHARES`.
        cue_noise: sd of the noise on the cues of path tiles.
        gap: silent tiles before the goal of a track.
        cues_removed, walls_removed: shares of a general maze's cues and inner walls.
    """

    path: NDArray[np.int64]
    signals: NDArray[np.float64]
    agent: NDArray[np.int64]
    distances: NDArray[np.int64]
    queue: NDArray[np.int64]
    goal: NDArray[np.int64]
    time_share: float
    cue_noise: float
    gap: int
    cues_removed: float
    walls_removed: float


def check_maze(size: int, cue_noise: float, fitness: str) -> None:
    """Refuse what no maze can have.

    Raises:
        ConfigError: a value is out of range.
    """
    check_whole("task.size", size, 5, 99)
    if size % 2 == 0:
        raise ConfigError("task.size", "an odd number of at least 5", size, "walls stand on the even tiles")
    check_real("task.cue_noise", cue_noise, 0.0)
    check_choice("task.fitness", fitness, list(TIME_SHARES))


def open_maze(
    reset: Callable[[Maze, Generator], None],
    size: int,
    cue_noise: float,
    fitness: str,
    *,
    gap: int = 0,
    cues_removed: float = 0.0,
    walls_removed: float = 0.0,
) -> Simulation:
    """Open a maze of size x size tiles that `reset` draws; for the rest see `Maze`."""
    maze = Maze(
        path=np.zeros((size, size), np.int64),
        signals=np.zeros((CHANNELS, size, size)),
        agent=np.zeros(3, np.int64),
        distances=np.zeros((size, size), np.int64),
        queue=np.zeros((size * size, 2), np.int64),
        goal=np.zeros(6, np.int64),
        time_share=TIME_SHARES[fitness],
        # A whole number would be another type to the compiler, and compiled apart.
        cue_noise=float(cue_noise),
        gap=gap,
        cues_removed=float(cues_removed),
        walls_removed=float(walls_removed),
    )
    return Simulation(maze, reset, rewind, observe, step, locate)


def longest_way(size: int) -> int:
    """Steps that no episode exceeds: no way leads over more than all tiles."""
    return size**2 + SPARE_STEPS


def goal_of(maze: Maze) -> tuple[int, int]:
    """Row and column of the goal."""
    return int(maze.goal[GOAL_ROW]), int(maze.goal[GOAL_COLUMN])


@compiled
def begin(maze: Maze, start: tuple[int, int], goal: tuple[int, int]) -> None:
    """Set start and goal, (row, column) of path tiles, measure all ways, and put the agent to the start."""
    maze.goal[START_ROW], maze.goal[START_COLUMN] = start
    maze.goal[GOAL_ROW], maze.goal[GOAL_COLUMN] = goal
    maze.goal[FURTHEST] = measure_distances(maze.path, goal, maze.distances, maze.queue)
    maze.goal[FASTEST] = maze.distances[start]
    rewind(maze)


@compiled
def measure_distances(
    path: NDArray[np.int64], goal: tuple[int, int], distances: NDArray[np.int64], queue: NDArray[np.int64]
) -> int:
    """Write the walking distance of every path tile to `goal`, -1 where there is no way.

    Args:
        path: (N, N).
        goal: row and column of a path tile.
        distances: (N, N), overwritten.
        queue: (N * N, 2), scratch.

    Returns:
        The largest distance.
    """
    # Breadth first: tiles leave the queue in the order of their distance, so the last one is the furthest.
    distances[:] = -1
    distances[goal] = 0
    queue[0, 0], queue[0, 1] = goal
    head, tail = 0, 1
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


@compiled
def add_cue_noise(maze: Maze, rng: Generator) -> None:
    """Add noise to the cues of path tiles, in the order of rows, columns and channels; cues stay at least 0."""
    if maze.cue_noise == 0.0:  # draws nothing then
        return
    for row in range(maze.path.shape[0]):
        for column in range(maze.path.shape[0]):
            if maze.path[row, column] == 1:
                for channel in range(CHANNELS):
                    noisy = maze.signals[channel, row, column] + rng.normal(0.0, maze.cue_noise)
                    maze.signals[channel, row, column] = max(noisy, 0.0)


@compiled_lean
def rewind(maze: Maze) -> None:
    """Put the agent back to its start."""
    agent, goal = maze.agent, maze.goal
    agent[ROW], agent[COLUMN], agent[STEPS] = goal[START_ROW], goal[START_COLUMN], 0


@compiled_lean
def observe(maze: Maze, observation: NDArray[np.float64]) -> None:
    """Write the cues of the four neighbours."""
    sense_neighbours(maze.signals, maze.agent, observation)


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
    # Time counts for those who arrive, progress for everybody.
    if distance == 0:
        terms[0] = maze.time_share * (1.0 - late / SPARE_STEPS)
    terms[1] = (1.0 - maze.time_share) * (1.0 - distance / goal[FURTHEST])
    return ENDED


@compiled
def locate(maze: Maze, row: NDArray[np.float64]) -> None:
    """Write row and column of the agent, then of the goal, in the order of `TRACE_COLUMNS`."""
    row[0] = maze.agent[ROW]
    row[1] = maze.agent[COLUMN]
    row[2] = maze.goal[GOAL_ROW]
    row[3] = maze.goal[GOAL_COLUMN]
