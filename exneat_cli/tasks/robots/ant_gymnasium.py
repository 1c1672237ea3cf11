"""Ant's episode over `gymnasium.make("Ant-v5")`, for machines on which compiled code cannot call MuJoCo.

Same functions as `exneat_cli.tasks.robots.dynamics`, same draws, same results; only slower, and threads do
not help since Python holds the GIL.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from exneat_cli.tasks.task import ENDED, FAILED, RUNNING

REWARD_TERMS = ("reward_forward", "reward_survive", "reward_ctrl", "reward_contact")
"""Gymnasium's names of the terms, in the order of `exneat_cli.tasks.robots.ant.AntTask.terms`."""


class GymnasiumAnt:
    """One environment, and the state of early stopping.

    Args:
        max_steps: control steps after which an episode ends.
        progress, patience: an episode ends after `patience` steps (0: never) without `progress` metres.
        options: passed on to the environment, e.g. `reset_noise_scale`.
    """

    def __init__(self, max_steps: int, progress: float, patience: int, **options: Any) -> None:
        self.env = gymnasium.make("Ant-v5", max_episode_steps=max_steps, disable_env_checker=True, **options)
        self.progress = progress
        self.patience = patience
        self.observation = np.zeros(0)
        self.state_at_reset: Mapping[str, Any] = {}
        self.mark = 0.0
        self.stuck_steps = 0

    @property
    def position(self) -> NDArray[np.float64]:
        """x, y and z of the trunk in metres."""
        return np.array(self.env.unwrapped.data.xpos[1])  # type: ignore[attr-defined]

    @property
    def warnings(self) -> int:
        """MuJoCo's warnings so far, of all kinds."""
        return int(self.env.unwrapped.data.warning.number.sum())  # type: ignore[attr-defined]


def reset(world: GymnasiumAnt, rng: Generator) -> None:
    """Put the body near its initial pose, drawing from `rng`."""
    world.env.unwrapped.np_random = rng
    world.state_at_reset = rng.bit_generator.state
    rewind(world)


def rewind(world: GymnasiumAnt) -> None:
    """Put the body back to where the last reset had put it, by drawing the same again."""
    world.env.unwrapped.np_random.bit_generator.state = world.state_at_reset
    world.observation, _ = world.env.reset()
    world.mark = float(world.position[0])
    world.stuck_steps = 0


def observe(world: GymnasiumAnt, observation: NDArray[np.float64]) -> None:
    """Write Gymnasium's observation."""
    observation[:] = world.observation


def step(world: GymnasiumAnt, action: NDArray[np.float64], terms: NDArray[np.float64]) -> int:
    """One control step; `terms` become forward, healthy, control and contact reward of this step."""
    if not np.isfinite(action).all():
        return FAILED
    world.observation, _, terminated, truncated, info = world.env.step(action)
    if world.warnings or not np.isfinite(world.observation).all():
        return FAILED
    terms[:] = [info[name] for name in REWARD_TERMS]
    x = float(world.position[0])
    if x >= world.mark + world.progress:
        world.mark = x
        world.stuck_steps = 0
    else:
        world.stuck_steps += 1
    stuck = world.patience > 0 and world.stuck_steps >= world.patience
    return ENDED if terminated or truncated or stuck else RUNNING


def locate(world: GymnasiumAnt, row: NDArray[np.float64]) -> None:
    """Write x, y and z of the trunk in metres."""
    row[:] = world.position
