"""The grid worlds as Gymnasium environments."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from exneat_cli.brains import Brain, RandomActions, linear_fusion
from exneat_cli.errors import ConfigError
from exneat_cli.rollouts import Executor, Noise, Runner
from exneat_cli.seeding import generator, training_episodes
from exneat_cli.tasks.grid.environment import WORLDS

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
    parameters = PARAMETERS[world]
    env = gymnasium.make(world, **parameters)
    task = WORLDS[world](**parameters)
    acting = RandomActions(*task.action_bounds) if at_random else linear_fusion(8, 5, task.parts)
    located = len(task.trace_columns)
    place = np.zeros(located)
    with Runner(task, Noise(), Executor("serial"), training=False) as runner:
        for seeds in training_episodes(11, 0, 200):
            outcomes = runner.run([acting] if isinstance(acting, Brain) else acting, [seeds])
            trace = runner.trace(acting, seeds).steps
            # The same episode again: for each move five draws, which choose alone or break ties.
            choices = generator(seeds.actions)
            env.unwrapped.np_random = generator(seeds.world)
            observation, _ = env.reset()
            rewards, over = [], False
            while not over:
                fused = np.append(observation.reshape(4, 2).sum(axis=1), 0.0)
                values = choices.uniform(0.0, 1.0, 5) if at_random else fused + choices.uniform(0.0, task.tie_noise, 5)
                observation, reward, over, truncated, info = env.step(int(np.argmax(values)))
                rewards.append(float(reward))
                assert not truncated
                env.unwrapped._simulation.locate(env.unwrapped._simulation.world, place)  # type: ignore[attr-defined]
                np.testing.assert_array_equal(place, trace[len(rewards), :located])
                np.testing.assert_array_equal(list(info.values()), trace[len(rewards), located:])
            assert len(rewards) == outcomes.steps[0, 0]
            assert sum(rewards) == outcomes.fitness[0, 0]
            assert not any(rewards[:-1])


@pytest.mark.parametrize("action", [-1, 5, 1.5])
def test_an_action_that_does_not_exist_is_refused(action: float) -> None:
    env = gymnasium.make("exneat/Foraging-v0").unwrapped
    env.reset(seed=0)
    with pytest.raises(ValueError, match="action: expected a whole number from 0 to 4"):
        env.step(action)


@pytest.mark.parametrize("world", WORLDS)
def test_observations_are_clipped_neighbours(world: str) -> None:
    env = gymnasium.make(world, **PARAMETERS[world])
    observation, _ = env.reset(seed=1)
    world_now = env.unwrapped._simulation.world  # type: ignore[attr-defined]
    tiles = env.unwrapped.task.tiles(world_now)  # type: ignore[attr-defined]
    row, column = world_now.grid.agent[:2]
    neighbours = [(row, column - 1), (row, column + 1), (row - 1, column), (row + 1, column)]
    expected = [tiles[r, c, 1 + channel] for r, c in neighbours for channel in (0, 1)]
    np.testing.assert_allclose(observation, np.clip(expected, 0.0, 1.0), rtol=0, atol=1e-12)
    assert observation.any()


@pytest.mark.parametrize("world", WORLDS)
def test_pictures_and_text_show_the_agent_and_what_it_seeks(world: str) -> None:
    env = gymnasium.make(world, render_mode="ansi")
    env.reset(seed=3)
    text = env.render()
    assert isinstance(text, str)
    assert text.count("A") == 1
    assert "o" in text
    env = gymnasium.make(world, render_mode="rgb_array")
    env.reset(seed=3)
    picture = env.render()
    assert isinstance(picture, np.ndarray)
    assert picture.dtype == np.uint8
    assert picture.shape[0] == 16 * len(text.splitlines())
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 3


@pytest.mark.parametrize(
    ("world", "parameters", "key"),
    [
        ("exneat/TrackMaze-v0", {"size": 12}, "task.size"),
        ("exneat/TrackMaze-v0", {"size": 3}, "task.size"),
        ("exneat/TrackMaze-v0", {"gap": 6}, "task.gap"),
        ("exneat/TrackMaze-v0", {"fitness": "speed"}, "task.fitness"),
        ("exneat/GeneralMaze-v0", {"cues_removed": 1.5}, "task.cues_removed"),
        ("exneat/GeneralMaze-v0", {"walls_removed": -0.1}, "task.walls_removed"),
        ("exneat/Foraging-v0", {"n_prey": 100}, "task.n_prey"),
        ("exneat/Foraging-v0", {"p_c": 2}, "task.p_c"),
        ("exneat/Foraging-v0", {"steps": 0}, "task.steps"),
        ("exneat/Foraging-v0", {"patch_width": 4}, "task.patch_width"),
        ("exneat/Foraging-v0", {"steps": 23_302}, "task.steps"),
        ("exneat/Hunting-v0", {"size": 99, "n_prey": 9800}, "task.n_prey"),
        ("exneat/Hunting-v0", {"p_m": float("nan")}, "task.p_m"),
        ("exneat/Hunting-v0", {"motion": "random"}, "task.motion"),
    ],
)
def test_parameters_out_of_range_are_refused_by_their_key(world: str, parameters: dict[str, Any], key: str) -> None:
    with pytest.raises(ConfigError, match=key):
        gymnasium.make(world, **parameters)
