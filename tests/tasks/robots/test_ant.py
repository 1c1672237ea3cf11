"""Ant against Gymnasium's, and its rules against cases worked out by hand."""

from __future__ import annotations

from typing import Any

import gymnasium
import mujoco
import numpy as np
import pytest

from exneat_cli.errors import ConfigError
from exneat_cli.tasks import ENDED, FAILED, RUNNING, AntTask, Simulation
from exneat_cli.tasks.robots.ant_gymnasium import REWARD_TERMS

STEPS = 1000


@pytest.fixture(scope="module")
def gymnasium_ant() -> Any:
    env = gymnasium.make("Ant-v5", max_episode_steps=STEPS + 1, disable_env_checker=True)
    yield env
    env.close()


def simulation(**changes: Any) -> Simulation:
    return AntTask(**{"reward": "gymnasium", "max_steps": STEPS + 1, **changes}).open(training=False, reset_scale=0.1)


@pytest.mark.parametrize("seed", range(20))
def test_a_thousand_steps_equal_gymnasiums(gymnasium_ant: Any, seed: int) -> None:
    ant = simulation()
    assert ant.compiled
    rng = np.random.default_rng(seed)
    # Gentle actions keep the body up for long, wild ones make it fall: both ends must agree.
    strength = 0.15 if seed % 2 else 1.0
    expected, _ = gymnasium_ant.reset(seed=seed)
    ant.reset(ant.world, np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed))))
    observation, terms, place = np.zeros(105), np.zeros(4), np.zeros(3)
    touched = 0
    for t in range(STEPS):
        ant.observe(ant.world, observation)
        np.testing.assert_allclose(observation, expected, rtol=0, atol=1e-9)
        action = rng.uniform(-strength, strength, 8)
        expected, reward, terminated, _, info = gymnasium_ant.step(action)
        status = ant.step(ant.world, action, terms)
        ant.locate(ant.world, place)
        np.testing.assert_allclose(terms, [info[name] for name in REWARD_TERMS], rtol=0, atol=1e-9)
        assert terms.sum() == pytest.approx(reward, abs=1e-9)
        np.testing.assert_allclose(place, gymnasium_ant.unwrapped.data.xpos[1], rtol=0, atol=1e-9)
        assert (status == ENDED) == terminated, f"step {t}"
        touched += bool(observation[27:].any())
        if terminated:
            break
    assert touched > 0


def test_some_of_those_episodes_last_and_some_end_early(gymnasium_ant: Any) -> None:
    lengths = []
    for seed in (0, 1, 2, 3):
        rng = np.random.default_rng(seed)
        strength = 0.15 if seed % 2 else 1.0
        gymnasium_ant.reset(seed=seed)
        length = 0
        for _ in range(STEPS):
            length += 1
            if gymnasium_ant.step(rng.uniform(-strength, strength, 8))[2]:
                break
        lengths.append(length)
    assert min(lengths) < STEPS
    assert max(lengths) == STEPS


def held_still(training: bool, **changes: Any) -> tuple[int, int]:
    ant = AntTask(**changes).open(training=training, reset_scale=0.0)
    terms, steps, status = np.zeros(4), 0, RUNNING
    ant.reset(ant.world, np.random.default_rng(0))
    while status == RUNNING:
        status = ant.step(ant.world, np.zeros(8), terms)
        steps += 1
    return steps, status


@pytest.mark.parametrize("patience", [1, 7, 100])
def test_standing_still_ends_training_after_the_patience(patience: int) -> None:
    # From the exact initial pose the body drops straight down: x never moves by a centimetre.
    assert held_still(training=True, patience=patience) == (patience, ENDED)


def test_standing_still_lasts_to_the_end_in_tests_and_without_patience() -> None:
    assert held_still(training=False, max_steps=300) == (300, ENDED)
    assert held_still(training=True, patience=0, max_steps=300) == (300, ENDED)


def test_progress_moves_the_mark_and_starts_the_count_again() -> None:
    ant = AntTask(progress=0.5, patience=10).open(training=True, reset_scale=0.0)
    terms = np.zeros(4)
    ant.reset(ant.world, np.random.default_rng(0))
    for _ in range(5):
        assert ant.step(ant.world, np.zeros(8), terms) == RUNNING
    mark = ant.world.mark[0]
    ant.world.qpos[0] += 0.6
    assert ant.step(ant.world, np.zeros(8), terms) == RUNNING
    assert ant.world.mark[0] == pytest.approx(mark + 0.6, abs=0.02)
    steps = 0
    while ant.step(ant.world, np.zeros(8), terms) == RUNNING:
        steps += 1
    assert steps == 9


