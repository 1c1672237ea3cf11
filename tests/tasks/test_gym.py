"""task=gym beside Gymnasium itself, and what it refuses."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import gymnasium
import mujoco
import numpy as np
import pytest
from gymnasium import spaces
from hypothesis import given, settings
from hypothesis import strategies as st

from exneat_cli.brains import motionless
from exneat_cli.errors import ConfigError, ExneatError
from exneat_cli.records import build
from exneat_cli.rollouts import Executor, Noise, Runner
from exneat_cli.runs import RunSettings
from exneat_cli.seeding import training_episodes
from exneat_cli.tasks import ENDED, FAILED, RUNNING, Simulation, Task
from exneat_cli.tasks.gym import GymTask
from exneat_cli.tasks.robots import models
from exneat_cli.tasks.robots.robot import RobotTask
from tests.rollouts.drifting import random_brains
from tests.tasks import environments  # noqa: F401  registers some

BOUNDED, CHOOSING, ENDLESS = (f"exneat-tests/{name}-v0" for name in ("Bounded", "Choosing", "Endless"))


def opened(task: GymTask, seed: int = 0) -> Simulation:
    simulation = task.open(training=True)
    simulation.reset(simulation.world, np.random.default_rng(seed))
    return simulation


def readings(task: GymTask, simulation: Simulation) -> list[float]:
    values = np.zeros(task.observation_size)
    simulation.observe(simulation.world, values)
    return values.tolist()


def act(simulation: Simulation, action: Any) -> tuple[int, float]:
    terms = np.full(1, np.nan)
    return simulation.step(simulation.world, np.array(action, float), terms), float(terms[0])


@pytest.mark.parametrize("env_id", ["CartPole-v1", "Pendulum-v1", "HalfCheetah-v5", "MountainCarContinuous-v0"])
@given(seed=st.integers(0, 2**32), data=st.data())
@settings(deadline=None, max_examples=10)
def test_an_episode_is_that_of_gymnasium(env_id: str, seed: int, data: st.DataObject) -> None:
    task, env = GymTask(env_id=env_id), gymnasium.make(env_id)
    simulation = opened(task, seed)
    expected, _ = env.reset(seed=int(np.random.default_rng(seed).integers(2**31)))
    for _ in range(20):
        assert readings(task, simulation) == expected.tolist()
        action = np.random.default_rng(data.draw(st.integers(0, 99))).uniform(*task.action_bounds)
        if isinstance(env.action_space, spaces.Box):
            low, high = env.action_space.low, env.action_space.high
            taken: Any = (low + (action + 1.0) / 2.0 * (high - low)).astype(np.float32)
        else:
            taken = int(np.argmax(action))
        expected, reward, terminated, truncated, _ = env.step(taken)
        assert act(simulation, action) == (ENDED if terminated or truncated else RUNNING, reward)
        if terminated or truncated:
            break


def test_actions_are_scaled_to_the_bounds_there_are_and_cut_to_them() -> None:
    task, taken = (
        GymTask(env_id=BOUNDED),
        {
            # 0 to 10; no bounds; from 5 on; up to 3
            -1.0: [[0.0, -1.0], [5.0, 1.0]],
            0.0: [[5.0, 0.0], [6.0, 2.0]],
            1.0: [[10.0, 1.0], [7.0, 3.0]],
            99.0: [[10.0, 1.0], [7.0, 3.0]],
        },
    )
    simulation = opened(task)
    for value, expected in taken.items():
        act(simulation, [value] * 4)
        given = simulation.world.env.unwrapped.taken[-1]
        assert given.tolist() == expected
        assert simulation.world.env.action_space.contains(given)
    np.testing.assert_array_equal(simulation.world.interface.taken(task.resting_action), [[0.0, 0.0], [5.0, 1.0]])


def test_the_largest_value_chooses_among_discrete_actions_from_their_start() -> None:
    task = GymTask(env_id=CHOOSING)
    assert act(opened(task), [0.1, 0.5, 0.2]) == (RUNNING, 8.0)
    assert act(opened(task), [-3.0, -2.0, -1.0]) == (ENDED, 9.0)
    assert readings(task, opened(task)) == [200.0, 7.0]


def test_ties_among_discrete_actions_break_fairly() -> None:
    task = GymTask(env_id=CHOOSING, max_steps=1)
    with Runner(task, Noise(), Executor("serial"), training=True) as runner:
        rewards = runner.run([motionless(2, np.zeros(3))], training_episodes(0, 0, 300)).fitness
    assert set(rewards[0].tolist()) == {7.0, 8.0, 9.0}
    assert np.bincount(rewards[0].astype(int))[7:].min() > 60


def test_episodes_end_at_the_limit_of_the_environment_or_at_another_one() -> None:
    for task, limit in ((GymTask(env_id=CHOOSING), 5), (GymTask(env_id=CHOOSING, max_steps=2), 2)):
        assert task.longest_episode == limit
        simulation = opened(task)
        statuses = [act(simulation, [1.0, 0.0, 0.0])[0] for _ in range(limit)]
        assert statuses == [RUNNING] * (limit - 1) + [ENDED]
    assert GymTask(env_id=ENDLESS, max_steps=7).longest_episode == 7


@pytest.mark.parametrize("fault", ["observation", "reward", "action"])
def test_values_that_are_not_finite_and_actions_that_are_not_taken_fail_the_episode_alone(fault: str) -> None:
    task = GymTask(env_id=BOUNDED, kwargs={"fault": fault})
    simulation = opened(task)
    for _ in range(2):
        assert [act(simulation, np.zeros(4))[0] for _ in range(3)] == [RUNNING, RUNNING, FAILED]
        simulation.rewind(simulation.world)
    with Runner(task, Noise(), Executor("serial"), training=True) as runner:
        outcomes = runner.run(random_brains(2, task), training_episodes(0, 0, 2))
    assert outcomes.failed.all()
    assert (outcomes.fitness == -10000.0).all()


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        ("reset", r"exneat-tests/Bounded-v0: its reset\(\) raised KeyError: 'reset'"),
        ("step", r"exneat-tests/Bounded-v0: its step\(\) raised KeyError: 'step'"),
        ("size", r"exneat-tests/Bounded-v0: expected observations of 6 numbers, got 5"),
    ],
)
def test_a_broken_environment_is_said_to_be_broken(fault: str, message: str) -> None:
    task = GymTask(env_id=BOUNDED, kwargs={"fault": fault})
    with Runner(task, Noise(), Executor("serial"), training=True) as runner, pytest.raises(ExneatError, match=message):
        runner.run(random_brains(1, task), training_episodes(0, 0, 1))


def test_an_exploding_body_fails_although_mujoco_mends_it(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    simulation = opened(GymTask(env_id="HalfCheetah-v5"))
    simulation.world.env.unwrapped.data.qvel[:] = 1e12
    assert act(simulation, np.zeros(6))[0] == FAILED
    simulation.rewind(simulation.world)
    assert act(simulation, np.zeros(6))[0] == RUNNING
    assert not list(tmp_path.iterdir())


LEGS = {"back": {"sensors": [2, 3, 4], "actuators": [0, 1, 2]}, "front": {"sensors": [5, 6, 7], "actuators": [3, 4, 5]}}


def test_parts_are_those_of_the_setting_in_its_order() -> None:
    plain = {"name": "gym", "env_id": "HalfCheetah-v5", "parts": LEGS}
    task = build(GymTask, plain, "task.")
    assert [(part.name, part.sensors, part.actuators) for part in task.parts] == [
        ("back", (2, 3, 4), (0, 1, 2)),
        ("front", (5, 6, 7), (3, 4, 5)),
    ]
    assert task.to_plain() == {**plain, "kwargs": {}, "max_steps": None, "failure_floor": -10000.0}
    ran = RunSettings(task=task)
    assert RunSettings.from_plain(ran.to_plain()) == ran
    assert [module.name for module in ran.plan.modules] == ["back", "front"]


def test_the_order_of_parts_makes_another_run_and_that_of_arguments_does_not() -> None:
    def hash_of(**values: Any) -> str:
        return RunSettings(task=GymTask(**values)).full_hash

    legs = {"env_id": "HalfCheetah-v5", "part_entries": LEGS}
    assert hash_of(**legs) != hash_of(**{**legs, "part_entries": dict(reversed(LEGS.items()))})
    some = {"ctrl_cost_weight": 0.1, "forward_reward_weight": 1}
    other = {"forward_reward_weight": 1.0, "ctrl_cost_weight": 0.1}
    assert hash_of(**legs, kwargs=some) == hash_of(**legs, kwargs=other) != hash_of(**legs)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"env_id": "CartPol-v1"}, r"task.env_id: .*'CartPol-v1'\n  did you mean CartPole-v1\?"),
        ({"env_id": "CartPole-v9"}, r"task.env_id: .*\n  did you mean CartPole-v1\?"),
        ({"env_id": "CartPole"}, r"task.env_id: .* with its version, .*\n  did you mean CartPole-v1\?"),
        ({"env_id": "x/y/z"}, "task.env_id: expected the id of a registered environment"),
        ({"env_id": ""}, "task.env_id: expected the id"),
        ({"env_id": 3}, "task.env_id: expected the id"),
        ({"env_id": "no_such_module:Env-v0"}, "task.env_id: expected a module that can be imported"),
        ({"env_id": "Blackjack-v1"}, r"task.env_id: expected .* Box of numbers, .*\n  Blackjack-v1 has Tuple"),
        ({"env_id": "FrozenLake-v1"}, r"task.env_id: expected .* Box of numbers"),
        ({"env_id": ENDLESS}, r"task.max_steps: expected .*, got None\n  .* has no limit"),
        ({"max_steps": 0}, "task.max_steps: expected"),
        ({"max_steps": 10**7}, "task.max_steps: expected"),
        ({"failure_floor": float("nan")}, "task.failure_floor: expected"),
        ({"kwargs": {"no_such": 1}}, r"task.kwargs: expected arguments that CartPole-v1 takes, .*\n  TypeError"),
        ({"kwargs": {"max_episode_steps": 3}}, "task.kwargs: .*\n  task.max_steps limits episodes"),
        ({"kwargs": {"sutton_barto_reward": float("inf")}}, "task.kwargs: expected plain data"),
        ({"kwargs": [1]}, "task.kwargs: expected a section"),
        ({"part_entries": {}}, "task.parts: expected at least one part"),
        ({"part_entries": [1]}, "task.parts: expected a section"),
        ({"part_entries": {"a": {"sensors": [0]}}}, "task.parts.a.actuators: expected a list"),
        ({"part_entries": {"a": {"sensor": [0]}}}, r"task.parts.a.sensor: unknown key .*\n  did you mean .*sensors\?"),
        ({"part_entries": {"a": {"sensors": [4], "actuators": [0]}}}, "a.sensors: expected a whole number from 0 to 3"),
        (
            {"part_entries": {"a": {"sensors": [0, 0], "actuators": [0]}}},
            "a.sensors: expected entries that occur only once in all parts",
        ),
        (
            {"part_entries": {k: {"sensors": [n], "actuators": [1]} for n, k in enumerate("ab")}},
            r"task.parts.b.actuators: .*\n  task.parts.a.actuators has 1 already",
        ),
    ],
)
def test_what_makes_no_sense_is_refused_by_its_key(values: dict[str, Any], message: str) -> None:
    with pytest.raises(ExneatError, match=message) as refusal:
        GymTask(**values)
    assert len(str(refusal.value).splitlines()) <= 3


def test_a_library_that_an_environment_lacks_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def lacking(*_: Any, **__: Any) -> None:
        raise gymnasium.error.DependencyNotInstalled("Box2D is not installed, run `pip install gymnasium[box2d]`")

    monkeypatch.setattr(gymnasium, "make", lacking)
    with pytest.raises(ConfigError, match=r"(?s)an environment that is installed, got 'BipedalWalker-v3'.*box2d"):
        GymTask(env_id="BipedalWalker-v3", kwargs={"hardcore": True})


def test_an_environment_with_pictures_is_filmed_in_its_own_time_and_others_are_refused() -> None:
    task = GymTask(env_id=CHOOSING)
    assert task.step_seconds == 1 / 20
    drawable = task.drawable()
    picture = drawable.camera(64, 64).draw(drawable.snapshot(opened(drawable).world))
    assert picture.shape == (20, 80, 3)
    assert (picture == (200, 0, 0)).all()
    with pytest.raises(ExneatError, match="expected an environment with the render mode rgb_array, got none"):
        GymTask(env_id=BOUNDED).drawable()
    drawable = GymTask(env_id=CHOOSING, kwargs={"pictures": False}).drawable()
    with pytest.raises(ExneatError, match=r"expected a picture of \(height, width, 3\) bytes, got"):
        drawable.snapshot(opened(drawable).world)


@pytest.mark.parametrize(
    "task", [GymTask(env_id="HalfCheetah-v5"), RobotTask(model="half_cheetah")], ids=["gym", "robot"]
)
def test_what_mujoco_says_of_a_model_is_neither_shown_nor_logged_for_any_world(
    task: Task, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    task.open(training=True)
    mujoco.set_mju_user_warning(None)  # as if nothing had been opened yet
    gymnasium.make("HalfCheetah-v5")
    assert "'settotalmass' is deprecated" in "".join(capfd.readouterr())
    Path("MUJOCO_LOG.TXT").unlink()
    models._load.cache_clear()
    with ThreadPoolExecutor(3) as threads:
        assert len(list(threads.map(lambda _: task.open(training=True), range(3)))) == 3
    assert (list(capfd.readouterr()), list(tmp_path.iterdir())) == (["", ""], [])
