"""What every task promises to the other rooms."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from exneat_cli.brains import RandomActions, motionless
from exneat_cli.rollouts import Executor, Job, Noise, Outcome, Runner
from exneat_cli.rollouts.episode import Conditions, _episode
from exneat_cli.runs import RunSettings
from exneat_cli.seeding import shared_episodes, stream, training_episodes
from exneat_cli.tasks import ENDED, RUNNING, TASKS, Task
from exneat_cli.tasks.compiling import with_functions
from exneat_cli.wiring import Wiring, plan_wiring

SHORT: dict[str, dict[str, Any]] = {"ant": {"max_steps": 60}}


@pytest.fixture(params=sorted(TASKS))
def task(request: pytest.FixtureRequest) -> Task:
    return TASKS[request.param](**SHORT.get(request.param, {}))


def random_jobs(task: Task, count: int) -> list[Job]:
    brain = RandomActions(*task.action_bounds)
    episodes = training_episodes(3, 0, count)
    return [Job(brain, seeds._replace(actions=stream(9, "random_actions", k))) for k, seeds in enumerate(episodes)]


def run(task: Task, jobs: list[Job], std: float = 0.0, training: bool = True) -> list[Outcome]:
    with Runner(task, Noise(std), Executor("serial"), training=training) as runner:
        return runner.run(jobs)


def test_a_task_goes_by_its_name_and_is_frozen(task: Task) -> None:
    assert TASKS[task.name] is type(task)
    assert dataclasses.is_dataclass(task)
    with pytest.raises(dataclasses.FrozenInstanceError):
        task.name = "other"  # type: ignore[misc]


def test_sensors_and_actuators_of_the_sectors_exist_and_do_not_overlap(task: Task) -> None:
    places = [*task.sectors, *([task.trunk] if task.trunk else [])]
    sensors = [index for place in places for index in place.sensors]
    actuators = [index for place in places for index in place.actuators]
    assert sorted(sensors) == list(range(task.observation_size))
    assert len(set(actuators)) == len(actuators)
    assert set(actuators) <= set(range(len(task.actuator_names)))
    assert len({sector.name for sector in task.sectors}) == len(task.sectors)


def test_sizes_agree_with_one_another(task: Task) -> None:
    low, high = task.action_bounds
    assert low.shape == high.shape == task.resting_action.shape == (len(task.actuator_names),)
    assert (low < high).all()
    with Runner(task, Noise(), Executor("serial"), training=False) as runner:
        trace = runner.trace(random_jobs(task, 1)[0]).steps
    assert trace.shape[1] == len(task.trace_columns) + len(task.terms)


def test_the_observation_is_written_whole_and_finite(task: Task) -> None:
    simulation = task.open(training=False, reset_scale=0.1)
    rng = np.random.default_rng(0)
    simulation.reset(simulation.world, rng)
    observation = np.full(task.observation_size, np.nan)
    simulation.observe(simulation.world, observation)
    assert np.isfinite(observation).all()


def test_equal_seeds_give_equal_episodes_and_others_differ(task: Task) -> None:
    jobs = random_jobs(task, 12)
    first, again = run(task, jobs), run(task, jobs)
    assert first == again
    assert len(set(first)) > 1


def test_no_state_is_left_between_episodes(task: Task) -> None:
    jobs = random_jobs(task, 8)
    assert run(task, jobs[::-1]) == run(task, jobs)[::-1]
    assert run(task, [jobs[3]]) == [run(task, jobs)[3]]


@pytest.mark.parametrize("training", [True, False])
def test_training_and_test_episodes_end_and_report_sensible_figures(task: Task, training: bool) -> None:
    for outcome in run(task, random_jobs(task, 20), std=0.1, training=training):
        assert not outcome.failed
        assert outcome.steps >= 1
        assert np.isfinite(outcome.fitness)
        if task.name != "ant":
            assert 0.0 <= outcome.fitness <= 1.0
            assert outcome.full_reward == outcome.fitness


def test_what_a_brain_receives_lies_within_the_limits_however_strong_the_noise(task: Task) -> None:
    simulation = task.open(training=False, reset_scale=0.1)
    received: list[np.ndarray] = []

    def activate(agent: None, memory: None, observation: np.ndarray, action: np.ndarray, rng: None) -> None:
        received.append(observation.copy())
        action[:] = task.resting_action

    loop = with_functions(
        _episode,
        "recording",
        reset=simulation.reset,
        observe=simulation.observe,
        step=simulation.step,
        locate=simulation.locate,
        fresh_memory=lambda agent: None,
        activate=activate,
    )
    observation, action = np.zeros(task.observation_size), np.zeros(len(task.actuator_names))
    totals, trace = np.zeros(len(task.terms)), np.zeros((0, 0))
    rngs = [np.random.default_rng(k) for k in range(3)]
    limits = task.observation_limits
    conditions = Conditions(5.0, *limits, tie_noise=task.tie_noise)
    loop(simulation.world, None, *rngs, conditions, observation, action, totals, trace, 0)
    seen = np.array(received)
    assert limits[0] <= seen.min() < seen.max() <= limits[1]
    assert seen.std() > 0.1


def test_an_action_that_is_not_finite_gets_the_failure_floor(task: Task) -> None:
    brain = motionless(task.observation_size, np.full(len(task.actuator_names), np.nan))
    (outcome,) = run(task, [Job(brain, shared_episodes("test", 1)[0])])
    assert outcome.failed
    assert outcome.fitness == task.failure_floor


def test_every_step_returns_a_known_status_until_the_end(task: Task) -> None:
    simulation = task.open(training=True, reset_scale=0.1)
    rng, terms = np.random.default_rng(1), np.zeros(len(task.terms))
    simulation.reset(simulation.world, rng)
    status, steps = RUNNING, 0
    while status == RUNNING:
        status = simulation.step(simulation.world, task.resting_action, rng, terms)
        steps += 1
        assert steps < 10_000
    assert status == ENDED


@pytest.mark.parametrize("algorithm", ["exneat", "neat"])
def test_a_task_can_be_wired_with_its_own_defaults(task: Task, algorithm: str) -> None:
    settings = RunSettings(task=task, algorithm=algorithm)
    assert settings.evolution.feed_forward is not task.needs_memory
    driven = [actuator for module in settings.plan.modules for actuator in module.drives]
    assert len(set(driven)) == len(driven)
    assert plan_wiring(task, "exneat", settings.geometry, "none", Wiring(), hidden=0).modules
