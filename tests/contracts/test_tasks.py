"""What every task promises to the other rooms."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from exneat_cli.algorithms import Coevolution, neat_config
from exneat_cli.brains import Brain, RandomActions, assemble, linear_fusion, motionless
from exneat_cli.compiling import with_functions
from exneat_cli.rollouts import Executor, Noise, Outcomes, Runner
from exneat_cli.rollouts.episode import Buffers, Conditions, _episodes
from exneat_cli.runs import RunSettings
from exneat_cli.seeding import EpisodeSeeds, shared_episodes, stream, training_episodes
from exneat_cli.tasks import ENDED, RUNNING, TASKS, Task
from exneat_cli.wiring import Wiring, plan_wiring

SHORT: dict[str, dict[str, Any]] = {"ant": {"max_steps": 60, "patience": 15}}


@pytest.fixture(params=sorted(TASKS))
def task(request: pytest.FixtureRequest) -> Task:
    return TASKS[request.param](**SHORT.get(request.param, {}))


def random_episodes(count: int) -> list[EpisodeSeeds]:
    episodes = training_episodes(3, 0, count)
    return [seeds._replace(actions=stream(9, "random_actions", k)) for k, seeds in enumerate(episodes)]


def random_actions(task: Task) -> RandomActions:
    return RandomActions(*task.action_bounds)


def run(
    task: Task,
    acting: list[Brain] | RandomActions,
    episodes: list[EpisodeSeeds],
    std: float = 0.0,
    training: bool = True,
) -> Outcomes:
    with Runner(task, Noise(std), Executor("serial"), training=training) as runner:
        return runner.run(acting, episodes)


def assert_equal(some: Outcomes, others: Outcomes) -> None:
    for name, values in some._asdict().items():
        np.testing.assert_array_equal(values, getattr(others, name), err_msg=name)


def part_of(outcomes: Outcomes, brains: slice = slice(None), episodes: slice = slice(None)) -> Outcomes:
    return Outcomes._make(values[brains, episodes] for values in outcomes)


def quite_different_brains(task: Task) -> list[Brain]:
    """Random networks, one that follows all it senses, one that fails at once, and one that does nothing."""
    settings = RunSettings(task=task, algorithm="neat", population=4)
    (shape,) = settings.plan.subpopulation_shapes
    config = neat_config(settings.evolution, settings.population, shape)
    teams = Coevolution([config], [stream(4, "evolution", 0)], stream(4, "pairing")).ask()
    networks = [assemble(settings.plan, t.genomes, feed_forward=settings.evolution.feed_forward) for t in teams]
    sizes = task.observation_size, len(task.actuator_names)
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
    assert sorted(sensors) == list(range(task.observation_size))
    assert len(set(actuators)) == len(actuators)
    assert set(actuators) <= set(range(len(task.actuator_names)))
    assert len({part.name for part in task.parts}) == len(task.parts)


def test_sizes_agree_with_one_another(task: Task) -> None:
    low, high = task.action_bounds
    assert low.shape == high.shape == task.resting_action.shape == (len(task.actuator_names),)
    assert (low < high).all()
    with Runner(task, Noise(), Executor("serial"), training=False) as runner:
        trace = runner.trace(random_actions(task), random_episodes(1)[0]).steps
    assert trace.shape[1] == len(task.trace_columns) + len(task.terms)


def test_the_observation_is_written_whole_and_finite(task: Task) -> None:
    simulation = task.open(training=False, reset_scale=0.1)
    rng = np.random.default_rng(0)
    simulation.reset(simulation.world, rng)
    observation = np.full(task.observation_size, np.nan)
    simulation.observe(simulation.world, observation)
    assert np.isfinite(observation).all()


def test_equal_seeds_give_equal_episodes_and_others_differ(task: Task) -> None:
    episodes = random_episodes(12)
    first, again = (run(task, random_actions(task), episodes) for _ in range(2))
    assert_equal(first, again)
    assert len(set(zip(*(values[0].tolist() for values in first), strict=True))) > 1


def test_no_state_is_left_between_episodes(task: Task) -> None:
    episodes, acting = random_episodes(8), random_actions(task)
    expected = run(task, acting, episodes)
    backwards = run(task, acting, episodes[::-1])
    assert_equal(part_of(backwards, episodes=slice(None, None, -1)), expected)
    assert_equal(run(task, acting, [episodes[3]]), part_of(expected, episodes=slice(3, 4)))


@pytest.mark.parametrize("std", [0.0, 0.3])
@pytest.mark.parametrize("training", [True, False])
def test_what_a_brain_does_never_depends_on_who_ran_before_it_in_the_same_world(
    task: Task, training: bool, std: float
) -> None:
    brains, episodes = quite_different_brains(task), training_episodes(6, 0, 5)
    together = run(task, brains, episodes, std, training)
    backwards = run(task, brains[::-1], episodes, std, training)
    assert_equal(part_of(backwards, slice(None, None, -1)), together)
    for b, brain in enumerate(brains):
        assert_equal(run(task, [brain], episodes, std, training), part_of(together, slice(b, b + 1)))
    assert together.failed[1].all()
    assert len(np.unique(together.steps)) > 1


@pytest.mark.parametrize("std", [0.0, 0.3])
def test_a_trace_never_depends_on_what_the_runner_did_before(task: Task, std: float) -> None:
    brains, (seeds, other) = quite_different_brains(task), training_episodes(6, 0, 2)
    with Runner(task, Noise(std), Executor("serial"), training=True) as used:
        for brain in brains:
            used.run(brains, [other])
            trace = used.trace(brain, seeds)
            with Runner(task, Noise(std), Executor("serial"), training=True) as fresh:
                expected = fresh.trace(brain, seeds)
            np.testing.assert_array_equal(trace.steps, expected.steps)
            np.testing.assert_array_equal(trace.tiles, expected.tiles)


def test_a_rewind_takes_the_world_back_to_the_start_that_was_drawn(task: Task) -> None:
    simulation, rng = task.open(training=True, reset_scale=0.1), np.random.default_rng(2)
    actions = rng.uniform(*task.action_bounds, size=(30, len(task.actuator_names)))

    def live() -> list[list[float]]:
        seen = []
        for action in actions:
            observation, place = np.zeros(task.observation_size), np.zeros(len(task.trace_columns))
            terms = np.zeros(len(task.terms))
            simulation.observe(simulation.world, observation)
            status = simulation.step(simulation.world, action, terms)
            simulation.locate(simulation.world, place)
            seen.append([*observation, *terms, *place, float(status)])
            if status != RUNNING:
                break
        return seen

    for _ in range(5):
        simulation.reset(simulation.world, rng)
        first = live()
        for _ in range(2):
            simulation.rewind(simulation.world)
            assert live() == first


@pytest.mark.parametrize("training", [True, False])
def test_training_and_test_episodes_end_in_time_and_report_sensible_figures(task: Task, training: bool) -> None:
    outcomes = run(task, random_actions(task), random_episodes(20), std=0.1, training=training)
    assert outcomes.fitness.shape == (1, 20)
    assert not outcomes.failed.any()
    assert (outcomes.steps >= 1).all()
    assert (outcomes.steps <= task.longest_episode).all()
    assert np.isfinite(outcomes.fitness).all()
    if task.name != "ant":
        assert (outcomes.fitness >= 0.0).all()
        assert (outcomes.fitness <= 1.0).all()
        np.testing.assert_array_equal(outcomes.full_reward, outcomes.fitness)


def test_figures_of_many_episodes_are_those_of_each(task: Task) -> None:
    totals = np.random.default_rng(5).normal(size=(3, 4, len(task.terms)))
    for figure in (task.fitness_of, task.full_reward_of):
        figures = figure(totals)
        assert figures.shape == (3, 4)
        for index in np.ndindex(3, 4):
            assert figures[index] == figure(totals[index])


def test_what_a_brain_receives_lies_within_the_limits_however_strong_the_noise(task: Task) -> None:
    simulation = task.open(training=False, reset_scale=0.1)
    received: list[np.ndarray] = []

    def activate(brains: None, b: int, memory: np.ndarray, action: np.ndarray) -> None:
        received.append(memory.copy())
        action[:] = task.resting_action

    loop = with_functions(
        _episodes,
        "recording",
        reset=simulation.reset,
        rewind=simulation.rewind,
        observe=simulation.observe,
        step=simulation.step,
        locate=simulation.locate,
        activate=activate,
    )
    sensors, actuators, terms = task.observation_size, len(task.actuator_names), len(task.terms)
    limits = task.observation_limits
    loop(
        simulation.world,
        None,
        *(0, 2),
        *(np.random.default_rng(k) for k in range(3)),
        Conditions(5.0, *limits, action_low=np.zeros(actuators), action_span=np.full(actuators, task.tie_noise)),
        Buffers(
            memory=np.zeros(sensors),
            action=np.zeros(actuators),
            terms=np.zeros(terms),
            sensor_noise=np.zeros((task.longest_episode, sensors)),
            action_noise=np.zeros((task.longest_episode, actuators)),
        ),
        sensors,
        np.zeros(1, np.bool_),
        status=np.zeros(2, np.int64),
        steps=np.zeros(2, np.int64),
        totals=np.zeros((2, terms)),
        trace=np.zeros((0, 0)),
        located=0,
    )
    seen = np.array(received)
    assert limits[0] <= seen.min() < seen.max() <= limits[1]
    assert seen.std() > 0.1


def test_an_action_that_is_not_finite_gets_the_failure_floor(task: Task) -> None:
    brain = motionless(task.observation_size, np.full(len(task.actuator_names), np.nan))
    outcomes = run(task, [brain], shared_episodes("test", 1))
    assert outcomes.failed.all()
    assert outcomes.fitness == outcomes.full_reward == [[task.failure_floor]]


def test_every_step_returns_a_known_status_until_the_end(task: Task) -> None:
    simulation = task.open(training=True, reset_scale=0.1)
    rng, terms = np.random.default_rng(1), np.zeros(len(task.terms))
    simulation.reset(simulation.world, rng)
    status, steps = RUNNING, 0
    while status == RUNNING:
        status = simulation.step(simulation.world, task.resting_action, terms)
        steps += 1
        assert steps <= task.longest_episode
    assert status == ENDED


@pytest.mark.parametrize("algorithm", ["exneat", "neat"])
def test_a_task_can_be_wired_with_its_own_defaults(task: Task, algorithm: str) -> None:
    settings = RunSettings(task=task, algorithm=algorithm)
    assert settings.evolution.feed_forward is not task.needs_memory
    driven = [actuator for module in settings.plan.modules for actuator in module.drives]
    assert len(set(driven)) == len(driven)
    assert plan_wiring(task, "exneat", settings.geometry, "none", Wiring(), hidden=0).modules
