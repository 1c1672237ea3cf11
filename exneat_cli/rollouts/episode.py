"""The one loop that every episode of every task and brain runs in.

A step is: observe -> sensor noise and clipping -> sense -> brain -> action noise -> drive -> step.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exneat_cli.brains import Brains
from exneat_cli.brains.brain import activate, memory_size
from exneat_cli.compiling import compiled_lean, with_functions
from exneat_cli.interruption import uninterrupted
from exneat_cli.rollouts.outcomes import Tally
from exneat_cli.rollouts.settings import Noise
from exneat_cli.rollouts.sharing import Share
from exneat_cli.seeding import EpisodeSeeds, generator
from exneat_cli.tasks import RUNNING, HasInitialPose, HasTiles, Simulation, Task

Acting = tuple[Brains, NDArray[np.float64], NDArray[np.float64]]
"""Brains, and low and span, (A,) each: low + U(0, span) is added to their actions."""


def _episodes(  # type: ignore[no-untyped-def]
    world, brains, first, last, world_rng, sensor_rng, action_rng, disturbance, buffers, halt, tally, trace, located
):
    """Draw one world and run some brains through it, one after another, each from its start.

    The names reset, rewind, observe, sense, drive, step and locate are bound by `_loop_of`.

    Args:
        world: the task's storage.
        brains: `Brains`.
        first: brain to run.
        last: brain before which to stop.
        world_rng: Generator that draws the world.
        sensor_rng: the same for the sensor noise, in the order of the readings.
        action_rng: the same for what is added to the action.
        disturbance: the sd of the sensor noise; the lowest and the highest noisy reading; low and span, (A,) each:
            low + U(0, span) is added to the action.
        buffers: to write into, see `World`; nothing in them outlives the call.
        halt: (1,), set by another thread to stop.
        tally: `Tally` of one episode; the entries of the brains that are run are overwritten.
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


def _loop_of(simulation: Simulation, task: str) -> Callable[..., Any]:
    """The loop for one kind of world, whose task has this name: compiled if the world is, else plain Python."""
    names = ("reset", "rewind", "observe", "sense", "drive", "step", "locate")
    defaults: dict[str, Any] = {"sense": _sense_readings, "drive": _drive_as_told}
    if not simulation.compiled:  # its world may be something that compiled code cannot take
        defaults = {name: function.py_func for name, function in defaults.items()}
    functions = {name: getattr(simulation, name) or defaults[name] for name in names}
    return _compiled_loop(task, **functions) if simulation.compiled else with_functions(_episodes, task, **functions)


@functools.cache
def _compiled_loop(task: str, **functions: Callable[..., Any]) -> Callable[..., Any]:
    return compiled_lean(with_functions(_episodes, f"episodes_of_{task}", **functions))


class World:
    """An opened world; use it from one thread at a time.

    Args:
        task: what is simulated.
        noise: what disturbs the agent.
        training: switches on the task's early stopping.
        halt: (1,), set by another thread to stop; left out, nothing stops it.

    Raises:
        ValueError: the world has no `sense`, but its task says that brains sense something else than the readings.
    """

    def __init__(self, task: Task, noise: Noise, *, training: bool, halt: NDArray[np.bool_] | None = None) -> None:
        self._task = task
        self._sensor_std = float(noise.sensor_std)
        self._simulation = _open(task, noise, training=training)
        if self._simulation.sense is None and task.sensed_size != task.observation_size:
            sizes = f"{task.sensed_size} entries of {task.observation_size} readings"
            raise ValueError(f"task {task.name}: expected a simulation with `sense`, since brains sense {sizes}")
        self._loop = _loop_of(self._simulation, task.name)
        self._halt = np.zeros(1, dtype=np.bool_) if halt is None else halt

    def run(
        self,
        shares: Iterable[Share],
        acting: Acting,
        episodes: Sequence[EpisodeSeeds],
        tally: Tally,
        trace: NDArray[np.float64] | None = None,
    ) -> None:
        """Run brains through episodes.

        Args:
            shares: which of them; taken one by one.
            acting: who acts.
            episodes: that shares count.
            tally: of all of them; what belongs to `shares` is overwritten.
            trace: (steps + 1, columns) to record the path of the last one, see `Trace`.
        """
        brains, action_low, action_span = acting
        buffers = self._buffers(brains, noisy_action=bool(action_low.any() or action_span.any()))
        disturbance = (self._sensor_std, *map(float, self._task.observation_limits), action_low, action_span)
        world, halt, located = self._simulation.world, self._halt, len(self._task.trace_columns)
        if trace is None:
            trace = np.zeros((0, located + len(self._task.terms)))
        for episode, *chosen in shares:
            rngs, own = map(generator, episodes[episode]), Tally(*(values[episode] for values in tally))
            with uninterrupted():
                self._loop(world, brains, *chosen, *rngs, disturbance, buffers, halt, own, trace, located)

    def tiles(self) -> NDArray[np.float64] | None:
        """The world as the last episode left it, see `HasTiles`; None where there are no tiles."""
        return self._task.tiles(self._simulation.world) if isinstance(self._task, HasTiles) else None

    def _buffers(self, brains: Brains, *, noisy_action: bool) -> tuple[NDArray[np.float64], ...]:
        """What the loop writes into: noise has no columns where there is none."""
        task, memory = self._task, np.zeros(memory_size(brains))
        inputs, actions, steps = task.observation_size, len(task.actuator_names), task.longest_episode
        sensed = memory[: task.sensed_size]
        return (
            memory,  # values of the largest brain and a scratch entry for each of its nodes
            # (inputs,) readings: without a `sense` they need no copying, since they are what is sensed.
            sensed if self._simulation.sense is None else np.zeros(inputs),
            sensed,
            np.zeros(actions),
            np.zeros(len(task.terms)),
            np.zeros((steps, inputs if self._sensor_std > 0.0 else 0)),  # noise of the sensors
            np.zeros((steps, actions if noisy_action else 0)),  # of the action
        )


def _open(task: Task, noise: Noise, *, training: bool) -> Simulation:
    if isinstance(task, HasInitialPose):
        return task.open_disturbed(training=training, reset_scale=noise.reset_scale)
    return task.open(training=training)
