"""What every task promises to the other rooms."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from exneat_cli.algorithms import Problem
from exneat_cli.brains import Brains, assemble, linear_fusion, motionless
from exneat_cli.rollouts import Executor, Noise, Outcomes, Runner
from exneat_cli.runs import RunSettings
from exneat_cli.seeding import EpisodeSeeds, stream, training_episodes
from exneat_cli.tasks import ENDED, FAILED, RUNNING, TASKS, HasFullReward, HasInitialPose, HasTiles, Simulation, Task

SHORT: dict[str, dict[str, Any]] = {name: {"max_steps": 60, "patience": 15} for name in ("ant", "robot")}


@pytest.fixture(params=sorted(TASKS))
def task(request: pytest.FixtureRequest) -> Task:
    return TASKS[request.param](**SHORT.get(request.param, {}))


def opened(task: Task, seed: int = 0, training: bool = True) -> Simulation:
    simulation = task.open(training=training)
    simulation.reset(simulation.world, np.random.default_rng(seed))
    return simulation


def live(task: Task, simulation: Simulation) -> list[list[float]]:
    """All that comes out of an episode under the same random actions."""
    rng, seen, status = np.random.default_rng(2), [], RUNNING
    while status == RUNNING:
        observation, terms = np.full(task.observation_size, np.nan), np.full(len(task.terms), np.nan)
        place = np.full(len(task.trace_columns), np.nan)
        simulation.observe(simulation.world, observation)
        status = simulation.step(simulation.world, rng.uniform(*task.action_bounds), terms)
        if simulation.locate is not None:
            simulation.locate(simulation.world, place)
        seen.append([*observation, *terms, *place, float(status)])
    return seen


def run(task: Task, acting: list[Brains] | None, episodes: list[EpisodeSeeds], std: float, training: bool) -> Outcomes:
    with Runner(task, Noise(std), Executor("serial"), training=training) as runner:
        return runner.run(acting, episodes)


def rows(outcomes: Outcomes, brains: slice = slice(None)) -> list[Any]:
    """Fitness, full reward, steps and failures of some brains."""
    return [values[brains].tolist() for values in outcomes[:4]]


def quite_different_brains(task: Task) -> list[Brains]:
    """Random networks, one that follows all it senses, one that fails at once, and one that does nothing."""
    settings = RunSettings(task=task, algorithm="neat", population=4)  # type: ignore[arg-type]
    problem = Problem(settings.plan, settings.evolution, 4, 1, "rank", seed=4)
    teams = settings.algorithm.start(problem).ask()[0]
    networks = [assemble(settings.plan, [t.genomes], feed_forward=settings.evolution.feed_forward) for t in teams]
    sizes = task.sensed_size, len(task.actuator_names)
    failing = motionless(sizes[0], np.full(sizes[1], np.nan))
    return [linear_fusion(*sizes, task.parts), failing, *networks, motionless(sizes[0], task.resting_action)]


def test_a_task_goes_by_its_name_and_is_frozen(task: Task) -> None:
    assert TASKS[task.name] is type(task)
    assert dataclasses.is_dataclass(task)
    with pytest.raises(dataclasses.FrozenInstanceError):
        task.name = "other"


def test_sensors_and_actuators_of_the_parts_exist_and_do_not_overlap(task: Task) -> None:
    places = [*task.parts, *([task.trunk] if task.trunk else [])]
    sensors = [index for place in places for index in place.sensors]
    actuators = [index for place in places for index in place.actuators]
    assert sorted(sensors) == sorted(task.whole)
    assert set(task.whole) <= set(range(task.sensed_size))
    assert len(set(actuators)) == len(actuators)
    assert set(actuators) <= set(range(len(task.actuator_names)))
    assert len({part.name for part in task.parts}) == len(task.parts)


def test_sizes_agree_with_one_another_and_everything_is_written_whole_and_finite(task: Task) -> None:
    low, high = task.action_bounds
    assert low.shape == high.shape == task.resting_action.shape == (len(task.actuator_names),)
    assert (low < high).all()
    assert np.isfinite(live(task, opened(task))).all()


@pytest.mark.parametrize("training", [True, False])
def test_an_episode_follows_from_its_seed_however_used_the_world_is(task: Task, training: bool) -> None:
    used = task.open(training=training)
    for seed in (3, 4, 3):
        used.reset(used.world, np.random.default_rng(seed))
        expected = live(task, opened(task, seed, training))
        assert live(task, used) == expected
        for _ in range(2):
            used.rewind(used.world)
            assert live(task, used) == expected
    assert live(task, opened(task, 3)) != live(task, opened(task, 4))


@pytest.mark.parametrize("training", [True, False])
def test_episodes_end_in_time_and_by_doing_nothing_too(task: Task, training: bool) -> None:
    for seed in range(10):
        assert 1 <= len(live(task, opened(task, seed, training))) <= task.longest_episode
    resting, terms, statuses = opened(task, training=training), np.zeros(len(task.terms)), [RUNNING]
    while statuses[-1] == RUNNING:
        statuses.append(resting.step(resting.world, task.resting_action, terms))
    assert statuses[-1] == ENDED
    assert len(statuses) - 1 <= task.longest_episode


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_an_action_that_is_not_finite_fails(task: Task, value: float) -> None:
    action, simulation = task.resting_action, opened(task)
    action[-1] = value
    assert simulation.step(simulation.world, action, np.zeros(len(task.terms))) == FAILED


@pytest.mark.parametrize(("training", "std"), [(True, 0.0), (True, 0.3), (False, 0.3)])
def test_what_a_brain_does_never_depends_on_who_ran_before_it_in_the_same_world(
    task: Task, training: bool, std: float
) -> None:
    brains, episodes = quite_different_brains(task), training_episodes(6, 0, 5)
    together = run(task, brains, episodes, std, training)
    assert rows(run(task, brains[::-1], episodes, std, training), slice(None, None, -1)) == rows(together)
    for b, brain in enumerate(brains):
        assert rows(run(task, [brain], episodes, std, training)) == rows(together, slice(b, b + 1))
    assert together.failed[1].all()
    assert (together.fitness[1] == task.failure_floor).all()
    assert (together.full_reward[1] == task.failure_floor).all()
    assert len(np.unique(together.steps)) > 1


def test_a_trace_never_depends_on_what_the_runner_did_before(task: Task) -> None:
    brains, (seeds, other) = quite_different_brains(task), training_episodes(6, 0, 2)
    with Runner(task, Noise(0.3), Executor("serial"), training=True) as used:
        for brain in brains:
            used.run(brains, [other])
            steps, tiles = used.trace(brain, seeds)
            with Runner(task, Noise(0.3), Executor("serial"), training=True) as fresh:
                expected_steps, expected_tiles = fresh.trace(brain, seeds)
            np.testing.assert_array_equal(steps, expected_steps)
            np.testing.assert_array_equal(tiles, expected_tiles)
            assert steps.shape[1] == len(task.trace_columns) + len(task.terms)
            assert (tiles is not None) == isinstance(task, HasTiles)


def test_random_episodes_report_sensible_figures(task: Task) -> None:
    episodes = [e._replace(actions=stream(9, "random_actions", k)) for k, e in enumerate(training_episodes(3, 0, 20))]
    outcomes = run(task, None, episodes, std=0.1, training=False)
    assert outcomes.fitness.shape == (1, 20)
    assert not outcomes.failed.any()
    assert np.isfinite(outcomes.fitness).all()
    if isinstance(task, HasTiles):
        assert (outcomes.fitness >= 0.0).all()
        assert (outcomes.fitness <= 1.0).all()
    if not isinstance(task, HasFullReward):
        np.testing.assert_array_equal(outcomes.full_reward, outcomes.fitness)


def test_figures_of_many_episodes_are_those_of_each(task: Task) -> None:
    totals = np.random.default_rng(5).normal(size=(3, 4, len(task.terms)))
    for figure in (task.fitness_of, *([task.full_reward_of] if isinstance(task, HasFullReward) else [])):
        figures = figure(totals)
        assert figures.shape == (3, 4)
        for index in np.ndindex(3, 4):
            assert figures[index] == figure(totals[index])


@pytest.mark.parametrize("name", [name for name, kind in TASKS.items() if issubclass(kind, HasInitialPose)])
def test_without_noise_on_the_initial_pose_all_worlds_are_the_same(name: str) -> None:
    task = TASKS[name]()
    assert isinstance(task, HasInitialPose)
    worlds = [task.open_disturbed(training=True, reset_scale=0.0) for _ in range(2)]
    for seed, simulation in enumerate(worlds):
        simulation.reset(simulation.world, np.random.default_rng(seed))
    assert live(task, worlds[0]) == live(task, worlds[1])


@pytest.mark.parametrize("algorithm", ["exneat", "neat"])
def test_a_task_can_be_wired_with_its_own_defaults(task: Task, algorithm: str) -> None:
    settings = RunSettings(task=task, algorithm=algorithm)  # type: ignore[arg-type]
    assert settings.evolution.feed_forward is not task.recurrent
    driven = [actuator for module in settings.plan.modules for actuator in module.drives]
    assert len(set(driven)) == len(driven)
