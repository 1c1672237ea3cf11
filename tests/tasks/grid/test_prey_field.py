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
    draw_prey,
    move_prey,
    shuffle,
)
from exneat_cli.tasks.grid.world import MOVES

ALPHA = 1e-4


def drawn(task: Foraging, seed: int = 0) -> tuple[Field, np.random.Generator]:
    field: Field = task.open(training=False).world
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
        assert (4, 4) not in places
        tiles.update(places)
    assert len(tiles) == 48
    assert chisquare(list(tiles.values())).pvalue > ALPHA
    anywhere, rng = drawn(Foraging(rules="library"))
    for _ in range(400):
        draw_prey(anywhere, rng)
        tiles.update({tuple(place) for place in anywhere.start.tolist()})
    assert len(tiles) == 49
    full, _ = drawn(Foraging(size=3, n_prey=8))
    assert len({tuple(place) for place in full.start.tolist()}) == 8


def test_foraging_prey_never_move_and_hunted_ones_never_leave_the_field() -> None:
    field, _ = drawn(Foraging())
    assert (paths(field) == field.start).all()
    field, _ = drawn(Hunting(size=4, n_prey=5, p_m=1.0, steps=500))
    everywhere = {(row, column) for row in range(1, 5) for column in range(1, 5)}
    assert {tuple(place) for place in paths(field).reshape(-1, 2).tolist()} == everywhere


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


@pytest.mark.parametrize("levy", [True, False])
def test_flights_are_straight_have_equally_likely_directions_and_lengths_of_the_stated_law(levy: bool) -> None:
    field, rng = drawn(Hunting(size=99, n_prey=1))
    walkers = np.zeros((1, 4), np.int64)
    directions, lengths, last = Counter[tuple[int, int]](), Counter[int](), (0, 0)
    for _ in range(20_000):
        starts = walkers[0, FLIGHT] == 0
        walkers[0, [WALK_ROW, WALK_COLUMN]] = 50
        move_prey(walkers, 0, field.path, levy, rng)
        now = int(walkers[0, WALK_ROW]) - 50, int(walkers[0, WALK_COLUMN]) - 50
        if starts:
            directions[now] += 1
            lengths[int(walkers[0, FLIGHT]) + 1] += 1
        else:
            assert now == last
        last = now
    assert len(directions) == 4
    assert chisquare(list(directions.values())).pvalue > ALPHA
    law = np.arange(1.0, LONGEST_FLIGHT + 1 if levy else 2) ** -2
    observed = np.array([lengths[k] for k in range(1, len(law) + 1)])
    assert observed.sum() == sum(lengths.values())
    assert not levy or chisquare(observed, observed.sum() * law / law.sum()).pvalue > ALPHA


def test_a_wall_ends_a_flight_and_the_next_one_takes_any_direction() -> None:
    field, rng = drawn(Hunting(size=10, n_prey=1))
    walkers, ends = np.zeros((1, 4), np.int64), set()
    for _ in range(200):
        walkers[0, [WALK_ROW, WALK_COLUMN, DIRECTION, FLIGHT]] = (1, 5, MOVES.index("up"), 5)
        move_prey(walkers, 0, field.path, True, rng)
        assert list(walkers[0, [WALK_ROW, WALK_COLUMN, FLIGHT]]) == [1, 5, 0]
        move_prey(walkers, 0, field.path, True, rng)
        ends.add((int(walkers[0, WALK_ROW]), int(walkers[0, WALK_COLUMN])))
    assert ends == {(1, 4), (1, 6), (2, 5), (1, 5)}


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
def test_cues_are_a_bell_in_the_middle_at_the_stated_rate_and_else_its_values_shuffled(p_e: float) -> None:
    field = lone_prey_inside(Foraging(n_prey=1, p_e=p_e, steps=2000))
    rows, columns = np.mgrid[-2:3, -2:3]
    bell = np.exp(-0.5 * (rows**2 + columns**2)).ravel()
    emitted = patches(field)[:, 0]
    np.testing.assert_allclose(np.sort(emitted, axis=1), np.sort(bell)[None].repeat(2000, axis=0))
    centred = int(np.isclose(emitted, bell).all(axis=1).sum())
    assert binomtest(centred, 2000, p_e).pvalue > ALPHA if 0 < p_e < 1 else centred == p_e * 2000


def test_every_order_of_a_shuffle_is_equally_likely() -> None:
    # Five choices need two random numbers.
    rng, values, orders = np.random.default_rng(4), np.arange(6.0), Counter[bytes]()
    for _ in range(40_000):
        shuffle(values, rng)
        orders[values.tobytes()] += 1
    assert len(orders) == 720
    assert chisquare(list(orders.values())).pvalue > ALPHA


def test_the_channels_of_a_hunted_prey_have_a_direction_independently() -> None:
    p_e = 0.35
    field = lone_prey_inside(Hunting(n_prey=1, p_e=p_e, p_m=0.0, steps=4000))
    first, second = np.isclose(patches(field), field.patch.ravel()).all(axis=2).T
    observed = [int(kind.sum()) for kind in (first & second, first & ~second, ~first & second, ~first & ~second)]
    law = np.array([p_e * p_e, p_e * (1 - p_e), (1 - p_e) * p_e, (1 - p_e) ** 2])
    assert chisquare(observed, 4000 * law).pvalue > ALPHA


@pytest.mark.parametrize(
    ("world", "parameters"),
    [
        (Hunting, {"p_c": 0.8}),
        (Hunting, {"p_c": 1.0, "p_e": 0.3}),
        (Hunting, {"p_c": 0.0, "n_prey": 3}),
        (Hunting, {"p_c": 0.5, "patch_width": 1}),
        (Hunting, {"p_c": 0.5, "patch_width": 7, "size": 5}),
        (Foraging, {"p_c": 0.5, "p_e": 0.8}),
    ],
)
def test_cues_fade_by_the_stated_share_and_come_from_open_tiles_around_their_prey_alone(
    world: type[Foraging], parameters: dict[str, Any]
) -> None:
    task = world(**parameters, **({"p_m": 1.0} if world is Hunting else {}))
    field, _ = drawn(task)
    rows, columns = np.indices(field.path.shape)
    trails = 0
    for t in range(len(field.cues)):
        for emitter in range(field.cues.shape[3]):
            row, column = field.places[t, emitter // task.channels]
            near = np.maximum(np.abs(rows - row), np.abs(columns - column)) <= task.patch_width // 2
            near &= field.path == 1
            faded = task.p_c * field.cues[t - 1, :, :, emitter] if t > 0 else np.zeros(field.path.shape)
            added = field.cues[t, :, :, emitter] - faded
            trails += int(faded[~near].any())
            np.testing.assert_allclose(added[~near], 0.0, rtol=0, atol=1e-12)
            assert np.isclose(added[near][:, None], field.patch.ravel(), rtol=0, atol=1e-9).any(axis=1).all()
    assert (trails > 0) == (task.p_c > 0.0 and world is Hunting)
