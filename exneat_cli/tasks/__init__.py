"""Tasks: what an agent senses and drives, and how it is scored. Nothing here knows about networks.

Importing this package registers the grid worlds with Gymnasium, e.g. ``exneat/TrackMaze-v0``.
"""

import gymnasium

from exneat_cli.tasks.capabilities import (
    HasAdapter,
    HasBatch,
    HasDistance,
    HasFullReward,
    HasInitialPose,
    HasPicture,
    HasTiles,
)
from exneat_cli.tasks.grid.mazes import GeneralMaze, TrackMaze
from exneat_cli.tasks.grid.predator_prey import Foraging, Hunting
from exneat_cli.tasks.grid.world import GridTask
from exneat_cli.tasks.gym import GymTask
from exneat_cli.tasks.robots.ant import AntTask
from exneat_cli.tasks.robots.robot import RobotTask
from exneat_cli.tasks.task import ENDED, FAILED, RUNNING, Adapter, Camera, Part, Simulation, Task, setting

TASKS: dict[str, type[Task]] = {
    "ant": AntTask,
    "robot": RobotTask,
    "track_maze": TrackMaze,
    "general_maze": GeneralMaze,
    "foraging": Foraging,
    "hunting": Hunting,
    "gym": GymTask,
}
"""Every task by the name it has in `conf/task`."""

for _name, _task in TASKS.items():
    if issubclass(_task, GridTask):
        gymnasium.register(
            id=f"exneat/{_task.__name__}-v0",
            entry_point="exneat_cli.tasks.grid.environment:GridEnvironment",
            kwargs={"task": _name},
        )
