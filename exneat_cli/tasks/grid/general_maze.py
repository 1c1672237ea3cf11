"""The general maze: corridors drawn anew for each episode, and two channels of cues that both lead to the goal.

The corridors are a spanning tree over the cells on odd rows and columns; start and goal are two of the maze's
corners. On both channels the cue of a tile is ``(d_max - d) / d_max / 2``, d its walking distance to the goal and
d_max the largest one: from 0 at the furthest tile to 0.5 at the goal.

Observation and action, index by index: `exneat_cli.tasks.grid.world`. Scoring: `exneat_cli.tasks.grid.maze`.
Source: Zhang (2025), section 3.2.1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from exneat_cli.compiling import compiled
from exneat_cli.errors import check_choice, check_real
from exneat_cli.tasks.grid.maze import FURTHEST, Maze, MazeTask, add_cue_noise, begin
from exneat_cli.tasks.grid.world import COLUMN_STEPS, ROW_STEPS, draw_tiles
from exneat_cli.tasks.task import Simulation


@dataclass(frozen=True)
class GeneralMaze(MazeTask):
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

    def __post_init__(self) -> None:
        check_choice("task.name", self.name, ["general_maze"])
        self._check_maze()
        check_real("task.cues_removed", self.cues_removed, 0.0, 1.0)
        check_real("task.walls_removed", self.walls_removed, 0.0, 1.0)

    def open(self, *, training: bool) -> Simulation:
        """Open a new maze."""
        return self._open(reset)


@compiled
def reset(maze: Maze, rng: Generator) -> None:
    """Draw a perfect maze, start and goal in two of its corners, and the cues towards the goal."""
    size = maze.path.shape[0]
    carve(maze.path, rng)
    remove_walls(maze, rng)
    # Corners 0 and 1 are the upper ones, 2 and 3 the lower ones; the start is any but the goal's.
    goal = int(rng.integers(0, 4))
    start = (goal + 1 + int(rng.integers(0, 3))) % 4
    far = size - 3  # from one corner to the next
    begin(maze, start=(1 + start // 2 * far, 1 + start % 2 * far), goal=(1 + goal // 2 * far, 1 + goal % 2 * far))
    furthest = maze.goal[FURTHEST]
    maze.signals[:] = 0.0
    for row in range(size):
        for column in range(size):
            if maze.path[row, column] == 1:
                maze.signals[:, row, column] = (furthest - maze.distances[row, column]) / furthest / 2.0
    # Tiles that lost their cue get noise as all others do.
    silent = draw_tiles(maze.path, int(np.rint(maze.cues_removed * maze.path.sum())), rng)
    for k in range(silent.shape[0]):
        maze.signals[:, silent[k, 0], silent[k, 1]] = 0.0
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
def remove_walls(maze: Maze, rng: Generator) -> None:
    """Open a share of the walls that stand between two cells."""
    # A wall between two cells has one odd coordinate; where both are even stands a pillar.
    walls, size = np.zeros_like(maze.path), maze.path.shape[0]
    for row in range(1, size - 1):
        for column in range(1 + row % 2, size - 1, 2):
            walls[row, column] = 1 - maze.path[row, column]
    opened = draw_tiles(walls, int(np.rint(maze.walls_removed * walls.sum())), rng)
    for k in range(opened.shape[0]):
        maze.path[opened[k, 0], opened[k, 1]] = 1
