"""Grid worlds as Gymnasium environments: the same compiled functions, one step at a time."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from exneat_cli.tasks import TASKS
from exneat_cli.tasks.grid.picture import coloured, enlarged
from exneat_cli.tasks.grid.world import MOVES, GridTask
from exneat_cli.tasks.task import RUNNING

PIXELS_PER_TILE = 16


class GridEnvironment(gymnasium.Env[NDArray[np.float64], np.int64]):
    """One grid world.

    For the observation, (8,) in [0, 1], and the five actions see `exneat_cli.tasks.grid.world`. Rewards add up to the
    episode's fitness, which is paid at the last step; `info` has the terms. The step budget belongs to the world, so
    episodes terminate and are never truncated.

    Args:
        task: a grid world's name in `exneat_cli.tasks.TASKS`.
        render_mode: ``rgb_array`` or ``ansi``.
        parameters: fields of the world's dataclass, e.g. ``size=17``.

    Raises:
        ConfigError: a parameter is out of range.
    """

    metadata = {  # noqa: RUF012 - Gymnasium declares it without ClassVar
        "render_modes": ["rgb_array", "ansi"],
        "render_fps": 4,
    }

    def __init__(self, task: str, render_mode: str | None = None, **parameters: Any) -> None:
        made = TASKS[task](**parameters)
        assert isinstance(made, GridTask)
        self.task = made
        self.render_mode = render_mode
        self.observation_space = gymnasium.spaces.Box(0.0, 1.0, (made.observation_size,), np.float64)
        self.action_space = gymnasium.spaces.Discrete(len(MOVES))
        self._simulation = made.open(training=False)
        self._observation = np.zeros(made.observation_size)
        self._is_reset = False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float64], dict[str, Any]]:
        """Draw a new world from the environment's own generator."""
        super().reset(seed=seed, options=options)
        self._simulation.reset(self._simulation.world, self.np_random)
        self._is_reset = True
        return self._observe(), {}

    def step(self, action: np.int64) -> tuple[NDArray[np.float64], float, bool, bool, dict[str, Any]]:
        """Move; `action` is an index of `exneat_cli.tasks.grid.world.MOVES`.

        Raises:
            ValueError: there is no such action.
            ResetNeeded: `reset` has not been called yet.
        """
        if not self._is_reset:
            raise gymnasium.error.ResetNeeded("step: expected a call of reset before the first step, got none")
        if not self.action_space.contains(action):
            raise ValueError(f"action: expected a whole number from 0 to {len(MOVES) - 1}, got {action!r}")
        terms = np.zeros(len(self.task.terms))
        values = np.eye(len(MOVES))[action]
        status = self._simulation.step(self._simulation.world, values, terms)
        info = dict(zip(self.task.terms, terms.tolist(), strict=True))
        return self._observe(), float(self.task.fitness_of(terms)), status != RUNNING, False, info

    def render(self) -> Any:
        """The world as an (N * 16, N * 16, 3) picture or as text.

        Red is channel 1, blue channel 2, black wall, green the agent (A), yellow the goal or free prey (o).
        """
        draw: Any = {"ansi": _as_text, "rgb_array": _as_picture}.get(self.render_mode or "")
        if draw is None:
            gymnasium.logger.warn("render() needs a render_mode, rgb_array or ansi, given to gymnasium.make")
            return None
        return draw(*self.task.snapshot(self._simulation.world))

    def _observe(self) -> NDArray[np.float64]:
        self._simulation.observe(self._simulation.world, self._observation)
        return np.clip(self._observation, *self.task.observation_limits)


def _as_text(tiles: NDArray[np.float64], agent: tuple[int, int], targets: list[tuple[int, int]]) -> str:
    signs = np.where(tiles[..., 0] == 1, ".", "#").astype(object)
    for row, column in targets:
        signs[row, column] = "o"
    signs[agent] = "A"
    return "\n".join("".join(row) for row in signs) + "\n"


def _as_picture(
    tiles: NDArray[np.float64], agent: tuple[int, int], targets: list[tuple[int, int]]
) -> NDArray[np.uint8]:
    return enlarged(coloured(tiles, agent, targets), PIXELS_PER_TILE)
