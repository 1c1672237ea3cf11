"""The one loop that every episode of every task and brain runs in."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from exneat_cli.brains import Brain, RandomActions, brain, random_actions
from exneat_cli.tasks import RUNNING, Simulation
from exneat_cli.tasks.compiling import compiled, with_functions

_BRAIN_FUNCTIONS = {Brain: brain, RandomActions: random_actions}


class Conditions(NamedTuple):
    """What happens to inputs and actions on their way.

    Attributes:
        sensor_std: sd of the noise on every input; 0 draws nothing.
        lowest, highest: noisy inputs are clipped to these, unless `highest` is infinite.
        tie_noise: U(0, tie_noise) is added to each entry of the action; 0 draws nothing.
    """

    sensor_std: float
    lowest: float
    highest: float
    tie_noise: float


def _episode(  # type: ignore[no-untyped-def]
    world,
    agent,
    world_rng: Generator,
    noise_rng: Generator,
    action_rng: Generator,
    conditions: Conditions,
    observation: NDArray[np.float64],
    action: NDArray[np.float64],
    totals: NDArray[np.float64],
    trace: NDArray[np.float64],
    located: int,
):
    """Run one episode; returns how it ended and how many steps it took.

    The names reset, observe, step, locate, fresh_memory and activate are bound by `episode_loop`.

    Args:
        world: the task's storage.
        agent: a brain.
        world_rng: draws the world.
        noise_rng: draws the sensor noise, in the order of the inputs.
        action_rng: draws what the agent leaves to chance.
        conditions: what happens to inputs and actions on their way.
        observation: buffer, (observation size,).
        action: buffer, (action size,).
        totals: (terms,), overwritten with the sums of the reward terms.
        trace: (steps + 1, located + terms) to record the path; rows that it lacks are left out.
        located: how many columns of `trace` say where the agent is; the terms follow.
    """
    terms = np.zeros(totals.size)
    totals[:] = 0.0
    reset(world, world_rng)  # type: ignore[name-defined]  # noqa: F821
    memory = fresh_memory(agent)  # type: ignore[name-defined]  # noqa: F821
    if trace.shape[0] > 0:
        locate(world, trace[0, :located])  # type: ignore[name-defined]  # noqa: F821
    steps = 0
    status = RUNNING
    while status == RUNNING:
        observe(world, observation)  # type: ignore[name-defined]  # noqa: F821
        if conditions.sensor_std > 0.0:
            for i in range(observation.size):
                observation[i] += noise_rng.normal(0.0, conditions.sensor_std)
        if conditions.highest < np.inf:
            for i in range(observation.size):
                observation[i] = min(max(observation[i], conditions.lowest), conditions.highest)
        activate(agent, memory, observation, action, action_rng)  # type: ignore[name-defined]  # noqa: F821
        if conditions.tie_noise > 0.0:
            for i in range(action.size):
                action[i] += action_rng.uniform(0.0, conditions.tie_noise)
        status = step(world, action, world_rng, terms)  # type: ignore[name-defined]  # noqa: F821
        for i in range(terms.size):
            totals[i] += terms[i]
        steps += 1
        if steps < trace.shape[0]:
            locate(world, trace[steps, :located])  # type: ignore[name-defined]  # noqa: F821
            trace[steps, located:] = terms
    return status, steps


def episode_loop(simulation: Simulation, brain_type: type[Any], task: str) -> Callable[..., Any]:
    """The loop for one kind of world and brain: compiled if the world is, else plain Python."""
    functions = _BRAIN_FUNCTIONS[brain_type]
    return _bind(
        task,
        brain_type.__name__,
        simulation.reset,
        simulation.observe,
        simulation.step,
        simulation.locate,
        functions.fresh_memory,
        functions.activate,
        simulation.compiled,
    )


@functools.cache
def _bind(  # type: ignore[no-untyped-def]
    task: str, brain_name: str, reset, observe, step, locate, fresh_memory, activate, compile_it: bool
) -> Callable[..., Any]:
    loop = with_functions(
        _episode,
        f"episode_of_{task}_with_{brain_name}",
        reset=reset,
        observe=observe,
        step=step,
        locate=locate,
        fresh_memory=fresh_memory,
        activate=activate,
    )
    return compiled(loop) if compile_it else loop
