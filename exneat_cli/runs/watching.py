"""One recorded episode of a champion: what its world was, what its networks held, and how far it got."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exneat_cli.brains import places_in_memory
from exneat_cli.errors import ExneatError
from exneat_cli.records import RunDirectory
from exneat_cli.records.champion import Champion
from exneat_cli.rollouts import Noise, Sweep, perturbed, record
from exneat_cli.runs.robustness import load_champion, load_settings
from exneat_cli.seeding import EpisodeSeeds, shared_episodes, stream
from exneat_cli.tasks import HasDistance, HasPicture, Task

SMOOTHED = 1.0
"""Seconds over which a speed is taken."""


@dataclass(frozen=True)
class Scene:
    """An episode of T steps that can be drawn.

    Attributes:
        task: whose cameras draw it.
        champion: who acted.
        title: the run in a word.
        nodes: inputs and nodes of modules, see `exneat_cli.brains.places_in_memory`.
        snapshots: T of the world.
        shares: (T, nodes) their values over the largest magnitude so far.
        captions: T of them.
        period: seconds per step, None where steps have no duration.
    """

    task: Task
    champion: Champion
    title: str
    nodes: list[tuple[int, int]]
    snapshots: list[Any]
    shares: NDArray[np.float64]
    captions: list[str]
    period: float | None


def record_champion(
    directory: RunDirectory, *, episode: int, seed: int | None, sweep: Sweep | None, steps: int
) -> Scene:
    """Let a run's champion go through a test episode, of at most so many steps.

    Args:
        directory: of a finished run.
        episode: which of the test episodes, from 0; the first is that of trace.csv.
        seed: root of other episodes instead; None for the test episodes.
        sweep: with one level, at which it is watched.
        steps: at most.

    Raises:
        ExneatError: the run has no champion, its task has no pictures, or the sweep does not fit it.
    """
    settings = load_settings(directory)
    champion, task, noise = load_champion(directory, settings), settings.task, settings.noise
    if sweep is not None:
        task, noise = perturbed(task, noise, sweep, sweep.levels[0])
    if not isinstance(task, HasPicture):
        fix = "a class of yours is watched once it has the methods snapshot() and camera(), see HasPicture"
        raise ExneatError(f"run={directory.path}: expected a robot or a grid world, got task={task.name}\n  {fix}")
    recording = record(task, noise, champion.brain(), _seeds(episode, seed), steps)
    places = places_in_memory(
        champion.plan, [genome.in_arrays() for genome in champion.genomes], feed_forward=champion.feed_forward
    )
    nodes = list(places)
    values = recording.values[:, [places[node] for node in nodes]]
    if not champion.feed_forward:
        # What a module read of another one is what that one held at the step before.
        linked = [
            k for k, (m, key) in enumerate(nodes) if key < 0 and not champion.plan.modules[m].pins[-1 - key].is_sensor
        ]
        values[1:, linked] = values[:-1, linked].copy()
        values[0, linked] = 0.0
    # So far: nodes of relu that feed themselves may grow without bounds, and would seem to begin with nothing.
    largest = np.maximum.accumulate(np.abs(values), axis=0)
    period = float(task.seconds_of(1)) if isinstance(task, HasDistance) else None
    captions = _captions(task, recording.trace, len(values), period)
    title = directory.path.name + _level(sweep, noise)
    shares = values / np.where(largest > 0.0, largest, 1.0)
    return Scene(task, champion, title, nodes, recording.snapshots, shares, captions, period)


def _seeds(episode: int, seed: int | None) -> EpisodeSeeds:
    if seed is None:
        return shared_episodes("test", episode + 1)[-1]
    return EpisodeSeeds(*(stream(seed, "test", episode, kind) for kind in range(3)))


def _level(sweep: Sweep | None, noise: Noise) -> str:
    return "" if sweep is None else f", {sweep.name} {sweep.levels[0]:g}"


def _captions(task: Task, trace: NDArray[np.float64], steps: int, period: float | None) -> list[str]:
    """Of the world as it is before each step."""
    columns = list(task.trace_columns)
    if period is not None:
        x = trace[:, columns.index("x")]
        window = max(1, round(SMOOTHED / period))
        first = np.maximum(0, np.arange(steps) - window)
        seconds = np.maximum(1, np.arange(steps) - first) * period
        speeds = (x[:steps] - x[first]) / seconds
        return [
            f"time {t * period:5.1f} s    speed {speeds[t]:5.2f} m/s    distance {x[t] - x[0]:6.2f} m"
            for t in range(steps)
        ]
    free = [k for k, name in enumerate(columns) if name.endswith("_free")]
    caught = [f", {len(free) - int(row[free].sum())} of {len(free)} caught" if free else "" for row in trace[:steps]]
    colours = "red, blue: channels; green: agent; yellow: prey or goal"
    return [f"step {t}{words}    {colours}" for t, words in enumerate(caught)]
