"""The open field: its storage, and everything random in it, drawn at the reset.

Prey do not react to the agent. A reset therefore draws all paths and cues up to the last step, separately for each
emitter (a prey on one channel). For the agent's part and the order of events see `exneat_cli.tasks.grid.predator_prey`.

Source: Zhang (2025), section 3.2.2.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from exneat_cli.compiling import compiled
from exneat_cli.tasks.grid.world import COLUMN_STEPS, ROW_STEPS, draw_tiles

LONGEST_FLIGHT = 7
FLIGHT_CHANCE = np.cumsum(np.arange(1, LONGEST_FLIGHT + 1) ** -2.0) / np.sum(np.arange(1, LONGEST_FLIGHT + 1) ** -2.0)
"""Cumulative probability of flights of 1 to LONGEST_FLIGHT tiles; a length's own is proportional to length ** -2."""
PATCH_SD = 1.0
"""Width of the bell of an emission, in tiles."""
DRAWS_PER_NUMBER = 4
"""Choices of a shuffle that share one uniform number; each, among at most 225, uses at most 8 of its 53 bits."""
PREY_ROW, PREY_COLUMN, FREE = range(3)
"""Columns of `Field.prey`: where a prey is, or was caught, and whether it is free."""
WALK_ROW, WALK_COLUMN, DIRECTION, FLIGHT = range(4)
"""Columns of `walkers`, (n_prey, 4): where a prey is, its direction, and the steps left of its flight."""


class Field(NamedTuple):
    """An open field of N x N tiles, the wall included, with prey.

    T is the number of times that the agent senses, E the number of emitters: emitter e is prey ``e // channels``, on
    channel ``e % 2``. Prey with one channel thus alternate between the two, and prey with both have two emitters.
    """

    path: NDArray[np.int64]  #: (N, N), see `exneat_cli.tasks.grid.world.GridTask`
    agent: NDArray[np.int64]  #: (3,), see there
    prey: NDArray[np.int64]  #: (n_prey, 3) their current state, see `PREY_ROW`
    start: NDArray[np.int64]  #: (n_prey, 2) where they are before the first step
    places: NDArray[np.int64]  #: (T, n_prey, 2) where each one is when the agent senses, unless it was caught
    cues: NDArray[np.float64]  #: (T, N, N, E) what each emitter adds to each tile when the agent senses
    last_free: NDArray[np.int64]  #: (n_prey,) time of the cues by which a prey is sensed: now, if it is free
    strength: NDArray[np.float64]  #: (n_prey,) share of these cues that is left
    patch: NDArray[np.float64]  #: (width, width) cue that an emission adds, 1 at its centre
    channels: int  #: on which each prey emits, 1 or 2
    emission: float  #: chance per prey, step and channel that the patch has a direction
    keep: float  #: share of the field that is left after a step
    motion: float  #: chance that a prey moves in a step; 0 where prey never move
    levy: bool  #: straight flights, else a new direction for each move
    library: bool  #: whether prey are caught only before they move, and may start where the agent does


