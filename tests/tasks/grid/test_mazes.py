"""Mazes: trees, cues, distances, and fitness at known points."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.stats import chisquare

from exneat_cli.brains import linear_fusion
from exneat_cli.rollouts import Executor, Noise, Runner
from exneat_cli.seeding import shared_episodes
from exneat_cli.tasks import ENDED, RUNNING, GeneralMaze, TrackMaze
from exneat_cli.tasks.grid.maze import FURTHEST, GOAL_COLUMN, GOAL_ROW, Maze, locate, step
from exneat_cli.tasks.grid.mazes import carve
from exneat_cli.tasks.grid.world import MOVES, STAY

ODD = st.integers(2, 15).map(lambda k: 2 * k + 1)


def drawn(task: TrackMaze | GeneralMaze, seed: int) -> Maze:
    simulation = task.open(training=False)
    simulation.reset(simulation.world, np.random.default_rng(seed))
    maze: Maze = simulation.world
    return maze


def general(seed: int = 0, **parameters: Any) -> Maze:
    return drawn(GeneralMaze(**parameters), seed)


def track(seed: int = 0, **parameters: Any) -> Maze:
    return drawn(TrackMaze(**parameters), seed)


def walk(maze: Maze, moves: list[str]) -> tuple[float, int]:
    """Fitness and length of an episode."""
    terms, total = np.zeros(2), 0.0
    for count, name in enumerate(moves, start=1):
        status = step(maze, np.eye(len(MOVES))[MOVES.index(name)], terms)
        total += terms.sum()
        if status == ENDED:
            return total, count
        assert status == RUNNING
        assert not terms.any()
    raise AssertionError("the episode did not end")


def tile_graph(path: np.ndarray) -> tuple[coo_array, np.ndarray]:
    """Adjacency of the path tiles, and the number of each tile (-1 on walls)."""
    number = np.full(path.shape, -1)
    number[path == 1] = np.arange(int(path.sum()))
    right = (path[:, :-1] == 1) & (path[:, 1:] == 1)
    down = (path[:-1] == 1) & (path[1:] == 1)
    sources = np.concatenate([number[:, :-1][right], number[:-1][down]])
    targets = np.concatenate([number[:, 1:][right], number[1:][down]])
    size = int(path.sum())
    return coo_array((np.ones(len(sources)), (sources, targets)), shape=(size, size)), number


@given(ODD, st.integers(0, 2**32))
@settings(max_examples=60, deadline=None)
def test_a_general_maze_is_a_spanning_tree_over_its_cells(size: int, seed: int) -> None:
    path = np.zeros((size, size), np.int64)
    carve(path, np.random.default_rng(seed))
    graph, _ = tile_graph(path)
    assert (path[1::2, 1::2] == 1).all()
    assert (path[::2, ::2] == 0).all()
    assert connected_components(graph, directed=False)[0] == 1
    assert graph.nnz == path.sum() - 1
    assert not path[[0, -1]].any()
    assert not path[:, [0, -1]].any()


@pytest.mark.parametrize(("size", "trees", "draws"), [(5, 4, 4000), (7, 192, 40_000)])
def test_every_spanning_tree_is_equally_likely(size: int, trees: int, draws: int) -> None:
    rng = np.random.default_rng(12345)
    path = np.zeros((size, size), np.int64)
    seen: Counter[bytes] = Counter()
    for _ in range(draws):
        carve(path, rng)
        seen[path.tobytes()] += 1
    assert len(seen) == trees
    assert chisquare(list(seen.values())).pvalue > 1e-4


@given(ODD, st.integers(0, 2**32), st.floats(0.0, 1.0))
@settings(max_examples=40, deadline=None)
def test_distances_equal_scipys_and_an_episode_lasts_for_the_fastest_way_and_two_steps(
    size: int, seed: int, walls_removed: float
) -> None:
    maze = general(seed, size=size, walls_removed=walls_removed)
    graph, number = tile_graph(maze.path)
    goal = number[maze.goal[GOAL_ROW], maze.goal[GOAL_COLUMN]]
    expected = dijkstra(graph, directed=False, indices=goal, unweighted=True)
    on_path = maze.path == 1
    np.testing.assert_array_equal(maze.distances[on_path], expected)
    assert (maze.distances[~on_path] == -1).all()
    assert maze.goal[FURTHEST] == expected.max()
    fastest = expected[number[tuple(maze.agent[:2])]]
    assert walk(maze, ["stay"] * (size * size + 5))[1] == fastest + 2 <= GeneralMaze(size=size).longest_episode


def test_start_and_goal_are_two_different_corners_and_all_pairs_occur() -> None:
    simulation, rng = GeneralMaze().open(training=False), np.random.default_rng(0)
    maze: Maze = simulation.world
    pairs: Counter[tuple[tuple[int, ...], tuple[int, ...]]] = Counter()
    for _ in range(2400):
        simulation.reset(maze, rng)
        pairs[tuple(maze.agent[:2]), tuple(maze.goal[:2])] += 1
    corners = {(1, 1), (1, 9), (9, 1), (9, 9)}
    assert all(start in corners and goal in corners and start != goal for start, goal in pairs)
    assert len(pairs) == 12
    assert chisquare(list(pairs.values())).pvalue > 1e-4


@pytest.mark.parametrize("weights", [(0.5, 0.5), (0.2, 0.8), (1, 0)])
def test_cues_of_a_general_maze_rise_evenly_to_the_weight_of_their_channel_at_the_goal(
    weights: tuple[float, float],
) -> None:
    maze = general(5, channel_weights=weights)
    on_path = maze.path == 1
    expected = (maze.goal[FURTHEST] - maze.distances[on_path]) / maze.goal[FURTHEST]
    for channel in (0, 1):
        np.testing.assert_allclose(maze.signals[channel][on_path], weights[channel] * expected)
        assert not maze.signals[channel][~on_path].any()


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_the_stated_shares_of_cues_and_walls_are_removed(share: float) -> None:
    plain, fewer_cues, fewer_walls = general(3), general(3, cues_removed=share), general(3, walls_removed=share)
    tiles = int(plain.path.sum())
    assert int(fewer_walls.path.sum()) - tiles == round(share * (60 - (tiles - 25) - 20))
    silent = int(((fewer_cues.signals == 0).all(axis=0) & (plain.path == 1)).sum())
    # The furthest tiles have a cue of 0 to begin with.
    furthest = int((plain.distances == plain.goal[FURTHEST]).sum())
    assert round(share * tiles) <= silent <= round(share * tiles) + furthest


@pytest.mark.parametrize(("size", "gap"), [(5, 0), (7, 0), (31, 0), (13, 0), (13, 1), (13, 3), (13, 5)])
def test_a_track_leads_on_one_channel_misleads_on_the_other_and_is_silent_in_the_gap(size: int, gap: int) -> None:
    kinds = set()
    for seed in range(40):
        maze = track(seed, size=size, gap=gap)
        middle, reach = size // 2, (size - 3) // 2
        assert list(np.flatnonzero(maze.path[middle])) == list(range(1, size - 1))
        assert maze.path.sum() == size - 2
        side = 1 if maze.goal[GOAL_COLUMN] > middle else -1
        ramp = np.linspace(0.1, 0.5, reach) if reach > 1 else np.array([0.5])
        ahead = maze.signals[:, middle, middle + side * np.arange(1, reach + 1)]
        behind = maze.signals[:, middle, middle - side * np.arange(1, reach + 1)]
        leading = 1 if behind[0].any() else 0
        before_goal = [0.0 if reach - 1 - gap <= k < reach - 1 else cue for k, cue in enumerate(ramp)]
        np.testing.assert_allclose(ahead, [before_goal] * 2)
        np.testing.assert_allclose(behind[1 - leading], ramp)
        assert not behind[leading].any()
        kinds.add((side, leading))
    assert len(kinds) == 4


def test_the_second_channel_can_lead_on_every_track_without_other_changes() -> None:
    for seed in range(40):
        one, other = track(seed), track(seed, leading="second")
        silent = (other.signals == 0).sum(axis=(1, 2))
        assert silent[1] > silent[0]
        np.testing.assert_array_equal(one.goal, other.goal)
        np.testing.assert_array_equal(np.sort(one.signals, axis=0), np.sort(other.signals, axis=0))


def test_cue_noise_lies_on_path_tiles_alone_and_never_below_zero() -> None:
    noisy = general(4, cue_noise=0.2)
    assert not noisy.signals[:, noisy.path == 0].any()
    assert (noisy.signals >= 0).all()
    changes = []
    for seed in range(30):
        clean, noisy = general(seed), general(seed, cue_noise=0.05)
        bright = clean.signals > 0.3  # far enough from 0 for all noise to show
        changes += list((noisy.signals - clean.signals)[bright])
    assert np.std(changes) == pytest.approx(0.05, rel=0.1)
    assert len(changes) > 500


@pytest.mark.parametrize(
    ("fitness", "first", "then", "expected"),
    [
        # Five steps lead to the goal, and each of the two spare ones costs half of the reward of time.
        ("time_and_progress", [], "ahead", (1.0, 5)),
        ("time_and_progress", ["stay"], "ahead", (0.75, 6)),
        ("time_and_progress", ["stay", "stay"], "ahead", (0.5, 7)),
        ("time_and_progress", ["up", "down"], "ahead", (0.5, 7)),
        ("time_and_progress", [], "stay", (0.25, 7)),
        ("time_and_progress", [], "behind", (0.0, 7)),
        ("time", ["stay"], "ahead", (0.5, 6)),
        ("time", [], "stay", (0.0, 7)),
    ],
)
def test_fitness_is_that_of_cases_worked_by_hand(
    fitness: str, first: list[str], then: str, expected: tuple[float, int]
) -> None:
    maze = track(1, fitness=fitness)
    sides = ("right", "left") if maze.goal[GOAL_COLUMN] > 6 else ("left", "right")
    way = {"ahead": sides[0], "behind": sides[1], "stay": "stay"}[then]
    assert walk(maze, first + [way] * 7) == pytest.approx(expected)


def test_a_step_into_a_wall_stays() -> None:
    maze, row = track(1), np.zeros(4)
    step(maze, np.eye(len(MOVES))[MOVES.index("up")], np.zeros(2))
    locate(maze, row)
    assert list(row) == [6, 6, *maze.goal[:2]]
    assert MOVES[STAY] == "stay"


@pytest.mark.parametrize(
    "task", [TrackMaze(), TrackMaze(size=31), TrackMaze(size=5), *(GeneralMaze(size=size) for size in (5, 11, 21, 99))]
)
def test_linear_fusion_solves_every_noiseless_maze_perfectly_and_chance_is_far_below(
    task: TrackMaze | GeneralMaze,
) -> None:
    fusion = linear_fusion(8, 5, task.parts)
    episodes = shared_episodes("test", 100)
    with Runner(task, Noise(), Executor(), training=False) as runner:
        outcomes, luck = runner.run([fusion], episodes), runner.run(None, episodes)
    assert outcomes.fitness.tolist() == [[1.0] * 100]
    assert luck.fitness.mean() < (0.5 if task.size == 5 else 0.35)
