"""The open field: its storage, and all that chance does in it, drawn at the reset.

Prey take no notice of the agent. So a reset draws all paths and cues up to the last step, each emitter's apart
(an emitter is a prey on one channel). What the agent makes of them, and the order of events:
`exneat_cli.tasks.grid.predator_prey`.

Source: Zhang (2025), section 3.2.2.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from exneat_cli.compiling import compiled
from exneat_cli.tasks.grid.world import COLUMN_STEPS, ROW_STEPS

LONGEST_FLIGHT = 7
FLIGHT_EXPONENT = -2.0
"""Flight lengths 1 to LONGEST_FLIGHT have probability proportional to length ** FLIGHT_EXPONENT."""
PATCH_SD = 1.0
"""Width of the bell of an emission, in tiles."""
DRAWS_PER_NUMBER = 4
"""Choices of a shuffle that share one uniform number; each of up to 225 uses at most 8 of its 53 bits."""
PREY_ROW, PREY_COLUMN, FREE = range(3)
"""Columns of `Field.prey`: where it is, or was when it was caught, and whether it is free."""
WALK_ROW, WALK_COLUMN, DIRECTION, FLIGHT = range(4)
"""Columns of `Field.walkers`: where a prey is, its direction and the steps left of its flight."""


class Field(NamedTuple):
    """An open field with prey.

    T is the number of times that the agent senses, E that of emitters: prey on channel 1, then on channel 2.

    Attributes:
        path, agent: see `exneat_cli.tasks.grid.world.GridTask`.
        prey: (n_prey, 3) as the agent left them, see `PREY_ROW`.
        start: (n_prey, 2) where they are before the first step.
        places: (T, n_prey, 2) where each one is when the agent senses, unless it was caught.
        cues: (T, N, N, E) what each emitter adds to each tile when the agent senses.
        emitters: (E,) the prey behind each emitter.
        first_of_second: how many emitters are on channel 1.
        last_free: (n_prey,) the time of the cues that its emitters are heard by: now, for a free prey.
        strength: (n_prey,) what is left of its cues since then.
        walkers: (n_prey, 4) scratch, see `WALK_ROW`.
        width: tiles per side of an emission.
        patch: (width * width,) cue that an emission adds, 1 at its centre.
        shuffled: (width * width,) the same values in another order each time.
        flight_chance: (LONGEST_FLIGHT,) cumulative probability of flight lengths.
        scratch: (tiles, 2).
        emission: chance per prey, step and channel that the patch has a direction.
        keep: share of the field that is left after a step.
        motion: chance that a prey moves in a step; 0 where prey never move.
        levy: straight flights, else a new direction for each move.
    """

    path: NDArray[np.int64]
    agent: NDArray[np.int64]
    prey: NDArray[np.int64]
    start: NDArray[np.int64]
    places: NDArray[np.int64]
    cues: NDArray[np.float64]
    emitters: NDArray[np.int64]
    first_of_second: int
    last_free: NDArray[np.int64]
    strength: NDArray[np.float64]
    walkers: NDArray[np.int64]
    width: int
    patch: NDArray[np.float64]
    shuffled: NDArray[np.float64]
    flight_chance: NDArray[np.float64]
    scratch: NDArray[np.int64]
    emission: float
    keep: float
    motion: float
    levy: bool


def new_field(
    size: int,
    n_prey: int,
    patch_width: int,
    *,
    emission: float,
    decay: float,
    motion: float,
    levy: bool,
    both_channels: bool,
    max_steps: int,
) -> Field:
    """Storage for an open square of size x size tiles with a wall around.

    Args:
        size: open tiles per side.
        n_prey: number of prey.
        patch_width: tiles per side of an emission.
        emission: chance per prey, step and channel that the patch has a direction.
        decay: share of the field that fades at each step.
        motion: chance that a prey moves in a step.
        levy: straight flights, else a new direction for each move.
        both_channels: every prey emits on both channels, else they alternate by index.
        max_steps: moves of the agent.
    """
    offsets = np.arange(patch_width) - patch_width // 2
    profile = np.exp(-0.5 * (offsets / PATCH_SD) ** 2)
    lengths = np.arange(1, LONGEST_FLIGHT + 1) ** FLIGHT_EXPONENT
    prey = np.arange(n_prey)
    channels = [prey, prey] if both_channels else [prey[::2], prey[1::2]]
    emitters = np.concatenate(channels)
    return Field(
        path=np.zeros((size + 2, size + 2), np.int64),
        agent=np.zeros(3, np.int64),
        prey=np.zeros((n_prey, 3), np.int64),
        start=np.zeros((n_prey, 2), np.int64),
        places=np.zeros((max_steps, n_prey, 2), np.int64),
        cues=np.zeros((max_steps, size + 2, size + 2, len(emitters))),
        emitters=emitters,
        first_of_second=len(channels[0]),
        last_free=np.zeros(n_prey, np.int64),
        strength=np.zeros(n_prey),
        walkers=np.zeros((n_prey, 4), np.int64),
        width=patch_width,
        patch=np.outer(profile, profile).ravel(),
        shuffled=np.outer(profile, profile).ravel(),
        flight_chance=np.cumsum(lengths) / np.sum(lengths),
        scratch=np.zeros((size * size, 2), np.int64),
        emission=float(emission),
        keep=1.0 - decay,
        motion=float(motion),
        levy=levy,
    )


@compiled
def draw_prey(field: Field, rng: Generator) -> None:
    """Put prey on distinct tiles but the centre, and draw where they go and what they emit at every step."""
    path = field.path
    path[:] = 0
    path[1:-1, 1:-1] = 1
    place_prey(field.start, field.scratch, path.shape[0], rng)
    field.walkers[:] = 0
    field.walkers[:, :2] = field.start
    field.shuffled[:] = field.patch
    for t in range(field.cues.shape[0]):
        draw_moment(field, t, rng)


@compiled
def place_prey(start: NDArray[np.int64], scratch: NDArray[np.int64], size: int, rng: Generator) -> None:
    """Draw `start`, (n_prey, 2), from all open tiles but the centre, where the agent starts."""
    centre, count = size // 2, 0
    for row in range(1, size - 1):
        for column in range(1, size - 1):
            if row != centre or column != centre:
                scratch[count, 0], scratch[count, 1] = row, column
                count += 1
    # The first steps of a Fisher-Yates shuffle.
    for k in range(start.shape[0]):
        chosen = k + int(rng.integers(0, count - k))
        for axis in range(2):
            start[k, axis] = scratch[chosen, axis]
            scratch[chosen, axis] = scratch[k, axis]


@compiled
def draw_moment(field: Field, t: int, rng: Generator) -> None:
    """Draw where each prey goes and what it emits before the agent senses for the t-th time."""
    # Arrays are taken out of the tuple once: passing the tuple on costs more than what the callees do.
    walkers, path, cues = field.walkers, field.path, field.cues
    # The field decays: one flat loop, which the compiler turns into vector instructions.
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
            move_prey(walkers, k, path, field.flight_chance, field.levy, rng)
        row, column = walkers[k, WALK_ROW], walkers[k, WALK_COLUMN]
        field.places[t, k, 0], field.places[t, k, 1] = row, column
        # It emits on each of its channels, with a direction or without.
        for emitter in range(field.emitters.size):
            if field.emitters[emitter] != k:
                continue
            if rng.random() < field.emission:
                add_patch(cues[t], emitter, row, column, field.patch, field.width)
            else:
                shuffle(field.shuffled, rng)
                add_patch(cues[t], emitter, row, column, field.shuffled, field.width)


@compiled
def move_prey(
    walkers: NDArray[np.int64],
    k: int,
    path: NDArray[np.int64],
    flight_chance: NDArray[np.float64],
    levy: bool,
    rng: Generator,
) -> None:
    """Move prey `k` by one tile: straight on in its flight, or in a new direction; walls end a flight."""
    # A new flight: one of four directions, and a length whose cumulative probability reaches the number drawn.
    if walkers[k, FLIGHT] == 0:
        walkers[k, DIRECTION] = int(4 * rng.random())
        walkers[k, FLIGHT] = 1
        if levy:
            draw = rng.random()
            while flight_chance[walkers[k, FLIGHT] - 1] < draw:
                walkers[k, FLIGHT] += 1
    side = walkers[k, DIRECTION]
    row, column = walkers[k, WALK_ROW] + ROW_STEPS[side], walkers[k, WALK_COLUMN] + COLUMN_STEPS[side]
    if path[row, column] == 1:
        walkers[k, WALK_ROW], walkers[k, WALK_COLUMN] = row, column
        walkers[k, FLIGHT] -= 1
    else:
        walkers[k, FLIGHT] = 0


@compiled
def add_patch(
    tiles: NDArray[np.float64], emitter: int, row: int, column: int, cues: NDArray[np.float64], width: int
) -> None:
    """Add `cues`, (width * width,), around (row, column) to an emitter's `tiles`, (N, N, E), but not to walls."""
    top, left = row - width // 2, column - width // 2
    last = tiles.shape[0] - 2
    first_column, last_column = max(left, 1), min(left + width - 1, last)
    for r in range(max(top, 1), min(top + width - 1, last) + 1):
        offset = (r - top) * width - left
        for c in range(first_column, last_column + 1):
            tiles[r, c, emitter] += cues[offset + c]


@compiled
def shuffle(values: NDArray[np.float64], rng: Generator) -> None:
    """Bring `values` into any order with equal chance, in place."""
    # Shuffling what was shuffled before is as fair as starting from order. A uniform number has bits for
    # several choices; DRAWS_PER_NUMBER of them leave at least 21 bits of fairness for the last.
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
