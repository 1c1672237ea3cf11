"""Environments that are registered here alone, each with something that Gymnasium's own lack."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces


class Bounded(gymnasium.Env[Any, Any]):
    """Pays what it is told to do, entry by entry, in a 2 x 2 Box with bounds of every kind; shows 2 x 3 numbers."""

    def __init__(self, fault: str = "", start: int = 0) -> None:
        self.observation_space = spaces.Box(-1.0, 1.0, (2, 3), np.float32)
        low, high = [[0.0, -np.inf], [5.0, -np.inf]], [[10.0, np.inf], [np.inf, 3.0]]
        self.action_space = spaces.Box(np.array(low, np.float32), np.array(high, np.float32), dtype=np.float32)
        self.fault, self.taken = fault, []

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        super().reset(seed=seed)
        if self.fault == "reset":
            raise KeyError("reset")
        self.taken = []
        return self.np_random.normal(size=(2, 3)), {}

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        self.taken.append(action)
        seen, reward = np.arange(6.0).reshape(2, 3), float(action.sum())
        if len(self.taken) == 3:
            if self.fault == "observation":
                seen[1, 1] = np.nan
            if self.fault == "reward":
                reward = np.inf
            if self.fault == "action":
                raise ValueError("no such action")
            if self.fault == "step":
                raise KeyError("step")
            if self.fault == "size":
                seen = np.zeros(5)
        return seen, reward, False, False, {}


class Choosing(gymnasium.Env[Any, Any]):
    """Pays the number of the action, of which there are three from 7 on; ends with 9. Its pictures are wide and red."""

    metadata = {"render_modes": ["rgb_array"], "render_fps": 20}  # noqa: RUF012  Gymnasium's own way

    observation_space = spaces.Box(0, 255, (2,), np.uint8)
    action_space = spaces.Discrete(3, start=7)

    def __init__(self, render_mode: str | None = None, pictures: bool = True) -> None:
        self.render_mode, self.pictures = render_mode, pictures

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        super().reset(seed=seed)
        return np.array([200, 7], np.uint8), {}

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        assert self.action_space.contains(action)
        return np.array([1, 2], np.uint8), float(action), action == 9, False, {}

    def render(self) -> Any:
        return np.full((20, 80, 3), (200, 0, 0), np.uint8 if self.pictures else float)


gymnasium.register("exneat-tests/Bounded-v0", Bounded, max_episode_steps=5)
gymnasium.register("exneat-tests/Choosing-v0", Choosing, max_episode_steps=5)
gymnasium.register("exneat-tests/Endless-v0", Choosing)
