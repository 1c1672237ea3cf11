"""The general maze: corridors drawn anew for each episode, and two channels of cues that both lead to the goal.

The corridors are a spanning tree over the cells on odd rows and columns; start and goal are two of the maze's
corners. On both channels the cue of a tile is ``(d_max - d) / d_max / 2``, d its walking distance to the goal and
d_max the largest one: from 0 at the furthest tile to 0.5 at the goal.

Observation and action, index by index: `exneat_cli.tasks.grid.world`. Scoring: `exneat_cli.tasks.grid.maze`.
Source: Zhang (2025), section 3.2.1.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from exneat_cli.compiling import compiled
from exneat_cli.errors import check_choice, check_real
from exneat_cli.tasks.grid.maze import (
    FURTHEST,
    TERMS,
    TRACE_COLUMNS,
    Maze,
    add_cue_noise,
    begin,
    check_maze,
    goal_of,
    longest_way,
    open_maze,
)
from exneat_cli.tasks.grid.world import COLUMN_STEPS, ROW_STEPS, GridTask
from exneat_cli.tasks.task import Simulation


@dataclass(frozen=True)
class GeneralMaze(GridTask):
    """Parameters of the general maze.

    Attributes:
        name: always ``general_maze``.
        size: tiles per side, odd, 5 to 99.
        cue_noise: sd of normal noise on the cues of path tiles; cues stay at least 0.
        cues_removed: share of path tiles without cues, 0 to 1.
        walls_removed: share of walls between cells that are opened, 0 to 1.
        fitness: ``time_and_progress``, or ``time`` alone.

    Raises:
        ConfigError: a value is out of range.
    """

    name: str = "general_maze"
    size: int = 11
    cue_noise: float = 0.0
    cues_removed: float = 0.0
    walls_removed: float = 0.0
    fitness: str = "time_and_progress"

    terms: ClassVar[tuple[str, ...]] = TERMS
    trace_columns: ClassVar[tuple[str, ...]] = TRACE_COLUMNS

    def __post_init__(self) -> None:
        check_choice("task.name", self.name, ["general_maze"])
        check_maze(self.size, self.cue_noise, self.fitness)
        check_real("task.cues_removed", self.cues_removed, 0.0, 1.0)
        check_real("task.walls_removed", self.walls_removed, 0.0, 1.0)

    @property
    def longest_episode(self) -> int:
        """Steps that no episode exceeds."""
        return longest_way(self.size)

    def open(self, *, training: bool) -> Simulation:
        """Open a new maze."""
        return open_maze(
            reset,
            self.size,
            self.cue_noise,
            self.fitness,
            cues_removed=self.cues_removed,
            walls_removed=self.walls_removed,
        )

    def targets(self, world: Any) -> list[tuple[int, int]]:
        """The goal."""
        return [goal_of(world)]


@compiled
def reset(maze: Maze, rng: Generator) -> None:
    """Draw a perfect maze, start and goal in two of its corners, and the cues towards the goal."""
    size = maze.path.shape[0]
    carve(maze.path, rng)
    remove_walls(maze, rng)
    # The start is any corner but the goal's.
    goal = int(rng.integers(0, 4))
    start = (goal + 1 + int(rng.integers(0, 3))) % 4
    begin(maze, corner(start, size), corner(goal, size))
    furthest = maze.goal[FURTHEST]
    maze.signals[:] = 0.0
    for row in range(size):
        for column in range(size):
            if maze.path[row, column] == 1:
                maze.signals[:, row, column] = (furthest - maze.distances[row, column]) / furthest / 2.0
    # Tiles that lost their cue get noise as all others do.
    remove_cues(maze, rng)
    add_cue_noise(maze, rng)


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
    left = cells * cells - 1  # cells not visited yet
    while left > 0:
        # Walk at random from cell to cell; a step that would leave the maze is drawn again.
        side = int(rng.integers(0, 4))
        next_row, next_column = row + 2 * ROW_STEPS[side], column + 2 * COLUMN_STEPS[side]
        if next_row < 0 or next_column < 0 or next_row >= path.shape[0] or next_column >= path.shape[0]:
            continue
        # The way by which a cell is entered for the first time belongs to the tree.
        if path[next_row, next_column] == 0:
            path[next_row, next_column] = 1
            path[(row + next_row) // 2, (column + next_column) // 2] = 1
            left -= 1
        row, column = next_row, next_column


@compiled
def corner(index: int, size: int) -> tuple[int, int]:
    """Row and column of corner 0 to 3: the upper left and right one, then the lower ones."""
    row = 1 if index < 2 else size - 2
    column = 1 if index % 2 == 0 else size - 2
    return row, column


@compiled
def remove_walls(maze: Maze, rng: Generator) -> None:
    """Open a share of the walls that stand between two cells."""
    if maze.walls_removed == 0.0:  # draws nothing then
        return
    path, count = maze.path, 0
    for row in range(1, path.shape[0] - 1):
        for column in range(1, path.shape[0] - 1):
            # Between two cells one of the coordinates is odd; where both are even stands a pillar.
            if path[row, column] == 0 and (row + column) % 2 == 1:
                maze.queue[count, 0], maze.queue[count, 1] = row, column
                count += 1
    for k in range(draw_share(maze.queue, count, maze.walls_removed, rng)):
        path[maze.queue[k, 0], maze.queue[k, 1]] = 1


@compiled
def remove_cues(maze: Maze, rng: Generator) -> None:
    """Silence both channels on a share of all path tiles."""
    if maze.cues_removed == 0.0:  # draws nothing then
        return
    path, count = maze.path, 0
    for row in range(path.shape[0]):
        for column in range(path.shape[0]):
            if path[row, column] == 1:
                maze.queue[count, 0], maze.queue[count, 1] = row, column
                count += 1
    for k in range(draw_share(maze.queue, count, maze.cues_removed, rng)):
        maze.signals[:, maze.queue[k, 0], maze.queue[k, 1]] = 0.0


@compiled
def draw_share(tiles: NDArray[np.int64], count: int, share: float, rng: Generator) -> int:
    """Bring a random share of the first `count` tiles, (tiles, 2), to the front; returns how many."""
    chosen = int(np.rint(share * count))
    # The first steps of a Fisher-Yates shuffle.
    for k in range(chosen):
        other = k + int(rng.integers(0, count - k))
        for axis in range(2):
            tiles[k, axis], tiles[other, axis] = tiles[other, axis], tiles[k, axis]
    return chosen
