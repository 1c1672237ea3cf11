"""The compiled episode of foraging and hunting: reset, rewind, observe, step and locate.

Each step begins with the world: the cue field decays; each free prey on the agent's tile is caught; each
other one may move, is caught if it enters the agent's tile, and adds a patch of cue around itself, or the
same patch with its values shuffled, which carries no direction. Then the agent senses and moves; stepping
onto a prey catches it. Fitness is the share of prey caught, paid at the last step.

The reset has drawn all paths and cues (`exneat_cli.tasks.grid.prey_field`), so a step only looks up four tiles;
a caught prey's cues are taken from the moment before, and fade.

Source: Zhang (2025), section 3.2.2.
"""

from __future__ import annotations

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from exneat_cli.compiling import compiled, compiled_lean
from exneat_cli.tasks.grid.prey_field import FREE, PREY_COLUMN, PREY_ROW, Field, draw_prey
from exneat_cli.tasks.grid.world import CHANNELS, COLUMN, COLUMN_STEPS, ROW, ROW_STEPS, STEPS, move
from exneat_cli.tasks.task import ENDED, FAILED, RUNNING


@compiled
def reset(field: Field, rng: Generator) -> None:
    """Draw prey, their ways and their cues, and start."""
    draw_prey(field, rng)
    rewind(field)


@compiled_lean
def rewind(field: Field) -> None:
    """Put the agent into the centre and set all prey free, where they were."""
    agent, prey = field.grid.agent, field.prey
    agent[ROW] = agent[COLUMN] = field.grid.path.shape[0] // 2
    agent[STEPS] = 0
    for k in range(prey.shape[0]):
        prey[k, PREY_ROW], prey[k, PREY_COLUMN], prey[k, FREE] = field.start[k, 0], field.start[k, 1], 1
        field.strength[k] = 1.0
    _let_world_move(field)


@compiled_lean
def _let_world_move(field):  # type: ignore[no-untyped-def]
    """Bring prey and cues to what the agent senses next; returns how many prey are free then."""
    agent, prey, strength, last_free = field.grid.agent, field.prey, field.strength, field.last_free
    t = agent[STEPS]
    free = 0
    for k in range(prey.shape[0]):
        if prey[k, FREE] == 1:
            row, column = field.places[t, k, 0], field.places[t, k, 1]
            prey[k, PREY_ROW], prey[k, PREY_COLUMN] = row, column
            if row != agent[ROW] or column != agent[COLUMN]:
                last_free[k] = t
                free += 1
                continue
            prey[k, FREE] = 0
            if t == 0:
                last_free[k] = 0
                strength[k] = 0.0
        strength[k] *= field.keep
    return free


@compiled_lean
def observe(field: Field, observation: NDArray[np.float64]) -> None:
    """Write the cue field on the four neighbours."""
    agent, cues, emitters = field.grid.agent, field.cues, field.emitters
    last_free, strength = field.last_free, field.strength
    row, column = agent[ROW], agent[COLUMN]
    observation[:] = 0.0
    for emitter in range(emitters.size):
        k = emitters[emitter]
        t, share = last_free[k], strength[k]
        channel = 0 if emitter < field.first_of_second else 1
        for side in range(4):
            cue = cues[t, row + ROW_STEPS[side], column + COLUMN_STEPS[side], emitter]
            observation[CHANNELS * side + channel] += share * cue


@compiled
def paint(field: Field, signals: NDArray[np.float64]) -> None:
    """Write the whole cue field as it is now, `signals` being (2, N, N)."""
    signals[:] = 0.0
    for emitter in range(field.emitters.size):
        k = field.emitters[emitter]
        channel = 0 if emitter < field.first_of_second else 1
        signals[channel] += field.strength[k] * field.cues[field.last_free[k], :, :, emitter]


@compiled_lean
def step(field: Field, action: NDArray[np.float64], terms: NDArray[np.float64]) -> int:
    """One move of the agent and what the world does before the next; `terms` become the share caught."""
    prey, agent = field.prey, field.grid.agent
    terms[:] = 0.0
    if not move(field.grid.path, agent, action):
        return FAILED
    free = 0
    for k in range(prey.shape[0]):
        if prey[k, PREY_ROW] == agent[ROW] and prey[k, PREY_COLUMN] == agent[COLUMN]:
            prey[k, FREE] = 0
        free += prey[k, FREE]
    if agent[STEPS] < field.cues.shape[0] and free > 0:
        free = _let_world_move(field)
        if free > 0:
            return RUNNING
    terms[0] = 1.0 - free / prey.shape[0]
    return ENDED


@compiled
def locate(field: Field, row: NDArray[np.float64]) -> None:
    """Write the agent's row and column, then row, column and freedom of every prey."""
    row[0] = field.grid.agent[ROW]
    row[1] = field.grid.agent[COLUMN]
    for k in range(field.prey.shape[0]):
        for entry in range(3):
            row[2 + 3 * k + entry] = field.prey[k, entry]
