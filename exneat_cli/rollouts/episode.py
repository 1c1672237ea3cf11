"""The one loop that every episode of every task and brain runs in."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from exneat_cli.brains.brain import activate
from exneat_cli.compiling import compiled_lean, with_functions
from exneat_cli.tasks import RUNNING, Simulation


class Conditions(NamedTuple):
    """What happens to inputs and actions on their way.

    Attributes:
        sensor_std: sd of the noise on every input; 0 draws nothing.
        lowest, highest: noisy inputs are clipped to these, unless `highest` is infinite.
        action_low, action_span: (A,) action_low + U(0, action_span) is added to the action; draws nothing if
            all are 0.
    """

    sensor_std: float
    lowest: float
    highest: float
    action_low: NDArray[np.float64]
    action_span: NDArray[np.float64]


class Buffers(NamedTuple):
    """What one thread writes into while episodes run; nothing in it outlives a call.

    Attributes:
        memory: value vector of the largest brain, and a scratch entry per node.
        action: (A,).
        terms: (terms,) of one step.
        sensor_noise: (longest episode, observation size) sensor noise, or no columns without any.
        action_noise: (longest episode, A) what is added to the action, or no columns if nothing is.
    """

    memory: NDArray[np.float64]
    action: NDArray[np.float64]
    terms: NDArray[np.float64]
    sensor_noise: NDArray[np.float64]
    action_noise: NDArray[np.float64]


def _episodes(  # type: ignore[no-untyped-def]
    world,
    brains,
    first: int,
    last: int,
    world_rng: Generator,
    noise_rng: Generator,
    action_rng: Generator,
    conditions: Conditions,
    buffers: Buffers,
    observation_size: int,
    halt: NDArray[np.bool_],
    status: NDArray[np.int64],
    steps: NDArray[np.int64],
    totals: NDArray[np.float64],
    trace: NDArray[np.float64],
    located: int,
) -> None:
    """Draw one world and run some brains through it, one after another, each from its start.

    Noise is drawn when the first brain needs it and kept for the others: all of them face the same.
    The names reset, rewind, observe, step and locate are bound by `episode_loop`.

    Args:
        world: the task's storage.
        brains: of a population.
        first: brain to run.
        last: brain before which to stop.
        world_rng: draws the world.
        noise_rng: draws the sensor noise, in the order of the inputs.
        action_rng: draws what is added to the action.
        conditions: what happens to inputs and actions on their way.
        buffers: to write into.
        observation_size: entries of the observation.
        halt: (1,), set by another thread to stop.
        status: (B,), overwritten with how the episodes ended.
        steps: (B,), overwritten with how many steps they took.
        totals: (B, terms), overwritten with the sums of the reward terms.
        trace: (steps + 1, located + terms) to record the path; rows that it lacks are left out.
        located: how many columns of `trace` say where the agent is; the terms follow.
    """
    memory, action, terms = buffers.memory, buffers.action, buffers.terms
    sensor_noise, action_noise = buffers.sensor_noise, buffers.action_noise
    clipped = conditions.highest < np.inf
    drawn = 0
    observation = memory[:observation_size]
    reset(world, world_rng)  # type: ignore[name-defined]  # noqa: F821
    for b in range(first, last):
        if b > first:
            rewind(world)  # type: ignore[name-defined]  # noqa: F821
        memory[:] = 0.0
        totals[b] = 0.0
        if trace.shape[0] > 0:
            locate(world, trace[0, :located])  # type: ignore[name-defined]  # noqa: F821
        t = 0
        ended = RUNNING
        while ended == RUNNING:
            if halt[0]:
                return
            if t == drawn:
                _draw(conditions, sensor_noise[t], action_noise[t], noise_rng, action_rng)
                drawn += 1
            observe(world, observation)  # type: ignore[name-defined]  # noqa: F821
            for i in range(sensor_noise.shape[1]):
                observation[i] += sensor_noise[t, i]
            if clipped:
                for i in range(observation_size):
                    observation[i] = min(max(observation[i], conditions.lowest), conditions.highest)
            activate(brains, b, memory, action)
            for i in range(action_noise.shape[1]):
                action[i] += action_noise[t, i]
            ended = step(world, action, terms)  # type: ignore[name-defined]  # noqa: F821
            for i in range(terms.size):
                totals[b, i] += terms[i]
            t += 1
            if t < trace.shape[0]:
                locate(world, trace[t, :located])  # type: ignore[name-defined]  # noqa: F821
                for i in range(terms.size):
                    trace[t, located + i] = terms[i]
        status[b] = ended
        steps[b] = t


@compiled_lean
def _draw(conditions, sensor_noise, action_noise, noise_rng, action_rng):  # type: ignore[no-untyped-def]
    for i in range(sensor_noise.size):
        sensor_noise[i] = noise_rng.normal(0.0, conditions.sensor_std)
    for i in range(action_noise.size):
        action_noise[i] = conditions.action_low[i] + conditions.action_span[i] * action_rng.random()


def episode_loop(simulation: Simulation, task: str) -> Callable[..., Any]:
    """The loop for one kind of world: compiled if the world is, else plain Python."""
    return _bind(
        task,
        simulation.reset,
        simulation.rewind,
        simulation.observe,
        simulation.step,
        simulation.locate,
        simulation.compiled,
    )


@functools.cache
def _bind(  # type: ignore[no-untyped-def]
    task: str, reset, rewind, observe, step, locate, compile_it: bool
) -> Callable[..., Any]:
    loop = with_functions(
        _episodes,
        f"episodes_of_{task}",
        reset=reset,
        rewind=rewind,
        observe=observe,
        step=step,
        locate=locate,
    )
    return compiled_lean(loop) if compile_it else loop
