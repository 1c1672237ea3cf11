"""Episodes: independent of workers, equal over Gymnasium, noisy as told, and safe from explosions."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager

import neat
import numpy as np
import pytest

from exneat_cli.algorithms import Coevolution, EvolutionSettings, neat_config, to_stock
from exneat_cli.brains import Brain, RandomActions, assemble, motionless
from exneat_cli.brains.rules import weighted_sums
from exneat_cli.rollouts import Executor, Noise, Outcomes, Runner
from exneat_cli.seeding import EpisodeSeeds, generator, shared_episodes, stream, training_episodes
from exneat_cli.tasks import AntTask
from exneat_cli.tasks.robots import mujoco_library
from exneat_cli.wiring import Geometry, Wiring, plan_wiring

TASK = AntTask(max_steps=200)


def ant_brains(count: int, linkage: str = "full") -> list[Brain]:
    plan = plan_wiring(TASK, "exneat", Geometry("all"), linkage, Wiring(), hidden=4)
    configs = [
        neat_config(EvolutionSettings(weight_init_stdev=1.0), count, shape) for shape in plan.subpopulation_shapes
    ]
    seeds = [stream(1, "evolution", index) for index in range(len(configs))]
    teams = Coevolution(configs, seeds, stream(1, "pairing")).ask()
    return [assemble(plan, team.genomes, feed_forward=True) for team in teams]


def episodes_of(count: int) -> list[EpisodeSeeds]:
    return training_episodes(0, 3, count)


def part_of(outcomes: Outcomes, brains: slice, episodes: slice = slice(None)) -> Outcomes:
    return Outcomes._make(values[brains, episodes] for values in outcomes)


def assert_equal(some: Outcomes, others: Outcomes) -> None:
    for name, values in some._asdict().items():
        np.testing.assert_array_equal(values, getattr(others, name), err_msg=name)


@contextmanager
def without_the_library() -> Iterator[None]:
    """As on a machine where MuJoCo's library does not lie where it is looked for."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(mujoco_library, "find_library", lambda directory: None)
        mujoco_library.unreachable_because.cache_clear()
        yield
    mujoco_library.unreachable_because.cache_clear()


@pytest.mark.parametrize("executor", [Executor("threads", 2), Executor("threads", 5), Executor("serial")])
def test_outcomes_do_not_depend_on_the_workers_nor_on_the_order(executor: Executor) -> None:
    brains, episodes = ant_brains(6), episodes_of(2)
    with Runner(TASK, Noise(0.1), Executor("threads", 1), training=True) as runner:
        expected = runner.run(brains, episodes)
    with Runner(TASK, Noise(0.1), executor, training=True) as runner:
        assert_equal(runner.run(brains, episodes), expected)
        backwards = runner.run(brains[::-1], episodes[::-1])
    assert_equal(part_of(backwards, slice(None, None, -1), slice(None, None, -1)), expected)


def test_outcomes_stand_by_brain_and_episode() -> None:
    brains, episodes = ant_brains(3), episodes_of(2)
    with Runner(TASK, Noise(0.1), Executor("threads", 2), training=True) as runner:
        together = runner.run(brains, episodes)
        for name, values in together._asdict().items():
            assert values.shape == (3, 2), name
        for b, brain in enumerate(brains):
            for e, seeds in enumerate(episodes):
                alone = runner.run([brain], [seeds])
                assert_equal(alone, part_of(together, slice(b, b + 1), slice(e, e + 1)))
    assert len(np.unique(together.fitness)) == 6


@pytest.mark.parametrize("training", [True, False])
def test_the_path_over_gymnasium_gives_the_same_outcomes(training: bool) -> None:
    brains, episodes = ant_brains(4), episodes_of(1)

    def run(compiled: bool) -> tuple[Outcomes, np.ndarray]:
        with Runner(TASK, Noise(0.05), Executor("serial"), training=training) as runner:
            assert runner.compiled is compiled
            return runner.run(brains, episodes), runner.trace(brains[0], episodes[0]).steps

    compiled, compiled_trace = run(compiled=True)
    with without_the_library():
        plain, plain_trace = run(compiled=False)
    assert len(np.unique(plain.steps)) > 1
    for name, values in plain._asdict().items():
        np.testing.assert_allclose(getattr(compiled, name), values, rtol=0, atol=1e-9, err_msg=name)
    np.testing.assert_allclose(compiled_trace, plain_trace, rtol=0, atol=1e-9)