def test_the_full_reward_adds_up_as_in_a_case_worked_by_hand() -> None:
    ant = AntTask(reward="thesis").open(training=False, reset_scale=0.0)
    terms = np.zeros(4)
    ant.reset(ant.world, np.random.default_rng(0))
    forces = np.zeros(0)
    while not forces.any():
        before = ant.world.xpos[1, 0]
        assert ant.step(ant.world, np.full(8, 0.5), terms) == RUNNING
        forces = np.clip(ant.world.cfrc_ext, -1.0, 1.0)
    expected = [(ant.world.xpos[1, 0] - before) / 0.05, 1.0, -0.01 * 8 * 0.25, -5e-4 * (forces**2).sum()]
    np.testing.assert_allclose(terms, expected, rtol=1e-12)
    task = AntTask(reward="thesis")
    assert task.fitness_of(terms) == terms[0]
    assert task.full_reward_of(terms) == pytest.approx(sum(expected))


def test_a_fallen_body_ends_the_episode_without_the_healthy_reward() -> None:
    ant = AntTask().open(training=False, reset_scale=0.0)
    terms = np.zeros(4)
    ant.reset(ant.world, np.random.default_rng(0))
    ant.world.qpos[2] = 1.5
    assert ant.step(ant.world, np.zeros(8), terms) == ENDED
    assert terms[1] == 0.0


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_an_action_that_is_not_finite_fails(value: float) -> None:
    ant = AntTask().open(training=False, reset_scale=0.1)
    ant.reset(ant.world, np.random.default_rng(0))
    action = np.zeros(8)
    action[3] = value
    assert ant.step(ant.world, action, np.zeros(4)) == FAILED


def test_exploding_physics_fails_and_the_next_episode_is_sound() -> None:
    ant = AntTask().open(training=False, reset_scale=0.1)
    rng = np.random.default_rng(0)
    ant.reset(ant.world, rng)
    ant.world.qvel[:] = 1e9
    statuses = [ant.step(ant.world, np.zeros(8), np.zeros(4)) for _ in range(3)]
    assert FAILED in statuses
    ant.rewind(ant.world)
    assert ant.step(ant.world, np.zeros(8), np.zeros(4)) == RUNNING
    ant.reset(ant.world, rng)
    assert ant.step(ant.world, np.zeros(8), np.zeros(4)) == RUNNING


def test_parts_are_the_legs_by_position_with_the_joints_of_that_leg() -> None:
    task = AntTask()
    names = task.actuator_names
    driven = {part.name: [names[a] for a in part.actuators] for part in task.parts}
    assert list(driven.items()) == [
        ("front_left", ["hip_1", "ankle_1"]),
        ("front_right", ["hip_4", "ankle_4"]),
        ("back_left", ["hip_2", "ankle_2"]),
        ("back_right", ["hip_3", "ankle_3"]),
    ]
    model_order = AntTask(part_order="model")
    assert [part.name for part in model_order.parts] == ["front_left", "back_left", "back_right", "front_right"]


def test_every_observation_belongs_to_exactly_one_place() -> None:
    task = AntTask()
    places = [*task.parts, task.trunk]
    assert sorted(index for place in places for index in place.sensors) == list(range(105))
    assert [len(place.sensors) for place in places] == [22, 22, 22, 22, 17]
    assert sorted(actuator for place in places for actuator in place.actuators) == list(range(8))


def test_a_leg_senses_its_own_joints_and_no_others() -> None:
    env = gymnasium.make("Ant-v5", disable_env_checker=True)
    model, data = env.unwrapped.model, env.unwrapped.data  # type: ignore[attr-defined]
    env.reset(seed=0)
    for part in AntTask().parts:
        joint = model.joint(AntTask().actuator_names[part.actuators[0]])
        before = np.concatenate([data.qpos[2:], data.qvel])
        data.qpos[joint.qposadr[0]] += 0.125
        after = np.concatenate([data.qpos[2:], data.qvel])
        assert set(np.flatnonzero(before != after)) <= set(part.sensors)
        assert (before != after).any()
    env.close()


def test_sensors_of_contact_lie_on_the_bodies_of_the_leg() -> None:
    model = mujoco.MjModel.from_xml_path(
        str(gymnasium.make("Ant-v5", disable_env_checker=True).unwrapped.fullpath)  # type: ignore[attr-defined]
    )
    for part in AntTask().parts:
        bodies = {1 + (index - 27) // 6 for index in part.sensors if index >= 27}
        joints = {AntTask().actuator_names[a] for a in part.actuators}
        moved = {int(model.joint(name).bodyid[0]) for name in joints}
        assert moved <= bodies
        assert len(bodies) == 3


@pytest.mark.parametrize(
    ("key", "value"),
    [("part_order", "random"), ("reward", "none"), ("max_steps", 0), ("progress", -0.1), ("patience", 1.5)],
)
def test_parameters_out_of_range_are_refused_by_their_key(key: str, value: object) -> None:
    with pytest.raises(ConfigError, match=f"task.{key}"):
        AntTask(**{key: value})  # type: ignore[arg-type]
