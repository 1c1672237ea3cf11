"""The one loop that every episode of every task and brain runs in.

A step is: observe -> sensor noise and clipping -> sense -> brain -> action noise -> drive -> step.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from exneat_cli.brains.brain import activate
from exneat_cli.compiling import compiled_lean, with_functions
from exneat_cli.rollouts.outcomes import Tally
from exneat_cli.tasks import RUNNING, Simulation


def _episodes(  # type: ignore[no-untyped-def]
    world,
    brains,
    first: int,
    last: int,
    world_rng: Generator,
    sensor_rng: Generator,
    action_rng: Generator,
    disturbance,
    buffers,
    halt: NDArray[np.bool_],
    tally: Tally,
    trace: NDArray[np.float64],
    located: int,
) -> None:
    """Draw one world and run some brains through it, one after another, each from its start.

    The names reset, rewind, observe, sense, drive, step and locate are bound by `episode_loop`.

    Args:
        world: the task's storage.
        brains: of a population.
        first: brain to run.
        last: brain before which to stop.
        world_rng: draws the world.
        sensor_rng: draws the sensor noise, in the order of the readings.
        action_rng: draws what is added to the action.
        disturbance: the sd of the sensor noise; the lowest and the highest noisy reading; low and span, (A,) each:
            low + U(0, span) is added to the action.
        buffers: to write into, see `World`; nothing in them outlives the call.
        halt: (1,), set by another thread to stop.
        tally: of one episode; the entries of the brains that are run are overwritten.
        trace: (steps + 1, located + terms) to record the path of the last one; rows that it lacks are left out.
        located: how many columns of `trace` say where the agent is; the terms follow.
    """
    memory, readings, sensed, action, terms, sensor_noise, action_noise = buffers
    sensor_std, lowest, highest, action_low, action_span = disturbance
    means, squares = tally.means, tally.squares
    clipped = highest < np.inf
    drawn = 0
    reset(world, world_rng)  # type: ignore[name-defined]  # noqa: F821
    for b in range(first, last):
        if b > first:
            rewind(world)  # type: ignore[name-defined]  # noqa: F821
        memory[:] = 0.0
        tally.totals[b] = 0.0
        means[b] = 0.0
        squares[b] = 0.0
        if located > 0 and trace.shape[0] > 0:
            locate(world, trace[0, :located])  # type: ignore[name-defined]  # noqa: F821
        t = 0
        status = RUNNING
        while status == RUNNING:
            if halt[0]:
                return
            # Noise is drawn when the first brain needs it and kept for the others: all of them face the same.
            if t == drawn:
                for i in range(sensor_noise.shape[1]):
                    sensor_noise[t, i] = sensor_rng.normal(0.0, sensor_std)
                for i in range(action_noise.shape[1]):
                    action_noise[t, i] = action_low[i] + action_span[i] * action_rng.random()
                drawn += 1

            # Observe: (observation size,) readings, then noise and clipping in place.
            observe(world, readings)  # type: ignore[name-defined]  # noqa: F821
            for i in range(sensor_noise.shape[1]):
                readings[i] += sensor_noise[t, i]
            if clipped:
                for i in range(readings.size):
                    readings[i] = min(max(readings[i], lowest), highest)

            # Sense: (sensed size,) head of the memory, and its statistics (Welford, "Note on a method for calculating
            # corrected sums of squares and products", 1962); means has no columns where nobody asked for them.
            sense(world, readings, sensed)  # type: ignore[name-defined]  # noqa: F821
            for i in range(means.shape[1]):
                deviation = sensed[i] - means[b, i]
                means[b, i] += deviation / (t + 1)
                squares[b, i] += deviation * (sensed[i] - means[b, i])

            # Brain, action noise, drive, step: (A,) action in place, (terms,) rewards.
            activate(brains, b, memory, action)
            for i in range(action_noise.shape[1]):
                action[i] += action_noise[t, i]
            drive(world, action)  # type: ignore[name-defined]  # noqa: F821
            status = step(world, action, terms)  # type: ignore[name-defined]  # noqa: F821
            for i in range(terms.size):
                tally.totals[b, i] += terms[i]
            t += 1

            if t < trace.shape[0]:
                if located > 0:
                    locate(world, trace[t, :located])  # type: ignore[name-defined]  # noqa: F821
                for i in range(terms.size):
                    trace[t, located + i] = terms[i]
        tally.status[b] = status
        tally.steps[b] = t


@compiled_lean
def _sense_readings(world, readings, sensed):  # type: ignore[no-untyped-def]
    """Leave it at the readings, which lie where what is sensed does."""


@compiled_lean
def _drive_as_told(world, action):  # type: ignore[no-untyped-def]
    """Leave the action as it is."""


def episode_loop(simulation: Simulation, task: str) -> Callable[..., Any]:
    """The loop for one kind of world, whose task has this name: compiled if the world is, else plain Python."""
    names = ("reset", "rewind", "observe", "sense", "drive", "step", "locate")
    defaults: dict[str, Any] = {"sense": _sense_readings, "drive": _drive_as_told}
    if not simulation.compiled:  # its world may be something that compiled code cannot take
        defaults = {name: function.py_func for name, function in defaults.items()}
    functions = {name: getattr(simulation, name) or defaults[name] for name in names}
    return _compiled_loop(task, **functions) if simulation.compiled else _loop(task, **functions)


@functools.cache
def _compiled_loop(task: str, **functions: Callable[..., Any]) -> Callable[..., Any]:
    return compiled_lean(_loop(task, **functions))


def _loop(task: str, **functions: Callable[..., Any]) -> Callable[..., Any]:
    return with_functions(_episodes, f"episodes_of_{task}", **functions)
