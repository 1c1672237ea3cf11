"""Robots against Gymnasium's environments."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import pytest

from exneat_cli.tasks import ENDED, RobotTask

ENVIRONMENTS = {
    "half_cheetah": "HalfCheetah-v5",
    "hopper": "Hopper-v5",
    "humanoid": "Humanoid-v5",
    "swimmer": "Swimmer-v5",
    "walker2d": "Walker2d-v5",
}
STEPS = 1000


@pytest.mark.parametrize("model", ENVIRONMENTS)
def test_speed_height_and_end_of_episodes_are_gymnasiums(model: str) -> None:
    env: Any = gymnasium.make(ENVIRONMENTS[model], max_episode_steps=STEPS + 1, disable_env_checker=True)
    robot = RobotTask(model=model, frame="world", max_steps=STEPS + 1).open(training=False)
    terms, place = np.zeros(4), np.zeros(3)
    low, high = env.unwrapped.model.actuator_ctrlrange.T
    compared = 0
    for seed in range(20):
        env.reset(seed=seed)
        robot.reset(robot.world, np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed))))
        rng = np.random.default_rng(seed)
        strength, terminated, t = rng.choice([0.1, 0.5, 1.0]), False, 0
        while t < STEPS and not terminated:
            action = rng.uniform(-strength, strength, env.unwrapped.model.nu)
            _, reward, terminated, _, info = env.step(0.5 * (low + high) + 0.5 * (high - low) * action)
            status = robot.step(robot.world, action, terms)
            robot.locate(robot.world, place)
            velocity = terms[0] / robot.world.forward_weight
            np.testing.assert_allclose(velocity, info["x_velocity"], rtol=0, atol=1e-9)
            np.testing.assert_allclose(place, env.unwrapped.data.xpos[1], rtol=0, atol=1e-9)
            assert terms.sum() == pytest.approx(reward, abs=1e-9)
            assert (status == ENDED) == terminated, f"seed {seed}, step {t}"
            t += 1
        compared += t
    env.close()
    assert compared > 500
