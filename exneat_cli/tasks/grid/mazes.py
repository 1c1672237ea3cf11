"""The multimodal mazes: a track, and a maze of corridors.

Two channels of cues lead to a goal. On the **track** (one corridor, start in its middle, goal at either
end) one channel, drawn per maze, leads: it rises from 0.1 beside the start to 0.5 at the goal, on the
goal's side alone; the other misleads with the same ramp on both sides. In the **general maze** (a spanning
tree of corridors, start and goal in two corners) both channels rise evenly along the way to the goal.

Observation and action, index by index: `exneat_cli.tasks.grid.world`. Scoring: `exneat_cli.tasks.grid.maze_dynamics`.
Source: Zhang (2025), section 3.2.1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

from exneat_cli.errors import ConfigError, check_choice, check_real, check_whole
from exneat_cli.tasks.grid import maze_dynamics
from exneat_cli.tasks.grid.maze_dynamics import SPARE_STEPS, Maze, new_maze
from exneat_cli.tasks.grid.world import GridTask
from exneat_cli.tasks.task import Simulation

TIME_SHARES = {"time_and_progress": 0.5, "time": 1.0}
"""What `task.fitness` may be -> weight of the time term."""


def _check_odd_size(size: object, smallest: int) -> None:
    check_whole("task.size", size, smallest, 99)
    if size % 2 == 0:  # type: ignore[operator]
        raise ConfigError("task.size", f"an odd number of at least {smallest}", size, "walls stand on the even tiles")


class _MazeTask(GridTask):
    size: int
    terms: ClassVar[tuple[str, ...]] = ("time_reward", "progress_reward")

    trace_columns: ClassVar[tuple[str, ...]] = ("row", "column", "goal_row", "goal_column")
    """Row and column of the agent, then of the goal."""

    @property
    def longest_episode(self) -> int:
        """No way leads over more than all tiles."""
        return self.size**2 + SPARE_STEPS


@dataclass(frozen=True)
class TrackMaze(_MazeTask):
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
        _check_odd_size(self.size, 5)
        check_whole("task.gap", self.gap, 0, (self.size - 3) // 2)
        check_real("task.cue_noise", self.cue_noise, 0.0)
        check_choice("task.fitness", self.fitness, list(TIME_SHARES))

    def open(self, *, training: bool) -> Simulation:
        """Open a new track."""
        maze = new_maze(self.size, gap=self.gap, cue_noise=self.cue_noise, time_share=TIME_SHARES[self.fitness])
        return _simulation(maze, maze_dynamics.reset_track)


@dataclass(frozen=True)
class GeneralMaze(_MazeTask):
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
        _check_odd_size(self.size, 5)
        check_real("task.cue_noise", self.cue_noise, 0.0)
        check_real("task.cues_removed", self.cues_removed, 0.0, 1.0)
        check_real("task.walls_removed", self.walls_removed, 0.0, 1.0)
        check_choice("task.fitness", self.fitness, list(TIME_SHARES))

    def open(self, *, training: bool) -> Simulation:
        """Open a new maze."""
        maze = new_maze(
            self.size,
            cue_noise=self.cue_noise,
            cues_removed=self.cues_removed,
            walls_removed=self.walls_removed,
            time_share=TIME_SHARES[self.fitness],
        )
        return _simulation(maze, maze_dynamics.reset_general)


def _simulation(maze: Maze, reset: Callable[..., None]) -> Simulation:
    return Simulation(
        maze, reset, maze_dynamics.rewind, maze_dynamics.observe, maze_dynamics.step, maze_dynamics.locate
    )
