"""What a reset of the field draws: where prey are and go, and what they emit, by rates and laws as stated."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
import pytest
from scipy.stats import binomtest, chisquare

from exneat_cli.tasks import Foraging, Hunting
from exneat_cli.tasks.grid.prey_field import (
    DIRECTION,
    FLIGHT,
    LONGEST_FLIGHT,
    WALK_COLUMN,
    WALK_ROW,
    Field,
    _shuffle,
    draw_prey,
    move_prey,
)
from exneat_cli.tasks.grid.world import MOVES

ALPHA = 1e-4


def drawn(task: Foraging, seed: int = 0) -> tuple[Field, np.random.Generator]:
    field: Field = task.open(training=False, reset_scale=0.0).world
    rng = np.random.default_rng(seed)
    draw_prey(field, rng)
    return field, rng


def paths(field: Field) -> np.ndarray:
    """(T + 1, n_prey, 2) where prey are, from before the first step on."""
    return np.concatenate([field.start[None], field.places])


def test_prey_start_on_distinct_tiles_and_never_on_the_agents() -> None:
    field, rng = drawn(Foraging())
    tiles: Counter[tuple[int, ...]] = Counter()
    for _ in range(400):
        draw_prey(field, rng)
        places = {tuple(place) for place in field.start.tolist()}
        assert len(places) == 10
        assert (6, 6) not in places
        tiles.update(places)
    assert len(tiles) == 99
    assert chisquare(list(tiles.values())).pvalue > ALPHA


def test_a_full_field_has_a_prey_on_every_other_tile() -> None:
    field, _ = drawn(Foraging(size=3, n_prey=8))
    assert len({tuple(place) for place in field.start.tolist()}) == 8


def test_foraging_prey_never_move() -> None:
    field, _ = drawn(Foraging())
    assert (paths(field) == field.start).all()


@pytest.mark.parametrize("motion", ["levy", "brownian"])
@pytest.mark.parametrize("p_m", [0.0, 0.3, 1.0])
def test_prey_move_at_the_stated_rate_and_by_a_tile(p_m: float, motion: str) -> None:
    # Away from the walls every move changes the tile.
    field, rng = drawn(Hunting(size=40, n_prey=20, p_m=p_m, steps=40, motion=motion))
    moved, steps = 0, 0
    for _ in range(5):
        draw_prey(field, rng)
        distances = np.abs(np.diff(paths(field), axis=0)).sum(axis=2)
        assert distances.max() <= 1
        inside = ((paths(field)[:-1] > 1) & (paths(field)[:-1] < 40)).all(axis=2)
        moved += int(distances[inside].sum())
        steps += int(inside.sum())
    assert steps > 3000
    assert binomtest(moved, steps, p_m).pvalue > ALPHA if 0 < p_m < 1 else moved == p_m * steps


def walk_in_the_middle(field: Field, rng: np.random.Generator) -> tuple[int, int]:
    """How the only prey moved from tile (50, 50)."""
    field.walkers[0, [WALK_ROW, WALK_COLUMN]] = 50
    move_prey(field.walkers, 0, field.grid.path, field.flight_chance, field.levy, rng)
    return int(field.walkers[0, WALK_ROW]) - 50, int(field.walkers[0, WALK_COLUMN]) - 50


def lengths_of_flights(motion: str, moves: int) -> Counter[int]:
    """Told by the counter of steps left at each flight's start."""
    field, rng = drawn(Hunting(size=99, n_prey=1, motion=motion))
    field.walkers[0, FLIGHT] = 0
    lengths: Counter[int] = Counter()
    for _ in range(moves):
        starts = field.walkers[0, FLIGHT] == 0
        walk_in_the_middle(field, rng)
        lengths[int(field.walkers[0, FLIGHT]) + 1] += bool(starts)
    return +lengths


def test_levy_flights_have_lengths_of_the_stated_law_and_brownian_ones_a_single_tile() -> None:
    lengths = lengths_of_flights("levy", 20_000)
    assert set(lengths) == set(range(1, LONGEST_FLIGHT + 1))
    law = np.arange(1.0, LONGEST_FLIGHT + 1) ** -2
    observed = np.array([lengths[k] for k in range(1, LONGEST_FLIGHT + 1)])
    assert chisquare(observed, observed.sum() * law / law.sum()).pvalue > ALPHA
    assert set(lengths_of_flights("brownian", 500)) == {1}


