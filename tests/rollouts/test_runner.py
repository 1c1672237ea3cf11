"""Episodes: independent of workers, equal over Gymnasium, noisy as told, and safe from explosions."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import neat
import numpy as np
import pytest

from exneat_cli.brains import Brain, RandomActions, assemble, motionless
from exneat_cli.brains.rules import weighted_sums
from exneat_cli.evolution import Coevolution, EvolutionSettings, neat_config
from exneat_cli.rollouts import Executor, Job, Noise, Outcome, Runner
from exneat_cli.rollouts.runner import _Booth
from exneat_cli.seeding import generator, shared_episodes, stream, training_episodes
from exneat_cli.tasks import AntTask, mujoco_library
from exneat_cli.wiring import Geometry, Wiring, plan_wiring

TASK = AntTask(max_steps=200)


def ant_brains(count: int, linkage: str = "full") -> list[Brain]:
    plan = plan_wiring(TASK, "exneat", Geometry("all"), linkage, Wiring(), hidden=4)
    configs = [neat_config(EvolutionSettings(weight_sd=1.0), count, shape) for shape in plan.subpopulation_shapes]
    seeds = [stream(1, "evolution", index) for index in range(len(configs))]
    teams = Coevolution(configs, seeds, stream(1, "pairing")).ask()
    return [assemble(plan, team.genomes, feed_forward=True) for team in teams]


def jobs_of(brains: list[Brain], episodes: int = 2) -> list[Job]:
    return [Job(brain, seeds) for brain in brains for seeds in training_episodes(0, 3, episodes)]


@contextmanager
def without_the_library() -> Iterator[None]:
    """As on a machine where MuJoCo's library does not lie where it is looked for."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(mujoco_library, "find_library", lambda directory: None)
        mujoco_library.unreachable_because.cache_clear()
        yield
    mujoco_library.unreachable_because.cache_clear()


@pytest.mark.parametrize("executor", [Executor("threads", 2), Executor("threads", 5), Executor("serial")])
def test_outcomes_do_not_depend_on_the_workers(executor: Executor) -> None:
    jobs = jobs_of(ant_brains(6))
    with Runner(TASK, Noise(0.1), Executor("threads", 1), training=True) as runner:
        expected = runner.run(jobs)
    with Runner(TASK, Noise(0.1), executor, training=True) as runner:
        assert runner.run(jobs) == expected
        assert runner.run(jobs[::-1]) == expected[::-1]


@pytest.mark.parametrize("training", [True, False])
def test_the_path_over_gymnasium_gives_the_same_outcomes(training: bool) -> None:
    jobs = jobs_of(ant_brains(4), episodes=1)

    def run(compiled: bool) -> tuple[list[Outcome], np.ndarray]:
        with Runner(TASK, Noise(0.05), Executor("serial"), training=training) as runner:
            assert runner.compiled is compiled
            return runner.run(jobs), runner.trace(jobs[0]).steps

    compiled, compiled_trace = run(compiled=True)
    with without_the_library():
        plain, plain_trace = run(compiled=False)
    assert len({outcome.steps for outcome in plain}) > 1
    np.testing.assert_allclose(np.array(compiled), np.array(plain), rtol=0, atol=1e-9)
    np.testing.assert_allclose(compiled_trace, plain_trace, rtol=0, atol=1e-9)


def test_an_explosion_over_gymnasium_gets_the_failure_floor_too() -> None:
    (job, *_) = jobs_of(ant_brains(2), episodes=1)
    with without_the_library(), Runner(TASK, Noise(), Executor("serial"), training=True) as runner:
        (outcome,) = runner.run([Job(with_weights(job.brain, math.nan), job.seeds)])
    assert outcome.failed
    assert outcome.fitness == -100.0


def test_an_exception_in_one_episode_stops_the_others_and_leaves_the_runner_usable() -> None:
    jobs = jobs_of(ant_brains(20))
    run_one, begun = _Booth.run, []

    def break_on_the_third(booth: _Booth, *arguments: Any) -> Outcome:
        begun.append(arguments)
        if arguments[1] is jobs[2].brain:
            raise RuntimeError("broken")
        return run_one(booth, *arguments)

    with Runner(TASK, Noise(), Executor("threads", 2), training=True) as runner:
        expected = runner.run(jobs)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(_Booth, "run", break_on_the_third)
            with pytest.raises(RuntimeError, match="broken"):
                runner.run(jobs)
        assert len(begun) < len(jobs)
        assert runner.run(jobs) == expected


def test_a_missing_library_is_said_in_words() -> None:
    with without_the_library():
        reason = mujoco_library.unreachable_because()
    assert reason is not None
    assert "no MuJoCo library" in reason


def test_standing_still_goes_nowhere_and_earns_about_one_per_step() -> None:
    task = AntTask()
    with Runner(task, Noise(), Executor(), training=False) as runner:
        outcomes = runner.run([Job(motionless(105, np.zeros(8)), seeds) for seeds in shared_episodes("test", 3)])
    for outcome in outcomes:
        assert outcome.steps == 1000
        assert abs(outcome.fitness) < 20
        assert outcome.full_reward - outcome.fitness == pytest.approx(1000, rel=0.01)


def test_sensor_noise_changes_what_a_team_does_but_not_the_start() -> None:
    (brain, *_) = ant_brains(2)
    job = jobs_of([brain])[0]
    traces = []
    for std in (0.0, 0.5):
        with Runner(TASK, Noise(std), Executor("serial"), training=False) as runner:
            traces.append(runner.trace(job).steps)
    np.testing.assert_array_equal(traces[0][0], traces[1][0])
    assert not np.array_equal(traces[0][5], traces[1][5])


