"""Foraging and hunting: rates and laws as stated."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
import pytest
from scipy.stats import binomtest, chisquare

from exneat_cli.brains import RandomActions, linear_fusion
from exneat_cli.rollouts import Executor, Job, Noise, Runner
from exneat_cli.seeding import shared_episodes, stream
from exneat_cli.tasks import ENDED, RUNNING, Foraging, Hunting
from exneat_cli.tasks.grid import COLUMN, MOVES, ROW, STAY
from exneat_cli.tasks.prey_dynamics import (
    FREE,
    LONGEST_FLIGHT,
    PREY_COLUMN,
    PREY_ROW,
    Field,
    _shuffle,
    move_prey,
    reset,
    step,
)

ALPHA = 1e-4
REST = np.eye(len(MOVES))[STAY]


def field(task: Foraging, seed: int = 0) -> tuple[Field, np.random.Generator]:
    world: Field = task.open(training=False, reset_scale=0.0).world
    rng = np.random.default_rng(seed)
    reset(world, rng)
    return world, rng


def rest(world: Field, rng: np.random.Generator) -> int:
    status: int = step(world, REST, rng, np.zeros(1))
    return status


def hide_agent(world: Field) -> None:
    """Out of everyone's way: on a wall, where no prey can come."""
    world.grid.agent[ROW], world.grid.agent[COLUMN] = 1, 0


def test_prey_start_on_distinct_tiles_and_never_on_the_agents() -> None:
    tiles: Counter[tuple[int, int]] = Counter()
    for seed in range(400):
        world, _ = field(Foraging(), seed)
        places = {(int(p[PREY_ROW]), int(p[PREY_COLUMN])) for p in world.prey}
        assert len(places) == 10
        assert (6, 6) not in places
        tiles.update(places)
    assert len(tiles) == 99
    assert chisquare(list(tiles.values())).pvalue > ALPHA


def test_a_full_field_has_a_prey_on_every_other_tile() -> None:
    world, _ = field(Foraging(size=3, n_prey=8))
    assert len({(int(p[PREY_ROW]), int(p[PREY_COLUMN])) for p in world.prey}) == 8


def test_foraging_prey_never_move() -> None:
    world, rng = field(Foraging())
    before = world.prey[:, :2].copy()
    while rest(world, rng) == RUNNING:
        np.testing.assert_array_equal(world.prey[:, :2], before)


@pytest.mark.parametrize("p_m", [0.0, 0.3, 1.0])
def test_prey_move_at_the_stated_rate(p_m: float) -> None:
    # In a wide field with one prey and no walls near, every move changes the tile.
    moved, steps = 0, 0
    for seed in range(60):
        world, rng = field(Hunting(size=99, n_prey=1, p_m=p_m, steps=40), seed)
        hide_agent(world)
        world.prey[0, :2] = 50
        for _ in range(39):
            before = world.prey[0, :2].copy()
            rest(world, rng)
            moved += bool((world.prey[0, :2] != before).any())
            steps += 1
    assert binomtest(moved, steps, p_m).pvalue > ALPHA if 0 < p_m < 1 else moved == p_m * steps


def runs_of(world: Field, rng: np.random.Generator, moves: int) -> list[int]:
    """Lengths of flights, told by the counter of steps left at each flight's start."""
    lengths = []
    for _ in range(moves):
        world.prey[0, :2] = 50
        if world.prey[0, 4] == 0:
            move_prey(world.prey, 0, world.grid.path, world.flight_chance, world.levy, rng)
            lengths.append(int(world.prey[0, 4]) + 1)
        else:
            move_prey(world.prey, 0, world.grid.path, world.flight_chance, world.levy, rng)
    return lengths


def test_levy_flights_have_lengths_of_the_stated_law_and_brownian_ones_a_single_tile() -> None:
    world, rng = field(Hunting(size=99, n_prey=1))
    lengths = Counter(runs_of(world, rng, 20_000))
    assert set(lengths) == set(range(1, LONGEST_FLIGHT + 1))
    law = np.arange(1.0, LONGEST_FLIGHT + 1) ** -2
    observed = np.array([lengths[k] for k in range(1, LONGEST_FLIGHT + 1)])
    assert chisquare(observed, observed.sum() * law / law.sum()).pvalue > ALPHA
    world, rng = field(Hunting(size=99, n_prey=1, motion="brownian"))
    assert set(runs_of(world, rng, 500)) == {1}