def bell(width: int) -> NDArray[np.float64]:
    """The patch of an emission, (width, width)."""
    profile = np.exp(-0.5 * ((np.arange(width) - width // 2) / PATCH_SD) ** 2)
    return np.outer(profile, profile)


@compiled
def draw_prey(field: Field, rng: Generator) -> None:
    """Put prey on distinct tiles, and draw where they go and what they emit at every step."""
    field.path[:] = 0
    field.path[1:-1, 1:-1] = 1
    vacant, centre = field.path.copy(), field.path.shape[0] // 2
    if not field.library:
        vacant[centre, centre] = 0  # where the agent starts
    field.start[:] = draw_tiles(vacant, field.start.shape[0], rng)
    walkers = np.zeros((field.start.shape[0], 4), np.int64)
    walkers[:, :2] = field.start
    shuffled = field.patch.copy()
    for t in range(field.cues.shape[0]):
        draw_moment(field, t, walkers, shuffled, rng)


@compiled
def draw_moment(
    field: Field, t: int, walkers: NDArray[np.int64], shuffled: NDArray[np.float64], rng: Generator
) -> None:
    """Draw where each prey goes and what it emits before the agent senses for the t-th time.

    `walkers`, and `shuffled`, (width, width) with the values of the patch, carry over from one moment to the next.
    """
    # Arrays are taken out of the tuple once: passing the tuple on costs more than the callees' work.
    path, cues = field.path, field.cues
    # A share of the field persists: one flat loop, which the compiler turns into vector instructions.
    now = cues[t].reshape(cues[t].size)
    if t == 0:
        now[:] = 0.0
    else:
        before = cues[t - 1].reshape(now.size)
        for i in range(now.size):
            now[i] = field.keep * before[i]
    for k in range(walkers.shape[0]):
        # A prey moves, or stays. Worlds without motion draw nothing for it.
        if field.motion > 0.0 and rng.random() < field.motion:
            move_prey(walkers, k, path, field.levy, rng)
        row, column = walkers[k, WALK_ROW], walkers[k, WALK_COLUMN]
        field.places[t, k, 0], field.places[t, k, 1] = row, column
        # It emits on each of its channels, with a direction or without.
        for emitter in range(k * field.channels, (k + 1) * field.channels):
            if rng.random() < field.emission:
                add_patch(cues[t], emitter, row, column, field.patch)
            else:
                shuffle(shuffled.reshape(shuffled.size), rng)
                add_patch(cues[t], emitter, row, column, shuffled)


@compiled
def move_prey(walkers: NDArray[np.int64], k: int, path: NDArray[np.int64], levy: bool, rng: Generator) -> None:
    """Move prey `k` by one tile: straight on in its flight, or in a new direction; walls end a flight."""
    # A new flight: one of four directions, and the first length whose cumulative probability reaches the number drawn.
    if walkers[k, FLIGHT] == 0:
        walkers[k, DIRECTION] = int(4 * rng.random())
        walkers[k, FLIGHT] = 1
        if levy:
            draw = rng.random()
            while FLIGHT_CHANCE[walkers[k, FLIGHT] - 1] < draw:
                walkers[k, FLIGHT] += 1
    side = walkers[k, DIRECTION]
    row, column = walkers[k, WALK_ROW] + ROW_STEPS[side], walkers[k, WALK_COLUMN] + COLUMN_STEPS[side]
    if path[row, column] == 1:
        walkers[k, WALK_ROW], walkers[k, WALK_COLUMN] = row, column
        walkers[k, FLIGHT] -= 1
    else:
        walkers[k, FLIGHT] = 0


@compiled
def add_patch(tiles: NDArray[np.float64], emitter: int, row: int, column: int, patch: NDArray[np.float64]) -> None:
    """Add `patch`, (width, width), around (row, column) to an emitter's `tiles`, (N, N, E), but not to walls."""
    width, last = patch.shape[0], tiles.shape[0] - 2
    top, left = row - width // 2, column - width // 2
    first_column, last_column = max(left, 1), min(left + width - 1, last)
    for r in range(max(top, 1), min(top + width - 1, last) + 1):
        for c in range(first_column, last_column + 1):
            tiles[r, c, emitter] += patch[r - top, c - left]


@compiled
def shuffle(values: NDArray[np.float64], rng: Generator) -> None:
    """Shuffle `values` in place; all orders are equally likely."""
    # Shuffling an already shuffled array is as fair as shuffling a sorted one. A uniform number has enough bits for
    # several choices: DRAWS_PER_NUMBER of them leave at least 21 bits.
    left_in_number = 0
    number = 0.0
    for i in range(values.size - 1, 0, -1):
        if left_in_number == 0:
            number = rng.random()
            left_in_number = DRAWS_PER_NUMBER
        # The whole part is a choice from 0 to i, the rest is uniform again.
        number *= i + 1
        j = int(number)
        number -= j
        left_in_number -= 1
        values[i], values[j] = values[j], values[i]
