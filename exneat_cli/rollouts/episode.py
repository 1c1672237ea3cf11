"""The one loop in which every episode of every task and brain runs.

A step is: observe -> sensor noise and clipping -> sense -> brain -> action noise -> drive -> step.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exneat_cli.brains import Brains
from exneat_cli.brains.brain import activate, memory_size
from exneat_cli.compiling import compiled_lean, with_functions
from exneat_cli.interruption import uninterrupted
from exneat_cli.rollouts.settings import Noise
from exneat_cli.seeding import EpisodeSeeds, generator
from exneat_cli.tasks import RUNNING, HasInitialPose, HasPicture, Simulation, Task

Acting = tuple[Brains, NDArray[np.float64], NDArray[np.float64]]
"""Brains, low and span, the latter two (A,): low + U(0, span) is added to the brains' actions."""
Share = tuple[int, int, int]
"""Index of an episode, index of the first brain to run through it, and one past that of the last."""
Tally = tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]
"""The results that the loop writes for B brains in E episodes.

Status, ``ENDED`` or ``FAILED``, and number of control steps, (E, B); sums of the reward terms, (E, B, terms); means of
the sensed values, and sums of squared deviations from them, (E, B, sensed), or (E, B, 0) if they are not wanted.
"""


def empty_tally(task: Task, brains: int, episodes: int, *, moments: bool) -> Tally:
    """A tally of zeros."""
    shape, sensed = (episodes, brains), task.sensed_size if moments else 0
    statuses, steps = np.zeros((2, *shape), np.int64)
    means, squares = np.zeros((2, *shape, sensed))
    return statuses, steps, np.zeros((*shape, len(task.terms))), means, squares


def _episodes(  # type: ignore[no-untyped-def]
    world, brains, first, last, world_rng, sensor_rng, action_rng, disturbance, buffers, halt, tally, trace, located
):
    """Draw one world and run the brains from `first` to before `last` through it, each from its start.

    The names reset, rewind, observe, sense, drive, step and locate are bound by `_loop_of`; `disturbance` and `buffers`
    are described in `run_shares` and `_buffers`. Another thread sets `halt`, (1,), to stop the loop. `tally` is that of
    one episode. `trace`, (steps + 1, located + terms), gets the path of the last brain, as far as it has rows.
    """
    memory, readings, sensed, action, terms, sensor_noise, action_noise = buffers
    statuses, steps, totals, means, squares = tally
    drawn = 0
    reset(world, world_rng)  # type: ignore[name-defined]  # noqa: F821
    for b in range(first, last):
        if b > first:
            rewind(world)  # type: ignore[name-defined]  # noqa: F821
        memory[:] = 0.0
        terms[:] = 0.0
        totals[b] = 0.0
        means[b] = 0.0
        squares[b] = 0.0
        t, status = 0, RUNNING
        while True:
            if t < trace.shape[0]:
                if located > 0:
                    locate(world, trace[t, :located])  # type: ignore[name-defined]  # noqa: F821
                for i in range(terms.size):
                    trace[t, located + i] = terms[i]
            if status != RUNNING:
                break
            if halt[0]:
                return
            # Noise is drawn when the first brain needs it and kept for the others, so that it is the same for all.
            if t == drawn:
                _draw_noise(sensor_rng, action_rng, disturbance, sensor_noise, action_noise, t)
                drawn += 1
            observe(world, readings)  # type: ignore[name-defined]  # noqa: F821
            _disturb(readings, sensor_noise, t, disturbance)
            sense(world, readings, sensed)  # type: ignore[name-defined]  # noqa: F821
            _add_moments(sensed, t, means[b], squares[b])
            activate(brains, b, memory, action)
            for i in range(action_noise.shape[1]):
                action[i] += action_noise[t, i]
            drive(world, action)  # type: ignore[name-defined]  # noqa: F821
            status = step(world, action, terms)  # type: ignore[name-defined]  # noqa: F821
            for i in range(terms.size):
                totals[b, i] += terms[i]
            t += 1
        statuses[b] = status
        steps[b] = t