def test_directions_are_equally_likely_and_a_flight_is_straight() -> None:
    world, rng = field(Hunting(size=99, n_prey=1))
    directions: Counter[tuple[int, int]] = Counter()
    last, left = (0, 0), 0
    for _ in range(20_000):
        world.prey[0, :2] = 50
        starts = left == 0
        move_prey(world.prey, 0, world.grid.path, world.flight_chance, world.levy, rng)
        left = int(world.prey[0, 4])
        now = (int(world.prey[0, 0]) - 50, int(world.prey[0, 1]) - 50)
        if starts:
            directions[now] += 1
        else:
            assert now == last
        last = now
    assert len(directions) == 4
    assert chisquare(list(directions.values())).pvalue > ALPHA


def test_a_wall_ends_a_flight_and_the_next_one_takes_any_direction() -> None:
    ends: Counter[tuple[int, int]] = Counter()
    for seed in range(200):
        world, rng = field(Hunting(n_prey=1), seed)
        world.prey[0] = (1, 5, 1, MOVES.index("up"), 5)
        for _ in range(2):
            move_prey(world.prey, 0, world.grid.path, world.flight_chance, world.levy, rng)
            if world.prey[0, 4] == 0 and tuple(world.prey[0, :2]) == (1, 5):
                continue
        ends[int(world.prey[0, 0]), int(world.prey[0, 1])] += 1
    assert set(ends) == {(1, 4), (1, 6), (2, 5), (1, 5)}


def test_nobody_leaves_the_field() -> None:
    world, rng = field(Hunting(size=4, n_prey=5, p_m=1.0, steps=500))
    while rest(world, rng) == RUNNING:
        assert (world.prey[:, :2] >= 1).all()
        assert (world.prey[:, :2] <= 4).all()


def emissions(p_e: float, **parameters: Any) -> tuple[int, int]:
    """How many of the cues around a lone prey were centred, and how many there were."""
    centred, total = 0, 0
    world, rng = field(Foraging(n_prey=1, p_e=p_e, p_c=1.0, steps=100_000, **parameters))
    hide_agent(world)
    world.prey[0, :2] = 5
    for _ in range(2000):
        rest(world, rng)
        patch = world.grid.signals[0, 3:8, 3:8].ravel()
        np.testing.assert_allclose(np.sort(patch), np.sort(world.patch))
        centred += bool(np.allclose(patch, world.patch))
        total += 1
    return centred, total


@pytest.mark.parametrize("p_e", [0.0, 0.35, 1.0])
def test_cues_have_a_direction_at_the_stated_rate(p_e: float) -> None:
    centred, total = emissions(p_e)
    assert binomtest(centred, total, p_e).pvalue > ALPHA if 0 < p_e < 1 else centred == p_e * total


def test_shuffled_cues_are_uniform_over_the_tiles() -> None:
    rng, counts = np.random.default_rng(3), np.zeros((25, 25))
    for _ in range(20_000):
        values = np.arange(25.0)
        _shuffle(values, rng)
        counts[np.arange(25), values.astype(int)] += 1
    assert chisquare(counts, axis=None).pvalue > ALPHA


def test_every_order_of_a_shuffle_is_equally_likely() -> None:
    rng, orders = np.random.default_rng(4), Counter()
    for _ in range(12_000):
        values = np.arange(4.0)
        _shuffle(values, rng)
        orders[tuple(values)] += 1
    assert len(orders) == 24
    assert chisquare(list(orders.values())).pvalue > ALPHA


def test_the_channels_of_a_hunted_prey_have_a_direction_independently() -> None:
    p_e, outcomes = 0.35, Counter()
    world, rng = field(Hunting(n_prey=1, p_e=p_e, p_c=1.0, p_m=0.0, steps=100_000))
    hide_agent(world)
    world.prey[0, :2] = 5
    for _ in range(4000):
        rest(world, rng)
        patches = world.grid.signals[:, 3:8, 3:8].reshape(2, 25)
        outcomes[tuple(bool(np.allclose(patch, world.patch)) for patch in patches)] += 1
    kinds = [(True, True), (True, False), (False, True), (False, False)]
    law = [p_e * p_e, p_e * (1 - p_e), (1 - p_e) * p_e, (1 - p_e) ** 2]
    assert chisquare([outcomes[kind] for kind in kinds], 4000 * np.array(law)).pvalue > ALPHA


