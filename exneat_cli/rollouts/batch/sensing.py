"""Statistics of the sensed values in episodes, as `exneat_cli.rollouts.episode` gathers them on the CPU."""

from __future__ import annotations

from typing import Any

import warp as wp

from exneat_cli.rollouts.batch.kernels import Doing
from exneat_cli.rollouts.batch.mirrored import grown
from exneat_cli.tasks import RUNNING

wp.set_module_options({"enable_backward": False})

_RUNNING = wp.constant(RUNNING)


@wp.kernel
def add_moments(
    doing: Doing,
    memory: wp.array2d(dtype=float),
    means: wp.array2d(dtype=wp.float64),
    squares: wp.array2d(dtype=wp.float64),
):
    """Update the moments with this step's sensed values (Welford, 1962); the first step of an episode resets them."""
    w, i = wp.tid()
    if doing.brain[w] < 0:
        return
    value = wp.float64(memory[w, i])
    if doing.steps[w] == 0:
        means[w, i] = value
        squares[w, i] = wp.float64(0.0)
        return
    deviation = value - means[w, i]
    means[w, i] += deviation / wp.float64(doing.steps[w] + 1)
    squares[w, i] += deviation * (value - means[w, i])


@wp.kernel
def keep_moments(
    status: wp.array(dtype=int),
    doing: Doing,
    means: wp.array2d(dtype=wp.float64),
    squares: wp.array2d(dtype=wp.float64),
    kept_means: wp.array3d(dtype=wp.float64),
    kept_squares: wp.array3d(dtype=wp.float64),
):
    """Record the moments of episodes that ended with this step."""
    w, i = wp.tid()
    if doing.brain[w] < 0 or status[w] == _RUNNING:
        return
    kept_means[doing.slot[w], doing.place[w], i] = means[w, i]
    kept_squares[doing.slot[w], doing.place[w], i] = squares[w, i]


class Sensing:
    """Means and sums of squared deviations: (W, sensed) of running episodes, (S, places, sensed) of ended ones."""

    def __init__(self, worlds: int, slots: int, size: int) -> None:
        self._running = [wp.zeros((worlds, size), dtype=wp.float64) for _ in range(2)]
        self._ended = [wp.zeros((slots, 1, size), dtype=wp.float64) for _ in range(2)]

    def add(self, doing: Any, memory: Any) -> None:
        """Update the moments with a step's sensed values, with which the rows of `memory` begin."""
        wp.launch(add_moments, dim=self._running[0].shape, inputs=[doing, memory, *self._running])

    def keep(self, status: Any, doing: Any) -> None:
        """Record the moments of episodes that ended with the step."""
        inputs = [status, doing, *self._running, *self._ended]
        wp.launch(keep_moments, dim=self._running[0].shape, inputs=inputs)

    def make_room(self, places: int) -> None:
        """Enlarge the arrays to `places` per slot, keeping their entries."""
        slots, _, size = self._ended[0].shape
        self._ended = [grown(each, (slots, places, size)) for each in self._ended]

    def of(self, slot: int) -> tuple[Any, Any]:
        """(places, sensed) means and sums of squared deviations of a slot, on the device."""
        means, squares = (each[slot] for each in self._ended)
        return means, squares