def test_directions_are_equally_likely_and_a_flight_is_straight() -> None:
    field, rng = drawn(Hunting(size=99, n_prey=1))
    field.walkers[0, FLIGHT] = 0
    directions: Counter[tuple[int, int]] = Counter()
    last = (0, 0)
    for _ in range(20_000):
        starts = field.walkers[0, FLIGHT] == 0
        now = walk_in_the_middle(field, rng)
        if starts:
            directions[now] += 1
        else:
            assert now == last
        last = now
    assert len(directions) == 4
    assert chisquare(list(directions.values())).pvalue > ALPHA


def test_a_drawn_path_flies_as_a_single_prey_does() -> None:
    # At p_m = 1 a path inside of the walls is a string of whole flights, so its turns are as rare as theirs.
    field, rng = drawn(Hunting(size=40, n_prey=20, p_m=1.0, steps=40))
    straight, pairs = 0, 0
    for _ in range(5):
        draw_prey(field, rng)
        moves = np.diff(paths(field), axis=0)
        inside = np.all((paths(field) > 1) & (paths(field) < 40), axis=2)
        both = inside[:-2] & inside[1:-1] & inside[2:]
        straight += int((both & (moves[1:] == moves[:-1]).all(axis=2)).sum())
        pairs += int(both.sum())
    lengths = np.arange(1.0, LONGEST_FLIGHT + 1)
    mean = (lengths * lengths**-2).sum() / (lengths**-2).sum()
    # Of the moves of a flight all but the last are followed by the same, and of new directions one in four.
    assert straight / pairs == pytest.approx(1 - 0.75 / mean, abs=0.05)


def test_a_wall_ends_a_flight_and_the_next_one_takes_any_direction() -> None:
    field, rng = drawn(Hunting(n_prey=1))
    ends: Counter[tuple[int, int]] = Counter()
    for _ in range(200):
        field.walkers[0, [WALK_ROW, WALK_COLUMN, DIRECTION, FLIGHT]] = (1, 5, MOVES.index("up"), 5)
        move_prey(field.walkers, 0, field.grid.path, field.flight_chance, field.levy, rng)
        assert list(field.walkers[0, [WALK_ROW, WALK_COLUMN, FLIGHT]]) == [1, 5, 0]
        move_prey(field.walkers, 0, field.grid.path, field.flight_chance, field.levy, rng)
        ends[int(field.walkers[0, WALK_ROW]), int(field.walkers[0, WALK_COLUMN])] += 1
    assert set(ends) == {(1, 4), (1, 6), (2, 5), (1, 5)}


def test_nobody_leaves_the_field() -> None:
    field, _ = drawn(Hunting(size=4, n_prey=5, p_m=1.0, steps=500))
    assert (paths(field) >= 1).all()
    assert (paths(field) <= 4).all()
    assert {tuple(place) for place in field.places.reshape(-1, 2).tolist()} == {
        (row, column) for row in range(1, 5) for column in range(1, 5)
    }


def lone_prey_inside(task: Foraging) -> Field:
    """A field whose only prey stands far enough from the walls for whole patches."""
    for seed in range(100):
        field, _ = drawn(task, seed)
        if (field.start > 2).all() and (field.start < task.size - 1).all():
            return field
    raise AssertionError("no prey ever starts inside")


def patches(field: Field) -> np.ndarray:
    """(T, emitters, 25) cues on the tiles around a prey that stands still."""
    row, column = field.start[0]
    cues = field.cues[:, row - 2 : row + 3, column - 2 : column + 3]
    return np.moveaxis(cues, 3, 1).reshape(len(cues), -1, 25)


@pytest.mark.parametrize("p_e", [0.0, 0.35, 1.0])
def test_cues_have_a_direction_at_the_stated_rate(p_e: float) -> None:
    field = lone_prey_inside(Foraging(n_prey=1, p_e=p_e, p_c=1.0, steps=2000))
    emitted = patches(field)[:, 0]
    np.testing.assert_allclose(np.sort(emitted, axis=1), np.sort(field.patch)[None].repeat(2000, axis=0))
    centred = int(np.isclose(emitted, field.patch).all(axis=1).sum())
    assert binomtest(centred, 2000, p_e).pvalue > ALPHA if 0 < p_e < 1 else centred == p_e * 2000


def test_a_patch_is_a_gaussian_bell_of_one_tile() -> None:
    field = lone_prey_inside(Foraging(n_prey=1, p_e=1.0, p_c=1.0, steps=1))
    rows, columns = np.mgrid[-2:3, -2:3]
    np.testing.assert_allclose(patches(field)[0, 0], np.exp(-0.5 * (rows**2 + columns**2)).ravel())
    assert field.cues.sum() == pytest.approx(patches(field).sum())


