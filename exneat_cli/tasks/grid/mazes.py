"""The mazes: a track and a general maze, with two channels of cues that lead to the goal.

The track is one corridor. The agent starts in the middle; the goal is at the left or right end with equal chance. One
channel, drawn per maze, leads: it rises from 0.1 beside the start to 0.5 at the goal, on the goal's side only. The
other one misleads: it has the same ramp on both sides. In the thesis' text, the second channel always leads
(``leading=second``).

The corridors of the general maze, drawn anew for each episode, are a spanning tree over the cells on odd rows and
columns; start and goal are two of the maze's corners. On each channel the cue of a tile is ``(d_max - d) / d_max``
times the channel's weight, where d is its walking distance to the goal and d_max the largest one: from 0 at the
furthest tile to the weight (0.5 by default) at the goal.

For observations and actions see `exneat_cli.tasks.grid.world`, for scoring `exneat_cli.tasks.grid.maze`.
Source: Zhang (2025), section 3.2.1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from exneat_cli.compiling import compiled
from exneat_cli.errors import ConfigError, check_choice, check_real, check_whole
from exneat_cli.tasks.grid.maze import FURTHEST, GOAL_COLUMN, GOAL_ROW, SPARE_STEPS, Maze, begin, locate, rewind, step
from exneat_cli.tasks.grid.world import CHANNELS, COLUMN_STEPS, ROW_STEPS, GridTask, draw_tiles, observe
from exneat_cli.tasks.task import Simulation

LEAST_CUE, MOST_CUE = 0.1, 0.5
"""Ends of the ramp, from the tile beside the start to the goal."""
LEADING = ("random", "second")
TIME_SHARES = {"time_and_progress": 0.5, "time": 1.0}
"""Value of `task.fitness` -> weight of time in the fitness; progress has the rest."""


class MazeTask(GridTask):
    """A maze with the parameters of both kinds; the dataclasses derived from it declare those that apply to them."""

    size: int
    cue_noise: float
    fitness: str
    gap: int = 0
    leading: str = "random"
    cues_removed: float = 0.0
    walls_removed: float = 0.0
    channel_weights: tuple[float, float] = (0.5, 0.5)

    came_later: ClassVar[dict[str, Any]] = {"leading": "random", "channel_weights": (0.5, 0.5)}
    terms: ClassVar[tuple[str, ...]] = ("time_reward", "progress_reward")
    trace_columns: ClassVar[tuple[str, ...]] = ("row", "column", "goal_row", "goal_column")
    """Row and column of the agent, then of the goal."""

    @property
    def longest_episode(self) -> int:
        """An upper bound, as if the way led over all tiles."""
        return self.size**2 + SPARE_STEPS

    def targets(self, world: Any) -> list[tuple[int, int]]:
        """The goal."""
        return [(int(world.goal[GOAL_ROW]), int(world.goal[GOAL_COLUMN]))]

    def __post_init__(self) -> None:
        check_choice("task.name", self.name, [type(self).name])
        check_whole("task.size", self.size, 5, 99)
        if self.size % 2 == 0:
            raise ConfigError("task.size", "an odd number of at least 5", self.size, "walls stand on the even tiles")
        check_real("task.cue_noise", self.cue_noise, 0.0)
        check_choice("task.fitness", self.fitness, list(TIME_SHARES))
        check_whole("task.gap", self.gap, 0, (self.size - 3) // 2)
        check_real("task.cues_removed", self.cues_removed, 0.0, 1.0)
        check_real("task.walls_removed", self.walls_removed, 0.0, 1.0)
        check_choice("task.leading", self.leading, LEADING)
        weights = self.channel_weights
        if not isinstance(weights, list | tuple) or len(weights) != CHANNELS:
            raise ConfigError("task.channel_weights", "two numbers, e.g. [0.5, 0.5]", weights)
        for weight in weights:
            check_real("task.channel_weights", weight, 0.0, 1.0)
        object.__setattr__(self, "channel_weights", tuple(map(float, weights)))

    def _open(self, reset: Callable[..., Any]) -> Simulation:
        tiles = (self.size, self.size)
        maze = Maze(
            path=np.zeros(tiles, np.int64),
            signals=np.zeros((CHANNELS, *tiles)),
            agent=np.zeros(3, np.int64),
            distances=np.zeros(tiles, np.int64),
            goal=np.zeros(6, np.int64),
            time_share=TIME_SHARES[self.fitness],
            # An integer would be another type, for which the functions would be compiled again.
            cue_noise=float(self.cue_noise),
            gap=self.gap,
            second_leads=self.leading == "second",
            weights=self.channel_weights,
            cues_removed=float(self.cues_removed),
            walls_removed=float(self.walls_removed),
        )
        return Simulation(maze, reset, rewind, observe, step, locate)


@dataclass(frozen=True)
class TrackMaze(MazeTask):
    """Parameters of the track.

    Attributes:
        name: always ``track_maze``.
        size: tiles per side, odd, 5 to 99; the track is size - 2 tiles long.
        gap: tiles before the goal on which both channels are silent, 0 to (size - 3) / 2.
        leading: which channel leads: ``random``, drawn for each track, or ``second``.
        cue_noise: sd of normal noise on the cues of path tiles; cues stay at least 0.
        fitness: ``time_and_progress``, or ``time`` alone.

    Raises:
        ConfigError: a value is out of range.
    """

    name: str = "track_maze"
    size: int = 13
    gap: int = 0
    leading: str = "random"
    cue_noise: float = 0.0
    fitness: str = "time_and_progress"

    def open(self, *, training: bool) -> Simulation:
        """Open a new track."""
        return self._open(draw_track)


@dataclass(frozen=True)
class GeneralMaze(MazeTask):
    """Parameters of the general maze.

    Attributes:
        name: always ``general_maze``.
        size: tiles per side, odd, 5 to 99.
        cue_noise: sd of normal noise on the cues of path tiles; cues stay at least 0.
        cues_removed: share of path tiles without cues, 0 to 1.
        walls_removed: share of walls between cells that are opened, 0 to 1.
        channel_weights: weights of the cues on the two channels, each 0 to 1.
        fitness: ``time_and_progress``, or ``time`` alone.

    Raises:
        ConfigError: a value is out of range.
    """

    name: str = "general_maze"
    size: int = 11
    cue_noise: float = 0.0
    cues_removed: float = 0.0
    walls_removed: float = 0.0
    channel_weights: tuple[float, float] = (0.5, 0.5)
    fitness: str = "time_and_progress"

    def open(self, *, training: bool) -> Simulation:
        """Open a new maze."""
        return self._open(draw_maze)


@compiled
def draw_track(maze: Maze, rng: Generator) -> None:
    """Draw a track: goal left or right, and which channel leads."""
    size = maze.path.shape[0]
    middle = size // 2
    reach = middle - 1  # tiles from the start to either end
    # The only path is the middle row.
    maze.path[:] = 0
    maze.path[middle, 1 : size - 1] = 1
    side = 1 if rng.random() < 0.5 else -1
    leading = 0 if rng.random() < 0.5 and not maze.second_leads else 1
    # The k-th tile from the start: the leading channel has cues on the goal's side only, the other one on both.
    maze.signals[:] = 0.0
    for k in range(1, reach + 1):
        cue = MOST_CUE if reach == 1 else LEAST_CUE + (MOST_CUE - LEAST_CUE) * (k - 1) / (reach - 1)
        maze.signals[leading, middle, middle + side * k] = cue
        maze.signals[1 - leading, middle, middle + k] = cue
        maze.signals[1 - leading, middle, middle - k] = cue
    # The gap: both channels are silent before the goal, but not on the goal itself.
    for k in range(max(0, reach - maze.gap), reach):
        maze.signals[:, middle, middle + side * k] = 0.0
    add_cue_noise(maze, rng)
    begin(maze, (middle, middle), (middle, middle + side * reach))


@compiled
def draw_maze(maze: Maze, rng: Generator) -> None:
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
                nearness = (furthest - maze.distances[row, column]) / furthest
                for channel in range(CHANNELS):
                    maze.signals[channel, row, column] = nearness * maze.weights[channel]
    # Tiles without cues get noise like all others.
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
        # The step by which a cell is first entered belongs to the tree.
        if path[next_row, next_column] == 0:
            path[next_row, next_column] = 1
            path[(row + next_row) // 2, (column + next_column) // 2] = 1
            left -= 1
        row, column = next_row, next_column


@compiled
def remove_walls(maze: Maze, rng: Generator) -> None:
    """Open a share of the walls that stand between two cells."""
    # A wall between two cells has one odd coordinate; a tile whose coordinates are both even is a pillar.
    walls, size = np.zeros_like(maze.path), maze.path.shape[0]
    for row in range(1, size - 1):
        for column in range(1 + row % 2, size - 1, 2):
            walls[row, column] = 1 - maze.path[row, column]
    opened = draw_tiles(walls, int(np.rint(maze.walls_removed * walls.sum())), rng)
    for k in range(opened.shape[0]):
        maze.path[opened[k, 0], opened[k, 1]] = 1


@compiled
def add_cue_noise(maze: Maze, rng: Generator) -> None:
    """Add noise to the cues of path tiles, in the order of rows, columns and channels; cues stay at least 0."""
    if maze.cue_noise == 0.0:  # then no numbers are drawn
        return
    for row in range(maze.path.shape[0]):
        for column in range(maze.path.shape[0]):
            if maze.path[row, column] == 1:
                for channel in range(CHANNELS):
                    noisy = maze.signals[channel, row, column] + rng.normal(0.0, maze.cue_noise)
                    maze.signals[channel, row, column] = max(noisy, 0.0)
