"""What is filmed is the episode that is scored, and the values that are shown are those that the networks had."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exneat_cli.brains import places_in_memory
from exneat_cli.records.champion import read_champion
from exneat_cli.rollouts import Executor, Noise, Runner, record
from exneat_cli.runs import RunSettings, record_champion, train
from exneat_cli.seeding import shared_episodes
from exneat_cli.tasks import AntTask, Hunting
from exneat_cli.wiring import Geometry

SHORT: Any = {"population": 6, "generations": 3, "validation_episodes": 1, "test_episodes": 1}
NOISE = Noise(sensor_std=0.1)
SETTINGS = {
    "feed-forward, linked, with a central module": RunSettings(
        task=AntTask(max_steps=20), geometry=Geometry("lr"), linkage="full", noise=NOISE, **SHORT
    ),
    "recurrent, linked": RunSettings(
        task=Hunting(steps=15), geometry=Geometry("all"), linkage="output", noise=NOISE, **SHORT
    ),
}
FUNCTIONS = {"tanh": lambda z: np.tanh(np.clip(2.5 * z, -60.0, 60.0)), "relu": lambda z: np.maximum(z, 0.0)}


@pytest.mark.parametrize("name", SETTINGS)
def test_a_recorded_episode_is_that_of_a_runner_and_every_value_follows_from_those_that_it_reads(
    name: str, tmp_path: Path
) -> None:
    settings = SETTINGS[name]
    champion = read_champion(train(RunSettings(**{**vars(settings), "output": str(tmp_path)})).directory.champion)
    (seeds,) = shared_episodes("test", 1)
    with Runner(settings.task, settings.noise, Executor("serial"), training=False) as runner:
        expected, _ = runner.trace(champion.brain(), seeds)
    recording = record(settings.task, settings.noise, champion.brain(), seeds, 1000)  # type: ignore[arg-type]
    np.testing.assert_array_equal(recording.trace, expected)
    assert len(recording.values) == len(expected) - 1
    steps_have_duration = settings.task.step_seconds is not None
    assert len(recording.snapshots) == len(expected) - steps_have_duration, "what a step that ends it led to is seen"
    genomes = [genome.in_arrays() for genome in champion.genomes]
    places = places_in_memory(champion.plan, genomes, feed_forward=champion.feed_forward)
    now = recording.values
    before = np.vstack([np.zeros_like(now[:1]), now[:-1]])
    checked = 0
    for m, module in enumerate(champion.plan.modules):
        genome = champion.genomes[module.subpopulation]
        for node in (each for each in genome.nodes if (m, each.id) in places):
            total = np.zeros(len(now))
            for gene in genome.connections:
                if gene.target == node.id and gene.enabled:
                    is_sensed = gene.source < 0 and module.pins[-1 - gene.source].is_sensor
                    is_old = not champion.feed_forward and not is_sensed
                    total += gene.weight * (before if is_old else now)[:, places[m, gene.source]]
            value = FUNCTIONS[node.activation](node.bias + node.response * total)
            np.testing.assert_allclose(now[:, places[m, node.id]], value, rtol=1e-12, atol=1e-12)
            checked += np.ptp(value) > 0.0
        for k, pin in enumerate(module.pins):
            if pin.is_sensor:
                assert places[m, -1 - k] == pin.index
            elif champion.feed_forward and pin.delayed:
                read = before[:, places[pin.module, pin.index]] if (pin.module, pin.index) in places else 0.0
                np.testing.assert_array_equal(now[:, places[m, -1 - k]], read)
    assert checked > 3


def test_a_film_says_time_distance_and_what_was_caught_and_ends_when_told(tmp_path: Path) -> None:
    directories = [
        train(RunSettings(**{**vars(settings), "output": str(tmp_path)})).directory for settings in SETTINGS.values()
    ]
    walk, hunt = (record_champion(each, episode=0, seed=None, sweep=None, steps=5, fps=None) for each in directories)
    assert walk.captions[0] == "time   0.0 s    speed  0.00 m/s    distance   0.00 m"
    assert walk.captions[2].startswith("time   0.2 s")
    assert re.match(r"step 0, \d of 10 caught", hunt.captions[0])
    assert len(walk.snapshots) == len(walk.captions) == len(walk.shares) == 3, "every second one, in real time"
    assert len(hunt.snapshots) == len(hunt.captions) == len(hunt.shares) == 6, "and what the last step led to"
    assert hunt.captions[-1].startswith("step 5,")
    assert (walk.fps, hunt.fps) == (10.0, 4.0)
    assert np.abs(walk.shares).max() == 1.0
    other = record_champion(directories[1], episode=0, seed=9, sweep=None, steps=5, fps=None)
    assert not np.array_equal(other.snapshots[0][0], hunt.snapshots[0][0])