def test_shuffled_cues_are_uniform_over_the_tiles() -> None:
    rng, counts = np.random.default_rng(3), np.zeros((25, 25))
    for _ in range(20_000):
        values = np.arange(25.0)
        _shuffle(values, rng)
        counts[np.arange(25), values.astype(int)] += 1
    assert chisquare(counts, axis=None).pvalue > ALPHA


def test_every_order_of_a_shuffle_is_equally_likely() -> None:
    rng = np.random.default_rng(4)
    orders: Counter[tuple[float, ...]] = Counter()
    for _ in range(12_000):
        values = np.arange(4.0)
        _shuffle(values, rng)
        orders[tuple(values)] += 1
    assert len(orders) == 24
    assert chisquare(list(orders.values())).pvalue > ALPHA


def test_the_channels_of_a_hunted_prey_have_a_direction_independently() -> None:
    p_e = 0.35
    field = lone_prey_inside(Hunting(n_prey=1, p_e=p_e, p_c=1.0, p_m=0.0, steps=4000))
    first, second = np.isclose(patches(field), field.patch).all(axis=2).T
    observed = [int(kind.sum()) for kind in (first & second, first & ~second, ~first & second, ~first & ~second)]
    law = np.array([p_e * p_e, p_e * (1 - p_e), (1 - p_e) * p_e, (1 - p_e) ** 2])
    assert chisquare(observed, 4000 * law).pvalue > ALPHA


def near(field: Field, t: int, k: int) -> np.ndarray:
    """(N, N) whether prey `k` can reach a tile with what it emits when the agent senses for the t-th time."""
    rows, columns = np.indices(field.cues.shape[1:3])
    row, column = field.places[t, k]
    distances = np.maximum(np.abs(rows - row), np.abs(columns - column))
    reached: np.ndarray = (field.grid.path == 1) & (distances <= field.width // 2)
    return reached


def test_at_full_decay_no_trail_is_left() -> None:
    field, _ = drawn(Hunting(n_prey=3, p_c=1.0, p_m=1.0))
    for t in range(len(field.cues)):
        for emitter, k in enumerate(field.emitters):
            np.testing.assert_array_equal(field.cues[t, :, :, emitter] > 0, near(field, t, k))


def test_without_decay_cues_never_fade() -> None:
    field = lone_prey_inside(Hunting(n_prey=1, p_e=1.0, p_c=0.0, p_m=0.0, steps=100))
    for channel in (0, 1):
        np.testing.assert_allclose(patches(field)[:, channel], np.outer(np.arange(1, 101), field.patch))
    field, _ = drawn(Hunting(p_c=0.0, p_m=1.0))
    assert (np.diff(field.cues, axis=0) >= 0).all()


@pytest.mark.parametrize("parameters", [{"p_c": 0.2}, {"p_c": 0.5, "patch_width": 1}, {"p_c": 0.5, "patch_width": 7}])
def test_cues_fade_by_the_stated_share_and_come_from_around_the_prey_alone(parameters: dict[str, Any]) -> None:
    field, _ = drawn(Hunting(p_m=1.0, **parameters))
    trails = 0
    for t in range(len(field.cues)):
        for emitter, k in enumerate(field.emitters):
            faded = (1.0 - parameters["p_c"]) * field.cues[t - 1, :, :, emitter] if t > 0 else np.zeros((12, 12))
            added = field.cues[t, :, :, emitter] - faded
            trails += int(faded[~near(field, t, k)].any())
            np.testing.assert_allclose(added[~near(field, t, k)], 0.0, rtol=0, atol=1e-12)
            values = added[near(field, t, k)]
            assert (np.isclose(values[:, None], field.patch[None], rtol=0, atol=1e-12).any(axis=1)).all()
    assert trails > 0


def test_walls_carry_no_cues() -> None:
    field, _ = drawn(Hunting(size=5, patch_width=7))
    assert not field.cues[:, field.grid.path == 0].any()
    assert (field.cues[:, field.grid.path == 1] > 0).any()


def test_what_is_drawn_keeps_nothing_of_the_world_before() -> None:
    field, rng = drawn(Hunting(p_e=0.0))
    draw_prey(field, np.random.default_rng(7))
    first = [field.start.copy(), field.places.copy(), field.cues.copy()]
    for _ in range(3):
        draw_prey(field, rng)
    draw_prey(field, np.random.default_rng(7))
    for values, expected in zip([field.start, field.places, field.cues], first, strict=True):
        np.testing.assert_array_equal(values, expected)
