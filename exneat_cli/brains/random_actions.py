"""The baseline that acts at random: uniform between each actuator's bounds, whatever it senses."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from exneat_cli.tasks.compiling import compiled


class RandomActions(NamedTuple):
    """Bounds of the action, (A,) each."""

    low: NDArray[np.float64]
    high: NDArray[np.float64]


@compiled
def fresh_memory(brain: RandomActions) -> NDArray[np.float64]:
    """Nothing to remember."""
    return np.zeros(0)


@compiled
def activate(
    brain: RandomActions,
    memory: NDArray[np.float64],
    observation: NDArray[np.float64],
    action: NDArray[np.float64],
    rng: Generator,
) -> None:
    """Overwrite `action`, (A,), with a fresh draw."""
    for i in range(action.size):
        action[i] = rng.uniform(brain.low[i], brain.high[i])