@compiled_lean
def _draw_noise(sensor_rng, action_rng, disturbance, sensor_noise, action_noise, t):  # type: ignore[no-untyped-def]
    """Draw the noise of step t on the readings, then on the action."""
    sensor_std, _, _, action_low, action_span = disturbance
    for i in range(sensor_noise.shape[1]):
        sensor_noise[t, i] = sensor_rng.normal(0.0, sensor_std)
    for i in range(action_noise.shape[1]):
        action_noise[t, i] = action_low[i] + action_span[i] * action_rng.random()


@compiled_lean
def _disturb(readings, noise, t, disturbance):  # type: ignore[no-untyped-def]
    """Add the noise of step t to the readings and clip them, in place."""
    _, lowest, highest, _, _ = disturbance
    for i in range(noise.shape[1]):
        readings[i] += noise[t, i]
    if highest < np.inf:
        for i in range(readings.size):
            readings[i] = min(max(readings[i], lowest), highest)


@compiled_lean
def _add_moments(sensed, t, means, squares):  # type: ignore[no-untyped-def]
    """Update the moments with the values sensed at step t; `means` and `squares` are empty if they are not wanted.

    Source: Welford, "Note on a method for calculating corrected sums of squares and products", 1962.
    """
    for i in range(means.size):
        deviation = sensed[i] - means[i]
        means[i] += deviation / (t + 1)
        squares[i] += deviation * (sensed[i] - means[i])


@compiled_lean
def _unchanged(world, *values):  # type: ignore[no-untyped-def]
    """Do nothing: in place of `sense` (readings and sensed values are then one array), `drive` or `locate`."""


def _loop_of(simulation: Simulation, task: str) -> Callable[..., Any]:
    """The loop for one kind of world, whose task has this name: compiled if its functions are, else plain Python."""
    names = ("reset", "rewind", "observe", "sense", "drive", "step", "locate")
    # The world of plain Python functions may be an object that compiled code cannot handle.
    default = _unchanged if simulation.compiled else _unchanged.py_func  # type: ignore[attr-defined]
    functions = {name: getattr(simulation, name) or default for name in names}
    return _compiled_loop(task, **functions) if simulation.compiled else with_functions(_episodes, task, **functions)


@functools.cache
def _compiled_loop(task: str, **functions: Callable[..., Any]) -> Callable[..., Any]:
    # Worlds of one task may have different functions, or none for `sense`; the cache tells loops apart only by name.
    name = "_".join(("episodes_of", task, *(function.__name__ for function in functions.values())))
    return compiled_lean(with_functions(_episodes, name, **functions))


def open_world(task: Task, noise: Noise, *, training: bool) -> Simulation:
    """Open a world of a task, with this noise on its initial pose, if it has one.

    Raises:
        ValueError: the world has no `sense`, but its task has another number of sensed values than of readings.
    """
    if isinstance(task, HasInitialPose) and noise.reset_scale is not None:
        simulation = task.open_disturbed(training=training, reset_scale=noise.reset_scale)
    else:
        simulation = task.open(training=training)
    if simulation.sense is None and task.sensed_size != task.observation_size:
        sizes = f"{task.sensed_size} entries of {task.observation_size} readings"
        raise ValueError(f"task {task.name}: expected a simulation with `sense`, since brains sense {sizes}")
    return simulation


def run_shares(
    task: Task,
    noise: Noise,
    halt: NDArray[np.bool_],
    simulation: Simulation,
    shares: Iterable[Share],
    acting: Acting,
    episodes: Sequence[EpisodeSeeds],
    tally: Tally,
    trace: NDArray[np.float64] | None = None,
) -> None:
    """Run brains through episodes in a world that was opened for this task and noise.

    `shares` say which, as indices of brains and `episodes`, and are taken one by one; their entries of `tally` are
    overwritten. Another thread sets `halt`, (1,), to stop. `trace`, (steps + 1, columns), gets the path of the last
    brain, see `Trace`.
    """
    brains, action_low, action_span = acting
    # Sd of the sensor noise, lower and upper limit of noisy readings, and low and span of the action, see `Acting`.
    disturbance = (float(noise.sensor_std), *map(float, task.observation_limits), action_low, action_span)
    noisy = noise.sensor_std > 0.0, bool(action_low.any() or action_span.any())
    buffers = _buffers(task, simulation, brains, *noisy)
    loop, located = _loop_of(simulation, task.name), len(task.trace_columns)
    if trace is None:
        trace = np.zeros((0, located + len(task.terms)))
    for episode, *chosen in shares:
        rngs, own = map(generator, episodes[episode]), tuple(values[episode] for values in tally)
        with uninterrupted():
            loop(simulation.world, brains, *chosen, *rngs, disturbance, buffers, halt, own, trace, located)


