"""Ant against Gymnasium's, and its rules against cases worked out by hand."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium
import mujoco
import numpy as np
import pytest

from exneat_cli.errors import ConfigError, ExneatError
from exneat_cli.tasks import ENDED, FAILED, RUNNING, AntTask, Simulation
from exneat_cli.tasks.robots import dynamics

STEPS = 1000
GYMNASIUM_TERMS = ("reward_forward", "reward_survive", "reward_ctrl", "reward_contact")


@pytest.fixture(scope="module")
def gymnasium_ant() -> Any:
    env = gymnasium.make("Ant-v5", max_episode_steps=STEPS + 1, disable_env_checker=True)
    yield env
    env.close()


def reset(reset_scale: float = 0.0, *, training: bool = False, **parameters: Any) -> Simulation:
    """Ant at the start of an episode; without noise on its pose it drops straight down."""
    ant = AntTask(**parameters).open_disturbed(training=training, reset_scale=reset_scale)
    ant.reset(ant.world, np.random.default_rng(0))
    return ant


def step(ant: Simulation, strength: float = 0.0) -> tuple[int, Any]:
    terms = np.zeros(4)
    return ant.step(ant.world, np.full(8, strength), terms), terms


@pytest.mark.parametrize(("seed", "strength"), [(seed, 0.15 if seed % 2 else 1.0) for seed in range(12)])
def test_a_thousand_steps_equal_gymnasiums(gymnasium_ant: Any, seed: int, strength: float) -> None:
    # Gentle actions keep the body up for long, wild ones make it fall: both ends must agree.
    ant, rng = AntTask(reward="gymnasium", max_steps=STEPS + 1).open(training=False), np.random.default_rng(seed)
    expected, _ = gymnasium_ant.reset(seed=seed)
    ant.reset(ant.world, np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed))))
    observation, terms, place = np.zeros(105), np.zeros(4), np.zeros(3)
    touched, t, terminated = 0, 0, False
    while t < STEPS and not terminated:
        ant.observe(ant.world, observation)
        np.testing.assert_allclose(observation, expected, rtol=0, atol=1e-9)
        action = rng.uniform(-strength, strength, 8)
        expected, reward, terminated, _, info = gymnasium_ant.step(action)
        status = ant.step(ant.world, action, terms)
        ant.locate(ant.world, place)
        np.testing.assert_allclose(terms, [info[name] for name in GYMNASIUM_TERMS], rtol=0, atol=1e-9)
        assert terms.sum() == pytest.approx(reward, abs=1e-9)
        np.testing.assert_allclose(place, gymnasium_ant.unwrapped.data.xpos[1], rtol=0, atol=1e-9)
        assert (status == ENDED) == terminated, f"step {t}"
        touched += bool(observation[27:].any())
        t += 1
    assert touched > 0
    assert seed > 1 or terminated == (strength == 1.0)


@pytest.mark.parametrize(
    ("training", "parameters", "steps"),
    [
        (True, {"patience": 1}, 1),
        (True, {"patience": 7}, 7),
        (True, {"patience": 0, "max_steps": 300}, 300),
        (False, {"patience": 7, "max_steps": 300}, 300),
    ],
)
def test_standing_still_ends_training_after_the_patience_and_tests_at_their_end(
    training: bool, parameters: dict[str, int], steps: int
) -> None:
    ant = reset(training=training, **parameters)
    assert [step(ant)[0] for _ in range(steps)] == [RUNNING] * (steps - 1) + [ENDED]


def test_progress_moves_the_mark_and_starts_the_count_again() -> None:
    ant = reset(training=True, progress=0.5, patience=10)
    assert [step(ant)[0] for _ in range(5)] == [RUNNING] * 5
    mark = ant.world.mark[0]
    ant.world.qpos[0] += 0.6
    assert step(ant)[0] == RUNNING
    assert ant.world.mark[0] == pytest.approx(mark + 0.6, abs=0.02)
    assert [step(ant)[0] for _ in range(10)] == [RUNNING] * 9 + [ENDED]


def test_the_full_reward_adds_up_as_in_a_case_worked_by_hand() -> None:
    ant, task, forces = reset(), AntTask(), np.zeros(0)
    while not forces.any():
        before = ant.world.xpos[1, 0]
        status, terms = step(ant, 0.5)
        assert status == RUNNING
        forces = np.clip(ant.world.cfrc_ext, -1.0, 1.0)
    expected = [(ant.world.xpos[1, 0] - before) / 0.05, 1.0, -0.01 * 8 * 0.25, -5e-4 * (forces**2).sum()]
    np.testing.assert_allclose(terms, expected, rtol=1e-12)
    assert task.fitness_of(terms) == terms[0]
    assert task.full_reward_of(terms) == pytest.approx(sum(expected))


def test_a_fallen_body_ends_the_episode_without_the_healthy_reward() -> None:
    ant = reset()
    ant.world.qpos[2] = 1.5
    status, terms = step(ant)
    assert (status, terms[1]) == (ENDED, 0.0)


def test_exploding_physics_fails_and_the_next_episode_is_sound() -> None:
    ant = reset(0.1)
    ant.world.qvel[:] = 1e9
    assert FAILED in [step(ant)[0] for _ in range(3)]
    ant.rewind(ant.world)
    assert step(ant)[0] == RUNNING


def test_a_leg_senses_its_own_joints_and_bodies_and_no_others(gymnasium_ant: Any) -> None:
    model = gymnasium_ant.unwrapped.model
    task = AntTask()
    for part in task.parts:
        joints = [model.joint(task.actuator_names[a].split()[0]) for a in part.actuators]
        angles = {int(joint.qposadr[0]) - 2 for joint in joints}
        velocities = {model.nq - 2 + int(joint.dofadr[0]) for joint in joints}
        bodies = {1 + (index - 27) // 6 for index in part.sensors if index >= 27}
        assert {index for index in part.sensors if index < 27} == angles | velocities
        assert {int(joint.bodyid[0]) for joint in joints} < bodies
        assert len(bodies) == 3


@pytest.mark.parametrize(
    ("key", "value"),
    [("part_order", "random"), ("reward", "none"), ("max_steps", 0), ("progress", -0.1), ("patience", 1.5)],
)
def test_parameters_out_of_range_are_refused_by_their_key(key: str, value: Any) -> None:
    with pytest.raises(ConfigError, match=f"task.{key}"):
        AntTask(**{key: value})


def test_a_missing_or_broken_library_of_mujoco_is_refused_in_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mujoco, "__file__", str(tmp_path / "__init__.py"))
    with pytest.raises(ExneatError, match="expected its library in"):
        dynamics.load_library.__wrapped__()
    (tmp_path / "libmujoco.so.9").write_bytes(b"no library")
    with pytest.raises(ExneatError, match=r"libmujoco\.so\.9 could not be loaded"):
        dynamics.load_library.__wrapped__()
    monkeypatch.undo()
    monkeypatch.setattr(dynamics, "_SYMBOLS", ("mj_fly",))
    with pytest.raises(ExneatError, match="has no mj_fly"):
        dynamics.load_library.__wrapped__()
