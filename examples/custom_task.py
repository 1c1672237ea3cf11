"""A custom task: a corridor with a lamp at one end, to which two modules learn to walk.

    python examples/custom_task.py train --config-dir examples/conf task=corridor

This file is the program exneat with one additional task; its settings are in conf/task/corridor.yaml.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from exneat_cli.errors import check_choice, check_whole
from exneat_cli.main import main
from exneat_cli.tasks import ENDED, RUNNING, TASKS, Part, Simulation, Task


class World(NamedTuple):
    """State shared by the functions below: the brightness of each tile; the agent's tile and its number of steps."""

    light: NDArray[np.float64]
    agent: NDArray[np.int64]


def reset(world: World, rng: Generator) -> None:
    """Put the lamp at the left or the right end."""
    tiles = np.arange(len(world.light))
    lamp = tiles[0] if rng.random() < 0.5 else tiles[-1]
    world.light[:] = 1.0 / (1.0 + np.abs(tiles - lamp))
    rewind(world)


def rewind(world: World) -> None:
    """Put the agent back in the middle."""
    world.agent[:] = len(world.light) // 2, 0


def observe(world: World, readings: NDArray[np.float64]) -> None:
    """Write the brightness on the left and on the right."""
    tile = world.agent[0]
    readings[:] = world.light[tile - 1], world.light[tile + 1]


def step(world: World, action: NDArray[np.float64], terms: NDArray[np.float64]) -> int:
    """Move to the side with the larger value; reward the brightness when the agent is at an end or out of time."""
    world.agent[0] += np.sign(action[1] - action[0])
    world.agent[1] += 1
    tile, steps = world.agent
    arrived = tile in (0, len(world.light) - 1)
    over = arrived or steps == len(world.light)
    terms[0] = world.light[tile] if over else 0.0
    return ENDED if over else RUNNING


@dataclass(frozen=True)
class Corridor(Task):
    """Parameters of the corridor.

    Attributes:
        name: always ``corridor``.
        length: number of tiles, 3 to 99.

    Raises:
        ConfigError: a value is out of range.
    """

    name: str = "corridor"
    length: int = 9

    terms: ClassVar[tuple[str, ...]] = ("brightness",)
    observation_size: ClassVar[int] = 2
    actuator_names: ClassVar[tuple[str, ...]] = ("left", "right")
    parts: ClassVar[tuple[Part, ...]] = (
        Part("left", sensors=(0,), actuators=(0,), position=(0.0, 1.0)),
        Part("right", sensors=(1,), actuators=(1,), position=(0.0, -1.0)),
    )
    recurrent: ClassVar[bool] = True

    def __post_init__(self) -> None:
        check_choice("task.name", self.name, ["corridor"])
        check_whole("task.length", self.length, 3, 99)

    @property
    def longest_episode(self) -> int:
        """As many steps as there are tiles."""
        return self.length

    def open(self, *, training: bool) -> Simulation:
        """Open a new corridor."""
        world = World(light=np.zeros(self.length), agent=np.zeros(2, np.int64))
        return Simulation(world, reset, rewind, observe, step, compiled=False)


TASKS["corridor"] = Corridor

if __name__ == "__main__":
    raise SystemExit(main())
