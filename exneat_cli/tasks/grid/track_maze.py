"""The track: one corridor, and two channels of cues of which only one tells where the goal is.

The agent starts in the middle; the goal is at the left or right end with equal chance. One channel, drawn per maze,
leads: it rises from 0.1 beside the start to 0.5 at the goal, on the goal's side alone. The other misleads with
the same ramp on both sides.

Observation and action, index by index: `exneat_cli.tasks.grid.world`. Scoring: `exneat_cli.tasks.grid.maze`.
Source: Zhang (2025), section 3.2.1.
"""

from __future__ import annotations

from dataclasses import dataclass

from numpy.random import Generator

from exneat_cli.compiling import compiled
from exneat_cli.errors import check_choice, check_whole
from exneat_cli.tasks.grid.maze import Maze, MazeTask, add_cue_noise, begin
from exneat_cli.tasks.task import Simulation

LEAST_CUE, MOST_CUE = 0.1, 0.5
"""Ends of the ramp, from the tile beside the start to the goal."""


@dataclass(frozen=True)
class TrackMaze(MazeTask):
    """Parameters of the track.

    Attributes:
        name: always ``track_maze``.
        size: tiles per side, odd, 5 to 99; the track is size - 2 tiles long.
        gap: tiles before the goal on which both channels are silent, 0 to (size - 3) / 2.
        cue_noise: sd of normal noise on the cues of path tiles; cues stay at least 0.
        fitness: ``time_and_progress``, or ``time`` alone.

    Raises:
        ConfigError: a value is out of range.
    """

    name: str = "track_maze"
    size: int = 13
    gap: int = 0
    cue_noise: float = 0.0
    fitness: str = "time_and_progress"

    def __post_init__(self) -> None:
        check_choice("task.name", self.name, ["track_maze"])
        self._check_maze()
        check_whole("task.gap", self.gap, 0, (self.size - 3) // 2)

    def open(self, *, training: bool) -> Simulation:
        """Open a new track."""
        return self._open(reset)


@compiled
def reset(maze: Maze, rng: Generator) -> None:
    """Draw a track: goal left or right, and which channel leads."""
    size = maze.path.shape[0]
    middle = size // 2
    reach = middle - 1  # tiles from the start to either end
    # The only path is the middle row.
    maze.path[:] = 0
    maze.path[middle, 1 : size - 1] = 1
    side = 1 if rng.random() < 0.5 else -1
    leading = 0 if rng.random() < 0.5 else 1
    # The k-th tile from the start: the leading channel speaks on the goal's side, the other one on both.
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
