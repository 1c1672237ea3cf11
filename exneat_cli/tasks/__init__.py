"""What an agent senses and drives, and what counts as good. Knows nothing of networks."""

from exneat_cli.tasks.ant import AntTask
from exneat_cli.tasks.task import ENDED, FAILED, RUNNING, Sector, Simulation, Task

TASKS: dict[str, type[AntTask]] = {"ant": AntTask}
"""Every task by the name it has in `conf/task`."""

__all__ = ["ENDED", "FAILED", "RUNNING", "TASKS", "AntTask", "Sector", "Simulation", "Task"]