def test_over_gymnasium_a_brain_does_not_notice_who_ran_before_it() -> None:
    brains, episodes, task = ant_brains(3), episodes_of(2), AntTask(max_steps=100, patience=15)
    brains.insert(1, with_weights(brains[0], math.nan))
    with without_the_library(), Runner(task, Noise(0.05), Executor("serial"), training=True) as runner:
        together = runner.run(brains, episodes)
        for b, brain in enumerate(brains):
            assert_equal(runner.run([brain], episodes), part_of(together, slice(b, b + 1)))


def test_an_explosion_over_gymnasium_gets_the_failure_floor_too() -> None:
    (brain, *_) = ant_brains(2)
    with without_the_library(), Runner(TASK, Noise(), Executor("serial"), training=True) as runner:
        outcomes = runner.run([with_weights(brain, math.nan)], episodes_of(1))
    assert outcomes.failed.all()
    assert outcomes.fitness == [[-100.0]]


def test_a_missing_library_is_said_in_words() -> None:
    with without_the_library():
        reason = mujoco_library.unreachable_because()
    assert reason is not None
    assert "no MuJoCo library" in reason


def test_standing_still_goes_nowhere_and_earns_about_one_per_step() -> None:
    task = AntTask()
    with Runner(task, Noise(), Executor(), training=False) as runner:
        outcomes = runner.run([motionless(105, np.zeros(8))], shared_episodes("test", 3))
    assert (outcomes.steps == 1000).all()
    assert (np.abs(outcomes.fitness) < 20).all()
    np.testing.assert_allclose(outcomes.full_reward - outcomes.fitness, 1000, rtol=0.01)


def test_sensor_noise_changes_what_a_team_does_but_not_the_start() -> None:
    (brain, *_) = ant_brains(2)
    (seeds,) = episodes_of(1)
    traces = []
    for std in (0.0, 0.5):
        with Runner(TASK, Noise(std), Executor("serial"), training=False) as runner:
            traces.append(runner.trace(brain, seeds).steps)
    np.testing.assert_array_equal(traces[0][0], traces[1][0])
    assert not np.array_equal(traces[0][5], traces[1][5])


def test_noise_is_drawn_in_the_order_of_the_inputs() -> None:
    # A brain that copies input 7 to actuator 0 shows the eighth draw of the noise stream.
    weights = np.zeros((8, 105))
    weights[0, 7] = 1.0
    brain = weighted_sums(weights, np.zeros(8))
    (seeds,) = shared_episodes("test", 1)
    with Runner(AntTask(max_steps=1), Noise(0.25, reset_scale=0.0), Executor("serial"), training=False) as runner:
        trace = runner.trace(brain, seeds).steps
    draws = generator(seeds.sensor_noise).normal(0.0, 0.25, 105)
    # Input 7 is a joint's angle, 0 in the exact initial pose; the control cost shows the action.
    assert trace[1, 5] == pytest.approx(-0.01 * draws[7] ** 2, rel=1e-9)


def test_a_trace_adds_up_to_the_outcome_and_starts_where_the_world_does() -> None:
    brains, (seeds,) = ant_brains(3), episodes_of(1)
    with Runner(TASK, Noise(), Executor("serial"), training=False) as runner:
        outcomes = runner.run(brains, [seeds])
        for b, brain in enumerate(brains):
            trace, fitness = runner.trace(brain, seeds).steps, outcomes.fitness[b, 0]
            assert trace.shape == (outcomes.steps[b, 0] + 1, 7)
            assert not trace[0, 3:].any()
            assert trace[:, 3].sum() == pytest.approx(fitness)
            assert trace[:, 3:].sum() == pytest.approx(outcomes.full_reward[b, 0])
            assert (trace[-1, 0] - trace[0, 0]) / 0.05 == pytest.approx(fitness)


def with_weights(brain: Brain, weight: float) -> Brain:
    """The brain with every weight replaced, and identity instead of tanh."""
    return brain._replace(
        edge_weight=np.full_like(brain.edge_weight, weight), activation=np.full_like(brain.activation, 3)
    )


