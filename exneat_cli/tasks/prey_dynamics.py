"""The compiled episode of foraging and hunting: reset, observe, step and locate.

Each step begins with the world: the cue field decays; each free prey on the agent's tile is caught; each
other one may move, is caught if it enters the agent's tile, and adds a patch of cue around itself, or the
same patch with its values shuffled, which carries no direction. Then the agent senses and moves; stepping
onto a prey catches it. Fitness is the share of prey caught, paid at the last step.

Source: Zhang (2025), section 3.2.2.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from exneat_cli.tasks.compiling import compiled
from exneat_cli.tasks.grid import COLUMN, COLUMN_STEPS, ROW, ROW_STEPS, STEPS, Grid, empty_grid, move, sense
from exneat_cli.tasks.task import ENDED, FAILED, RUNNING

LONGEST_FLIGHT = 7
FLIGHT_EXPONENT = -2.0
"""Flight lengths 1 to LONGEST_FLIGHT have probability proportional to length ** FLIGHT_EXPONENT."""
PATCH_SD = 1.0
"""Tiles."""
DRAWS_PER_NUMBER = 4
"""Choices of a shuffle that share one uniform number; each of up to 225 uses at most 8 of its 53 bits."""
PREY_ROW, PREY_COLUMN, FREE, DIRECTION, FLIGHT = range(5)
"""Columns of `Field.prey`: where it is, whether it is free, its direction and the steps left of its flight."""


class Field(NamedTuple):
    """An open field with prey.

    Attributes:
        grid: tiles and agent; signals are the cue field.
        prey: (n_prey, 5), see `PREY_ROW`.
        width: tiles per side of an emission.
        patch: (width * width,) cue that an emission adds, 1 at its centre.
        shuffled: (width * width,) the same values in another order each time.
        flight_chance: (LONGEST_FLIGHT,) cumulative probability of flight lengths.
        scratch: (tiles, 2).
        emission: chance per prey, step and channel that the patch has a direction.
        decay: share of the field that fades at each step.
        motion: chance that a prey moves in a step; 0 where prey never move.
        levy: straight flights, else a new direction for each move.
        both_channels: every prey emits on both channels, else they alternate by index.
        max_steps: moves of the agent.
    """

    grid: Grid
    prey: NDArray[np.int64]
    width: int
    patch: NDArray[np.float64]
    shuffled: NDArray[np.float64]
    flight_chance: NDArray[np.float64]
    scratch: NDArray[np.int64]
    emission: float
    decay: float
    motion: float
    levy: bool
    both_channels: bool
    max_steps: int


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
    """Storage for an open square of size x size tiles with a wall around."""
    offsets = np.arange(patch_width) - patch_width // 2
    profile = np.exp(-0.5 * (offsets / PATCH_SD) ** 2)
    lengths = np.arange(1, LONGEST_FLIGHT + 1) ** FLIGHT_EXPONENT
    return Field(
        grid=empty_grid(size + 2),
        prey=np.zeros((n_prey, 5), np.int64),
        width=patch_width,
        patch=np.outer(profile, profile).ravel(),
        shuffled=np.outer(profile, profile).ravel(),
        flight_chance=np.cumsum(lengths) / np.sum(lengths),
        scratch=np.zeros((size * size, 2), np.int64),
        emission=float(emission),
        decay=float(decay),
        motion=float(motion),
        levy=levy,
        both_channels=both_channels,
        max_steps=max_steps,
    )


@compiled
def reset(field: Field, rng: Generator) -> None:
    """Put the agent into the centre and prey on distinct other tiles, and let the first cues out."""
    grid = field.grid
    size = grid.path.shape[0]
    field.shuffled[:] = field.patch
    grid.signals[:] = 0.0
    grid.path[:] = 0
    grid.path[1 : size - 1, 1 : size - 1] = 1
    centre = size // 2
    grid.agent[ROW], grid.agent[COLUMN], grid.agent[STEPS] = centre, centre, 0
    count = 0
    for row in range(1, size - 1):
        for column in range(1, size - 1):
            if row != centre or column != centre:
                field.scratch[count, 0], field.scratch[count, 1] = row, column
                count += 1
    for k in range(field.prey.shape[0]):
        chosen = k + int(rng.integers(0, count - k))
        for axis in range(2):
            tile = field.scratch[chosen, axis]
            field.scratch[chosen, axis] = field.scratch[k, axis]
            field.prey[k, axis] = tile
        field.prey[k, FREE] = 1
        field.prey[k, DIRECTION] = 0
        field.prey[k, FLIGHT] = 0
    _advance_world(field, rng)


@compiled
def _advance_world(field, rng):  # type: ignore[no-untyped-def]
    # Arrays are taken out of the tuple once: passing the tuple on costs more than what the callees do.
    signals, prey, agent = field.grid.signals, field.prey, field.grid.agent
    patch, shuffled, width, emission = field.patch, field.shuffled, field.width, field.emission
    path, flight_chance, levy, motion = field.grid.path, field.flight_chance, field.levy, field.motion
    both_channels = field.both_channels
    keep = 1.0 - field.decay
    everywhere = signals.reshape(signals.size)
    for i in range(everywhere.size):
        everywhere[i] *= keep
    for k in range(prey.shape[0]):
        _catch(prey, agent, k)
        if prey[k, FREE] == 0:
            continue
        if motion > 0.0 and rng.random() < motion:
            move_prey(prey, k, path, flight_chance, levy, rng)
            _catch(prey, agent, k)
            if prey[k, FREE] == 0:
                continue
        for channel in range(2):
            if not both_channels and channel != k % 2:
                continue
            if rng.random() < emission:
                _add(signals, channel, prey[k, PREY_ROW], prey[k, PREY_COLUMN], patch, width)
            else:
                _shuffle(shuffled, rng)
                _add(signals, channel, prey[k, PREY_ROW], prey[k, PREY_COLUMN], shuffled, width)


@compiled
def _catch(prey, agent, k):  # type: ignore[no-untyped-def]
    if prey[k, PREY_ROW] == agent[ROW] and prey[k, PREY_COLUMN] == agent[COLUMN]:
        prey[k, FREE] = 0


@compiled
def move_prey(
    prey: NDArray[np.int64],
    k: int,
    path: NDArray[np.int64],
    flight_chance: NDArray[np.float64],
    levy: bool,
    rng: Generator,
) -> None:
    """Move prey `k` by one tile: straight on in its flight, or in a new direction; walls end a flight."""
    if prey[k, FLIGHT] == 0:
        prey[k, DIRECTION] = int(4 * rng.random())
        prey[k, FLIGHT] = 1
        if levy:
            draw = rng.random()
            while flight_chance[prey[k, FLIGHT] - 1] < draw:
                prey[k, FLIGHT] += 1
    side = prey[k, DIRECTION]
    row, column = prey[k, PREY_ROW] + ROW_STEPS[side], prey[k, PREY_COLUMN] + COLUMN_STEPS[side]
    if path[row, column] == 1:
        prey[k, PREY_ROW], prey[k, PREY_COLUMN] = row, column
        prey[k, FLIGHT] -= 1
    else:
        prey[k, FLIGHT] = 0


@compiled
def _add(signals, channel, row, column, cues, width):  # type: ignore[no-untyped-def]
    top, left = row - width // 2, column - width // 2
    last = signals.shape[1] - 2
    first_column, last_column = max(left, 1), min(left + width - 1, last)
    for r in range(max(top, 1), min(top + width - 1, last) + 1):
        offset = (r - top) * width - left
        for c in range(first_column, last_column + 1):
            signals[channel, r, c] += cues[offset + c]


@compiled
def _shuffle(values, rng):  # type: ignore[no-untyped-def]
    # Shuffling what was shuffled before is as fair as starting from order. A uniform number has bits for
    # several choices; DRAWS_PER_NUMBER of them leave at least 21 bits of fairness for the last.
    left_in_number = 0
    number = 0.0
    for i in range(values.size - 1, 0, -1):
        if left_in_number == 0:
            number = rng.random()
            left_in_number = DRAWS_PER_NUMBER
        number *= i + 1
        j = int(number)
        number -= j
        left_in_number -= 1
        values[i], values[j] = values[j], values[i]


@compiled
def observe(field: Field, observation: NDArray[np.float64]) -> None:
    """Write the cue field on the four neighbours."""
    sense(field.grid.signals, field.grid.agent, observation)


@compiled
def step(field: Field, action: NDArray[np.float64], rng: Generator, terms: NDArray[np.float64]) -> int:
    """One move of the agent and what the world does before the next; `terms` become the share caught."""
    prey, agent = field.prey, field.grid.agent
    terms[:] = 0.0
    if not move(field.grid.path, agent, action):
        return FAILED
    for k in range(prey.shape[0]):
        _catch(prey, agent, k)
    if agent[STEPS] < field.max_steps and _count_free(prey) > 0:
        _advance_world(field, rng)
        if _count_free(prey) > 0:
            return RUNNING
    terms[0] = 1.0 - _count_free(prey) / prey.shape[0]
    return ENDED


@compiled
def _count_free(prey):  # type: ignore[no-untyped-def]
    free = 0
    for k in range(prey.shape[0]):
        free += prey[k, FREE]
    return free


@compiled
def locate(field: Field, row: NDArray[np.float64]) -> None:
    """Write the agent's row and column, then row, column and freedom of every prey."""
    row[0] = field.grid.agent[ROW]
    row[1] = field.grid.agent[COLUMN]
    for k in range(field.prey.shape[0]):
        for entry in range(3):
            row[2 + 3 * k + entry] = field.prey[k, entry]
