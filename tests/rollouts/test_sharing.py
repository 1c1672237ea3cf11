"""How work is shared out among threads, and what becomes of it when one of them breaks."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.random import Generator

from exneat_cli.brains import motionless
from exneat_cli.rollouts import Executor, Noise, Runner
from exneat_cli.rollouts.pieces import Parcels, Pieces
from exneat_cli.seeding import training_episodes
from exneat_cli.tasks import Simulation, TrackMaze


@given(st.integers(1, 300), st.integers(0, 40), st.integers(1, 20))
@settings(deadline=None)
def test_every_brain_is_given_out_once_in_each_episode_and_no_piece_crosses_an_episode(
    brains: int, episodes: int, threads: int
) -> None:
    pieces, given_out = Pieces(brains, episodes, threads), []
    while (piece := pieces.take()) is not None:
        episode, first, last = piece
        assert 0 <= first < last <= brains
        given_out += [(episode, brain) for brain in range(first, last)]
    assert given_out == [(episode, brain) for episode in range(episodes) for brain in range(brains)]
    assert pieces.take() is None


@given(st.integers(1, 60), st.integers(0, 30), st.integers(1, 200), st.integers(1, 20))
def test_every_brain_travels_to_each_episode_once_and_no_parcel_is_larger_than_asked(
    brains: int, episodes: int, runs: int, most_brains: int
) -> None:
    parcels, given_out = Parcels(brains, episodes, most_brains), []
    while (parcel := parcels.take(runs)) is not None:
        assert 0 < parcel.runs <= runs
        assert parcel.last_brain - parcel.first_brain <= most_brains
        for brain in range(parcel.first_brain, parcel.last_brain):
            given_out += [(brain, e) for e in range(parcel.first_episode, parcel.last_episode)]
    assert given_out == [(brain, episode) for brain in range(brains) for episode in range(episodes)]
    assert parcels.left == 0


def test_one_thread_draws_each_world_once_and_many_end_with_single_brains() -> None:
    def lengths(threads: int) -> list[int]:
        pieces = Pieces(50, 4, threads)
        return [last - first for _, first, last in iter(pieces.take, None)]

    assert lengths(1) == [50] * 4
    assert lengths(8)[0] > 1
    assert lengths(8)[-8:] == [1] * 8


def test_an_error_in_one_thread_stops_the_others_reaches_the_caller_and_leaves_the_runner_usable() -> None:
    task, episodes, open_world = TrackMaze(), training_episodes(0, 0, 20), TrackMaze.open
    brains = [motionless(8, np.eye(5)[k % 5]) for k in range(20)]
    pieces = len(list(iter(Pieces(len(brains), len(episodes), 2).take, None)))
    begun: list[Any] = []

    def open_fragile(task: TrackMaze, **options: Any) -> Simulation:
        simulation = open_world(task, **options)

        def reset(world: Any, rng: Generator) -> None:
            begun.append(world)
            if len(begun) == 3:
                raise RuntimeError("broken")
            simulation.reset(world, rng)

        return dataclasses.replace(simulation, reset=reset, compiled=False)

    with Runner(task, Noise(), Executor("threads", 2), training=True) as runner:
        expected = runner.run(brains, episodes)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(TrackMaze, "open", open_fragile)
        with Runner(task, Noise(), Executor("threads", 2), training=True) as runner:
            with pytest.raises(RuntimeError, match="broken"):
                runner.run(brains, episodes)
            assert 3 <= len(begun) < pieces
            again = runner.run(brains, episodes)
    for values, others in zip(again, expected, strict=True):
        np.testing.assert_array_equal(values, others)