@pytest.mark.parametrize("weight", [math.nan, math.inf, 1e200])
def test_an_exploding_brain_gets_the_failure_floor_and_leaves_the_others_alone(weight: float) -> None:
    good, episodes = ant_brains(3), episodes_of(1)
    bad = [with_weights(brain, weight) for brain in good]
    with Runner(TASK, Noise(), Executor("threads", 2), training=True) as runner:
        expected = runner.run(good, episodes)
        mixed = runner.run([brain for pair in zip(bad, good, strict=True) for brain in pair], episodes)
    assert_equal(part_of(mixed, slice(1, None, 2)), expected)
    assert not expected.failed.any()
    assert mixed.failed[::2].all()
    assert (mixed.fitness[::2] == -100.0).all()
    assert (mixed.full_reward[::2] == -100.0).all()


@pytest.mark.parametrize(
    ("acting", "came"),
    [
        (motionless(3, np.zeros(8)), r"\(3, 8\)"),
        (motionless(105, np.zeros(2)), r"\(105, 2\)"),
        (motionless(200, np.zeros(8)), r"\(200, 8\)"),
        (RandomActions(np.zeros(3), np.ones(3)), r"\(105, 3\)"),
    ],
)
def test_a_brain_of_another_task_is_refused_before_it_can_touch_memory(
    acting: Brain | RandomActions, came: str
) -> None:
    (seeds,) = shared_episodes("test", 1)
    message = rf"brains: expected sizes \(105, 8\) of observation and action, got {came}"
    with Runner(TASK, Noise(), Executor("serial"), training=False) as runner:
        with pytest.raises(ValueError, match=message):
            runner.run([acting] if isinstance(acting, Brain) else acting, [seeds])
        with pytest.raises(ValueError, match=message):
            runner.trace(acting, seeds)


def test_a_brain_of_another_task_is_refused_among_others_too_and_so_is_no_brain_at_all() -> None:
    good, episodes = motionless(105, np.zeros(8)), shared_episodes("test", 1)
    with Runner(TASK, Noise(), Executor("serial"), training=False) as runner:
        with pytest.raises(ValueError, match=r"got \[\(105, 8\), \(106, 8\)\]"):
            runner.run([good, motionless(106, np.zeros(8)), good], episodes)
        with pytest.raises(ValueError, match=r"expected at least one, .*got \[\]"):
            runner.run([], episodes)


def test_random_actions_repeat_with_their_seed_and_stay_in_bounds() -> None:
    low, high = TASK.action_bounds
    seeds = shared_episodes("test", 1)[0]

    def act(seed: int) -> float:
        own = seeds._replace(actions=stream(seed, "random_actions", 0))
        with Runner(TASK, Noise(), Executor("serial"), training=False) as runner:
            outcomes = runner.run(RandomActions(low, high), [own])
            trace = runner.trace(RandomActions(low, high), own).steps
        assert len(trace) == outcomes.steps[0, 0] + 1
        # The largest control cost is that of an action on its bounds.
        costs = -trace[1:, 5] / 0.01
        assert 0 < costs.min() < costs.max() < 8
        return float(outcomes.full_reward[0, 0])

    assert act(0) == act(0)
    assert act(0) != act(1)


def test_a_genome_of_neat_walks_the_same_over_gymnasium_and_neat_pythons_network() -> None:
    task = AntTask()
    config = neat_config(EvolutionSettings(), 3, (105, 6, 8))
    plan = plan_wiring(task, "neat", Geometry(), "none", Wiring(), hidden=6)
    (team, *_) = Coevolution([config], [stream(5, "evolution", 0)], stream(5, "pairing")).ask()
    (seeds,) = shared_episodes("test", 1)
    with Runner(task, Noise(), Executor("serial"), training=False) as runner:
        outcomes = runner.run([assemble(plan, team.genomes, feed_forward=True)], [seeds])
    import gymnasium

    env = gymnasium.make("Ant-v5", disable_env_checker=True)
    env.unwrapped.np_random = generator(seeds.world)
    network = neat.nn.FeedForwardNetwork.create(to_stock(team.genomes[0]), config)
    observation, _ = env.reset()
    forward, steps, over = 0.0, 0, False
    while not over:
        observation, _, terminated, truncated, info = env.step(np.array(network.activate(observation)))
        forward += info["reward_forward"]
        steps += 1
        over = terminated or truncated
    env.close()
    assert steps == outcomes.steps[0, 0]
    assert forward == pytest.approx(outcomes.fitness[0, 0], abs=1e-6)