def test_noise_is_drawn_in_the_order_of_the_inputs() -> None:
    # A brain that copies input 7 to actuator 0 shows the eighth draw of the noise stream.
    weights = np.zeros((8, 105))
    weights[0, 7] = 1.0
    brain = weighted_sums(weights, np.zeros(8))
    job = Job(brain, shared_episodes("test", 1)[0])
    with Runner(AntTask(max_steps=1), Noise(0.25, reset_scale=0.0), Executor("serial"), training=False) as runner:
        trace = runner.trace(job).steps
    draws = generator(job.seeds.sensor_noise).normal(0.0, 0.25, 105)
    # Input 7 is a joint's angle, 0 in the exact initial pose; the control cost shows the action.
    assert trace[1, 5] == pytest.approx(-0.01 * draws[7] ** 2, rel=1e-9)


def test_a_trace_adds_up_to_the_outcome_and_starts_where_the_world_does() -> None:
    jobs = jobs_of(ant_brains(3), episodes=1)
    with Runner(TASK, Noise(), Executor("serial"), training=False) as runner:
        for job, outcome in zip(jobs, runner.run(jobs), strict=True):
            trace = runner.trace(job).steps
            assert trace.shape == (outcome.steps + 1, 7)
            assert not trace[0, 3:].any()
            assert trace[:, 3].sum() == pytest.approx(outcome.fitness)
            assert trace[:, 3:].sum() == pytest.approx(outcome.full_reward)
            assert (trace[-1, 0] - trace[0, 0]) / 0.05 == pytest.approx(outcome.fitness)


def with_weights(brain: Brain | RandomActions, weight: float) -> Brain:
    """The brain with every weight replaced, and identity instead of tanh."""
    assert isinstance(brain, Brain)
    return brain._replace(
        edge_weight=np.full_like(brain.edge_weight, weight), activation=np.full_like(brain.activation, 3)
    )


@pytest.mark.parametrize("weight", [math.nan, math.inf, 1e200])
def test_an_exploding_brain_gets_the_failure_floor_and_leaves_the_others_alone(weight: float) -> None:
    brains = ant_brains(3)
    good = jobs_of(brains, episodes=1)
    bad = [Job(with_weights(job.brain, weight), job.seeds) for job in good]
    with Runner(TASK, Noise(), Executor("threads", 2), training=True) as runner:
        expected = runner.run(good)
        mixed = runner.run([job for pair in zip(bad, good, strict=True) for job in pair])
    assert mixed[1::2] == expected
    for outcome in mixed[::2]:
        assert outcome.failed
        assert (outcome.fitness, outcome.full_reward) == (-100.0, -100.0)


@pytest.mark.parametrize(
    "brain",
    [
        motionless(3, np.zeros(8)),
        motionless(105, np.zeros(2)),
        motionless(200, np.zeros(8)),
        RandomActions(np.zeros(3), np.ones(3)),
    ],
)
def test_a_brain_of_another_task_is_refused_before_it_can_touch_memory(brain: Brain | RandomActions) -> None:
    with Runner(TASK, Noise(), Executor("serial"), training=False) as runner:
        for use in (lambda job: runner.run([job]), runner.trace):
            with pytest.raises(ValueError, match=r"expected sizes \(105, 8\)"):
                use(Job(brain, shared_episodes("test", 1)[0]))


def test_random_actions_repeat_with_their_seed_and_stay_in_bounds() -> None:
    low, high = TASK.action_bounds
    seeds = shared_episodes("test", 1)[0]

    def act(seed: int) -> float:
        job = Job(RandomActions(low, high), seeds._replace(actions=stream(seed, "random_actions", 0)))
        with Runner(TASK, Noise(), Executor("serial"), training=False) as runner:
            (outcome,) = runner.run([job])
            assert len(runner.trace(job).steps) == outcome.steps + 1
            return outcome.full_reward

    assert act(0) == act(0)
    assert act(0) != act(1)


def test_a_genome_of_neat_walks_the_same_over_gymnasium_and_neat_pythons_network() -> None:
    task = AntTask()
    config = neat_config(EvolutionSettings(), 3, (105, 6, 8))
    plan = plan_wiring(task, "neat", Geometry(), "none", Wiring(), hidden=6)
    (team, *_) = Coevolution([config], [stream(5, "evolution", 0)], stream(5, "pairing")).ask()
    seeds = shared_episodes("test", 1)[0]
    with Runner(task, Noise(), Executor("serial"), training=False) as runner:
        outcome = runner.run([Job(assemble(plan, team.genomes, feed_forward=True), seeds)])[0]
    import gymnasium

    env = gymnasium.make("Ant-v5", disable_env_checker=True)
    env.unwrapped.np_random = generator(seeds.world)
    network = neat.nn.FeedForwardNetwork.create(team.genomes[0], config)
    observation, _ = env.reset()
    forward, steps, over = 0.0, 0, False
    while not over:
        observation, _, terminated, truncated, info = env.step(np.array(network.activate(observation)))
        forward += info["reward_forward"]
        steps += 1
        over = terminated or truncated
    env.close()
    assert steps == outcome.steps
    assert forward == pytest.approx(outcome.fitness, abs=1e-6)