class Recording(NamedTuple):
    """One episode of one brain, step by step.

    Attributes:
        snapshots: the world as the brain sensed it, see `exneat_cli.tasks.HasPicture`, at step 0 and every `every`
            steps after that; if steps have no duration, also after the last step.
        values: (T, memory) the brain's value vector after each step.
        trace: (T + 1, columns), see `exneat_cli.rollouts.Trace`.
    """

    snapshots: list[Any]
    values: NDArray[np.float64]
    trace: NDArray[np.float64]


def record(task: HasPicture, noise: Noise, brain: Brains, seeds: EpisodeSeeds, steps: int, every: int = 1) -> Recording:
    """Run an episode of at most `steps` steps in the same loop as all others, but in plain Python."""
    assert isinstance(task, Task)
    simulation, halt = open_world(task, noise, training=False), np.zeros(1, np.bool_)
    ties = np.full(len(task.actuator_names), task.tie_noise)
    disturbance = (float(noise.sensor_std), *map(float, task.observation_limits), 0.0 * ties, ties)
    buffers = _buffers(task, simulation, brain, noise.sensor_std > 0.0, bool(ties.any()))
    snapshots: list[Any] = []
    values: list[NDArray[np.float64]] = []

    def observe(world: Any, readings: NDArray[np.float64]) -> None:
        if len(values) % every == 0:
            snapshots.append(task.snapshot(world))
        simulation.observe(world, readings)

    def step(world: Any, action: NDArray[np.float64], terms: NDArray[np.float64]) -> int:
        values.append(buffers[0].copy())
        halt[0] = len(values) == steps
        return int(simulation.step(world, action, terms))

    nothing = _unchanged.py_func  # type: ignore[attr-defined]
    names = ("reset", "rewind", "sense", "drive", "locate")
    functions = {name: getattr(simulation, name) or nothing for name in names}
    loop = with_functions(_episodes, task.name, observe=observe, step=step, **functions)
    tally = tuple(each[0] for each in empty_tally(task, 1, 1, moments=False))
    located = len(task.trace_columns)
    trace = np.zeros((task.longest_episode + 1, located + len(task.terms)))
    with uninterrupted():
        loop(simulation.world, brain, 0, 1, *map(generator, seeds), disturbance, buffers, halt, tally, trace, located)
    if task.step_seconds is None:  # show how such an episode ends: the goal is reached, or the last prey caught
        snapshots.append(task.snapshot(simulation.world))
    return Recording(snapshots, np.array(values), trace[: len(values) + 1].copy())


def _buffers(
    task: Task, simulation: Simulation, brains: Brains, noisy_readings: bool, noisy_action: bool
) -> tuple[NDArray[np.float64], ...]:
    """Arrays that the loop overwrites, valid during one call; noise arrays have no columns if there is no noise."""
    memory, steps = np.zeros(memory_size(brains)), task.longest_episode
    inputs, actions = task.observation_size, len(task.actuator_names)
    sensed = memory[: task.sensed_size]
    return (
        memory,  # values of the largest brain and a scratch entry for each of its nodes
        # (inputs,) readings: without a `sense` they are the sensed values, and are not copied.
        sensed if simulation.sense is None else np.zeros(inputs),
        sensed,
        np.zeros(actions),
        np.zeros(len(task.terms)),
        np.zeros((steps, inputs if noisy_readings else 0)),  # noise of the sensors
        np.zeros((steps, actions if noisy_action else 0)),  # noise on the action
    )
