"""One recorded episode of a champion: the states of its world, the values in its networks, and how far it got."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exneat_cli.brains import places_in_memory
from exneat_cli.errors import ExneatError
from exneat_cli.records import RunDirectory
from exneat_cli.records.champion import Champion
from exneat_cli.rollouts import Recording, Sweep, perturbed, record
from exneat_cli.runs.robustness import load_champion, load_settings
from exneat_cli.seeding import EpisodeSeeds, shared_episodes, stream
from exneat_cli.tasks import HasDistance, HasPicture, HasTiles, Task

SMOOTHED = 1.0
"""Seconds over which a speed is averaged."""
BODY_FPS, STEP_FPS = 10.0, 4.0
"""Default frames per second: for bodies, of simulated time, with at most one frame per control step; where steps have
no duration, with one frame per step."""


@dataclass(frozen=True)
class Scene:
    """An episode that can be drawn in F frames.

    Attributes:
        task: whose cameras draw it.
        champion: who acted.
        title: the run's name, and the sweep with its level, if any.
        nodes: inputs and nodes of modules, see `exneat_cli.brains.places_in_memory`.
        snapshots: F states of the world.
        shares: (F, nodes), the nodes' values divided by their largest magnitude so far.
        captions: F texts.
        fps: frames per second, in real time where steps have a duration.
    """

    task: Task
    champion: Champion
    title: str
    nodes: list[tuple[int, int]]
    snapshots: list[Any]
    shares: NDArray[np.float64]
    captions: list[str]
    fps: float


def record_champion(
    directory: RunDirectory, *, episode: int, seed: int | None, sweep: Sweep | None, steps: int, fps: float | None
) -> Scene:
    """Run a run's champion in a test episode of at most `steps` steps.

    Args:
        directory: of a finished run.
        episode: which of the test episodes, from 0; the first is that of trace.csv.
        seed: root of other episodes instead; None for the test episodes.
        sweep: with one level, at which to watch it; None for no perturbation.
        steps: the largest number of control steps.
        fps: frames per second; None for `BODY_FPS` or `STEP_FPS`.

    Raises:
        ExneatError: the run has no champion, its task cannot be drawn, or the sweep does not fit it.
    """
    settings = load_settings(directory)
    champion, task, noise = load_champion(directory, settings), settings.task, settings.noise
    if sweep is not None:
        task, noise = perturbed(task, noise, sweep, sweep.levels[0])
    task, period = task.drawable(), task.step_seconds
    if not isinstance(task, HasPicture):
        fix = "a class of your own needs the methods snapshot() and camera() for that, see HasPicture"
        raise ExneatError(f"task={task.name}: expected a task whose worlds can be drawn\n  {fix}")
    every = 1 if period is None else max(1, round(1.0 / ((fps or BODY_FPS) * period)))
    recording = record(task, noise, champion.brain(), _seeds(episode, seed), steps, every)
    nodes, values = _values(champion, recording, every)
    captions = _captions(task, recording.trace, range(0, len(values), every))
    level = "" if sweep is None else f", {sweep.name} {sweep.levels[0]:g}"
    # Only so far: relu nodes that feed themselves may grow without bounds, and would seem to be 0 at first.
    largest = np.maximum.accumulate(np.abs(values), axis=0)
    shares = (values / np.where(largest > 0.0, largest, 1.0))[::every]
    pace = (fps or STEP_FPS) if period is None else 1.0 / (every * period)
    return Scene(task, champion, directory.path.name + level, nodes, recording.snapshots, shares, captions, pace)


def _values(champion: Champion, recording: Recording, every: int) -> tuple[list[tuple[int, int]], NDArray[np.float64]]:
    """Inputs and nodes that are ever evaluated, and their values (steps, nodes) in the world of each step."""
    genomes = [genome.in_arrays() for genome in champion.genomes]
    places = places_in_memory(champion.plan, genomes, feed_forward=champion.feed_forward)
    nodes = list(places)
    values = recording.values[:, list(places.values())]
    if not champion.feed_forward:
        # A module reads the values that another one had at the step before.
        modules = champion.plan.modules
        linked = [k for k, (m, key) in enumerate(nodes) if key < 0 and not modules[m].pins[-1 - key].is_sensor]
        values[1:, linked] = values[:-1, linked].copy()
        values[0, linked] = 0.0
    if len(recording.snapshots) > len(values[::every]):  # the world after the last step, which no network senses
        values = np.concatenate([values, values[-1:]])
    return nodes, values


def _seeds(episode: int, seed: int | None) -> EpisodeSeeds:
    if seed is None:
        return shared_episodes("test", episode + 1)[-1]
    return EpisodeSeeds(*(stream(seed, "test", episode, kind) for kind in range(3)))


def _captions(task: Task, trace: NDArray[np.float64], shown: range) -> list[str]:
    """Captions for the world before each of these steps."""
    columns, period = list(task.trace_columns), task.step_seconds
    times = [f"step {t}" if period is None else f"time {t * period:5.1f} s" for t in shown]
    if isinstance(task, HasTiles):
        free = [k for k, name in enumerate(columns) if name.endswith("_free")]
        caught = [f", {len(free) - int(trace[t, free].sum())} of {len(free)} caught" if free else "" for t in shown]
        colours = "red, blue: channels; green: agent; yellow: prey or goal"
        return [f"{time}{words}    {colours}" for time, words in zip(times, caught, strict=True)]
    if isinstance(task, HasDistance) and period is not None:
        x, said = trace[:, columns.index("x")], []
        for t in shown:
            first = max(0, t - max(1, round(SMOOTHED / period)))
            speed = (x[t] - x[first]) / (max(1, t - first) * period)
            # Adding 0 turns a rounded -0.0 into 0.0.
            said.append(f"    speed {round(speed, 2) + 0.0:5.2f} m/s    distance {round(x[t] - x[0], 2) + 0.0:6.2f} m")
    else:
        fitness = task.fitness_of(np.cumsum(trace[:, len(columns) :], axis=0))
        said = [f"    {task.fitness_name} {fitness[t]:.{task.fitness_decimals}f}" for t in shown]
    return [time + words for time, words in zip(times, said, strict=True)]
