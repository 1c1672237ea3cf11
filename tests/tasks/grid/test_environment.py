"""The grid worlds as Gymnasium environments."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from exneat_cli.brains import linear_fusion
from exneat_cli.errors import ConfigError
from exneat_cli.rollouts import Executor, Noise, Runner
from exneat_cli.seeding import generator, training_episodes
from exneat_cli.tasks import TASKS, GridTask

WORLDS = {f"exneat/{kind.__name__}-v0": kind for kind in TASKS.values() if issubclass(kind, GridTask)}
PARAMETERS: dict[str, dict[str, Any]] = {
    "exneat/TrackMaze-v0": {"size": 17, "gap": 2, "cue_noise": 0.1},
    "exneat/GeneralMaze-v0": {"size": 9, "cues_removed": 0.2, "walls_removed": 0.1},
    "exneat/Foraging-v0": {"n_prey": 4, "p_e": 0.5},
    "exneat/Hunting-v0": {"size": 7, "motion": "brownian", "p_m": 0.9},
}


@pytest.mark.parametrize("world", WORLDS)
def test_the_checker_of_gymnasium_has_nothing_to_say(world: str) -> None:
    check_env(gymnasium.make(world, render_mode="rgb_array").unwrapped)
    check_env(gymnasium.make(world, **PARAMETERS[world]).unwrapped, skip_render_check=True)


@pytest.mark.parametrize("at_random", [True, False])
@pytest.mark.parametrize("world", WORLDS)
def test_the_loop_of_gymnasium_and_the_compiled_episode_agree_step_by_step(world: str, at_random: bool) -> None:
    env: Any = gymnasium.make(world, **PARAMETERS[world])
    task = WORLDS[world](**PARAMETERS[world])
    acting = None if at_random else linear_fusion(8, 5, task.parts)
    located = len(task.trace_columns)
    place = np.zeros(located)
    with Runner(task, Noise(), Executor("serial"), training=False) as runner:
        for seeds in training_episodes(11, 0, 60):
            trace, _ = runner.trace(acting, seeds)
            # The same episode again: for each move five draws, which choose alone or break ties.
            env.unwrapped.np_random, _, choices = map(generator, seeds)
            observation, _ = env.reset()
            rewards, over = [], False
            while not over:
                fused = np.append(observation.reshape(4, 2).sum(axis=1), 0.0)
                values = choices.uniform(0.0, 1.0, 5) if at_random else fused + choices.uniform(0.0, task.tie_noise, 5)
                observation, reward, over, truncated, info = env.step(int(np.argmax(values)))
                rewards.append(reward)
                assert not truncated
                env.unwrapped._simulation.locate(env.unwrapped._simulation.world, place)
                np.testing.assert_array_equal([*place, *info.values()], trace[len(rewards)])
            assert len(rewards) == len(trace) - 1
            assert sum(rewards) == task.fitness_of(trace[:, located:].sum(axis=0))
            assert not any(rewards[:-1])


@pytest.mark.parametrize("action", [-1, 5, 1.5])
def test_an_action_that_does_not_exist_is_refused(action: Any) -> None:
    env = gymnasium.make("exneat/Foraging-v0").unwrapped
    env.reset(seed=0)
    with pytest.raises(ValueError, match="action: expected a whole number from 0 to 4"):
        env.step(action)


@pytest.mark.parametrize("world", WORLDS)
def test_a_step_before_the_first_reset_is_refused(world: str) -> None:
    env = gymnasium.make(world).unwrapped
    with pytest.raises(gymnasium.error.ResetNeeded, match="expected a call of reset"):
        env.step(0)
    env.reset(seed=0)
    env.step(0)


@pytest.mark.parametrize("world", WORLDS)
def test_observations_are_clipped_neighbours(world: str) -> None:
    env: Any = gymnasium.make(world, **PARAMETERS[world])
    observation, _ = env.reset(seed=1)
    world_now = env.unwrapped._simulation.world
    tiles = env.unwrapped.task.tiles(world_now)
    row, column = world_now.agent[:2]
    neighbours = [(row, column - 1), (row, column + 1), (row - 1, column), (row + 1, column)]
    expected = [tiles[r, c, 1 + channel] for r, c in neighbours for channel in (0, 1)]
    np.testing.assert_allclose(observation, np.clip(expected, 0.0, 1.0), rtol=0, atol=1e-12)
    assert observation.any()


@pytest.mark.parametrize("world", WORLDS)
def test_pictures_and_text_show_the_agent_and_what_it_seeks(world: str) -> None:
    drawn: list[Any] = []
    for mode in ("ansi", "rgb_array"):
        env = gymnasium.make(world, render_mode=mode)
        env.reset(seed=3)
        drawn.append(env.render())
    text, picture = drawn
    assert text.count("A") == 1
    assert 1 <= text.count("o") <= (1 if "Maze" in world else 10)
    assert picture.dtype == np.uint8
    assert picture.shape == (16 * len(text.splitlines()), 16 * len(text.splitlines()), 3)
    # The middle of each tile has the colour of its sign.
    tiles, signs = picture[8::16, 8::16], np.array([list(line) for line in text.splitlines()])
    assert (tiles[signs == "A"] == (0, 153, 51)).all()
    assert (tiles[signs == "o"] == (255, 216, 0)).all()
    assert (tiles[signs == "#"] == 0).all()


@pytest.mark.parametrize(
    ("world", "parameters", "message"),
    [
        ("exneat/TrackMaze-v0", {"size": 12}, "size: expected an odd number"),
        ("exneat/TrackMaze-v0", {"size": 3}, "size: expected a whole number from 5 to 99"),
        ("exneat/TrackMaze-v0", {"gap": 6}, "gap: expected a whole number from 0 to 5, got 6"),
        ("exneat/TrackMaze-v0", {"fitness": "speed"}, "fitness: expected one of time_and_progress, time"),
        ("exneat/GeneralMaze-v0", {"size": 10}, "size: expected an odd number"),
        ("exneat/GeneralMaze-v0", {"cues_removed": 1.5}, "cues_removed: expected a number from 0 to 1"),
        ("exneat/GeneralMaze-v0", {"walls_removed": -0.1}, "walls_removed: expected a number from 0 to 1"),
        ("exneat/GeneralMaze-v0", {"cue_noise": -0.1}, "cue_noise: expected"),
        ("exneat/Foraging-v0", {"name": "hunting"}, "name: expected"),
        ("exneat/Foraging-v0", {"n_prey": 49}, "n_prey: expected a whole number from 1 to 48, got 49"),
        ("exneat/Foraging-v0", {"n_prey": 0}, "n_prey: expected"),
        ("exneat/Foraging-v0", {"size": 2}, "size: expected"),
        ("exneat/Foraging-v0", {"p_e": 1.5}, "p_e: expected"),
        ("exneat/Foraging-v0", {"p_c": 2}, "p_c: expected"),
        ("exneat/Foraging-v0", {"rules": "mine"}, "rules: expected"),
        ("exneat/TrackMaze-v0", {"leading": "first"}, "leading: expected"),
        ("exneat/GeneralMaze-v0", {"channel_weights": [0.5]}, "channel_weights: expected"),
        ("exneat/GeneralMaze-v0", {"channel_weights": [0.5, -0.1]}, "channel_weights: expected"),
        ("exneat/Foraging-v0", {"steps": 0}, "steps: expected"),
        ("exneat/Foraging-v0", {"patch_width": 4}, "patch_width: expected an odd number"),
        ("exneat/Foraging-v0", {"steps": 41_426}, "steps: expected at most 41425 for this size and n_prey, got 41426"),
        ("exneat/Foraging-v0", {"size": 99, "n_prey": 100}, "steps: expected at most 32 for this size and n_prey"),
        ("exneat/Hunting-v0", {"steps": 10**6}, "steps: expected at most 20712 for this size and n_prey, got 1000000"),
        ("exneat/Hunting-v0", {"size": 99, "n_prey": 9800}, "n_prey: expected at most 1644 for this size, got 9800"),
        ("exneat/Hunting-v0", {"p_m": float("nan")}, "p_m: expected"),
        ("exneat/Hunting-v0", {"motion": "random"}, "motion: expected one of levy, brownian"),
    ],
)
def test_parameters_out_of_range_are_refused_by_their_key(world: str, parameters: dict[str, Any], message: str) -> None:
    with pytest.raises(ConfigError, match=rf"^task\.{message}"):
        gymnasium.make(world, **parameters)