def test_at_full_decay_no_trail_is_left_and_at_none_it_never_fades() -> None:
    world, rng = field(Hunting(n_prey=1, p_e=1.0, p_c=1.0, p_m=0.0, steps=100))
    hide_agent(world)
    world.prey[0, :2] = 2
    rest(world, rng)
    world.prey[0, :2] = 8
    rest(world, rng)
    assert not world.grid.signals[:, :6, :6].any()
    world, rng = field(Hunting(n_prey=1, p_e=1.0, p_c=0.0, p_m=0.0, steps=100))
    hide_agent(world)
    world.grid.signals[:] = 0.0
    world.prey[0, :2] = 5
    for count in range(1, 6):
        rest(world, rng)
        assert world.grid.signals[0, 5, 5] == pytest.approx(count)


@pytest.mark.parametrize("p_c", [0.2, 0.5])
def test_the_field_fades_by_the_stated_share(p_c: float) -> None:
    world, rng = field(Foraging(n_prey=1, p_c=p_c, steps=100))
    world.prey[0, FREE] = 0
    world.grid.signals[:] = 1.0
    world.prey[0, FREE] = 1
    hide_agent(world)
    world.prey[0, :2] = 10
    rest(world, rng)
    np.testing.assert_allclose(world.grid.signals[:, 1:6, 1:6], 1.0 - p_c)


def test_foraging_prey_alternate_channels_and_hunting_prey_use_both() -> None:
    for task, channels in (
        (Foraging(n_prey=2, p_c=1.0), ([0], [1])),
        (Hunting(n_prey=2, p_c=1.0, p_m=0.0), ([0, 1],) * 2),
    ):
        world, rng = field(task)
        hide_agent(world)
        world.prey[0, :2], world.prey[1, :2] = 2, 9
        rest(world, rng)
        for expected, area in zip(channels, (slice(1, 4), slice(7, 11)), strict=True):
            loud = [c for c in (0, 1) if world.grid.signals[c, area, area].any()]
            assert loud == expected


def test_a_caught_prey_neither_moves_nor_emits() -> None:
    world, rng = field(Hunting(n_prey=2, p_c=1.0, p_m=1.0))
    hide_agent(world)
    world.prey[0, FREE] = 0
    world.prey[0, :2], world.prey[1, :2] = 2, 9
    rest(world, rng)
    assert list(world.prey[0, :2]) == [2, 2]
    assert not world.grid.signals[:, :6, :6].any()


def test_stepping_onto_a_prey_catches_it_and_the_last_one_ends_the_episode() -> None:
    world, rng = field(Foraging(n_prey=2))
    world.grid.agent[ROW], world.grid.agent[COLUMN] = 5, 5
    world.prey[:, FREE] = 1
    world.prey[0, :2] = (5, 6)
    world.prey[1, :2] = (5, 7)
    terms, right = np.zeros(1), np.eye(len(MOVES))[MOVES.index("right")]
    assert step(world, right, rng, terms) == RUNNING
    assert list(world.prey[:, FREE]) == [0, 1]
    assert terms[0] == 0.0
    assert step(world, right, rng, terms) == ENDED
    assert terms[0] == 1.0


def test_an_episode_lasts_fifty_moves_and_pays_the_share_caught() -> None:
    world, rng = field(Foraging())
    world.prey[:3, FREE] = 0
    hide_agent(world)
    terms, steps = np.zeros(1), 1
    while step(world, REST, rng, terms) == RUNNING:
        steps += 1
    assert steps == 50
    assert terms[0] == pytest.approx(0.3)


@pytest.mark.parametrize("task", [Foraging(), Hunting()])
def test_following_the_cues_is_far_better_than_chance(task: Foraging) -> None:
    seeds = shared_episodes("test", 100)
    chance = RandomActions(*task.action_bounds)
    with Runner(task, Noise(), Executor(), training=False) as runner:
        fusion = runner.run([Job(linear_fusion(8, 5, task.sectors), each) for each in seeds])
        luck = runner.run(
            [Job(chance, each._replace(actions=stream(0, "random_actions", k))) for k, each in enumerate(seeds)]
        )
    assert np.mean([outcome.fitness for outcome in fusion]) > 2.0 * np.mean([outcome.fitness for outcome in luck])
