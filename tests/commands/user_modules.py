"""Tasks of users in modules of the current directory, and a process that has not heard of them."""

from __future__ import annotations

import sys
from pathlib import Path

from exneat_cli.tasks.user_code import NAMED

EXAMPLE = Path(__file__).parents[2] / "examples" / "custom_task.py"
CORRIDOR = EXAMPLE.read_text(encoding="utf-8").replace('TASKS["corridor"] = Corridor', "")
"""The example's task, which does not register itself."""
COMPILED = """
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from exneat_cli.compiling import compiled_lean
from exneat_cli.main import main
from exneat_cli.tasks import ENDED, RUNNING, TASKS, Part, Simulation, Task


class World(NamedTuple):
    place: np.ndarray
    length: int


@compiled_lean
def rewind(world):
    world.place[0] = world.length // 2


@compiled_lean
def reset(world, rng):
    world.place[1] = 0 if rng.random() < 0.5 else world.length - 1
    rewind(world)


@compiled_lean
def observe(world, readings):
    readings[0] = 1.0 if world.place[1] == 0 else 0.0
    readings[1] = 1.0 - readings[0]


@compiled_lean
def step(world, action, terms):
    world.place[0] += 1 if action[1] > action[0] else -1
    terms[0] = 1.0 if world.place[0] == world.place[1] else 0.0
    return ENDED if world.place[0] in (0, world.length - 1) else RUNNING


@dataclass(frozen=True)
class Corridor(Task):
    name: str = "corridor"
    length: int = 3
    terms = ("arrived",)
    observation_size, longest_episode = 2, 1
    actuator_names = ("left", "right")
    parts = (Part("left", (0,), (0,), (0.0, 1.0)), Part("right", (1,), (1,), (0.0, -1.0)))
    recurrent = True

    def open(self, *, training):
        return Simulation(World(np.zeros(2, np.int64), self.length), reset, rewind, observe, step)


TASKS["corridor"] = Corridor
if __name__ == "__main__":
    raise SystemExit(main())
"""
"""A program that registers a task of compiled functions."""
MARK = '\nfrom pathlib import Path\nPath("imported").touch()\nprint("imported")\n'


def forget_user_code() -> None:
    """Be as a new process, for which its user has named nothing."""
    NAMED.clear()
    for name, module in list(sys.modules.items()):
        if str(getattr(module, "__file__", None) or "").startswith(str(Path.cwd())):
            del sys.modules[name]
