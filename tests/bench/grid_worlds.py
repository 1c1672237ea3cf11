"""Grid worlds against the loop that a user of neat-python and NumPy would write, and whole trainings."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import neat
import numpy as np
import yaml

from exneat_cli.algorithms import RECURRENT, ArrayGenome, neat_config, to_stock
from exneat_cli.algorithms.neat.subpopulation import Subpopulation
from exneat_cli.brains import assemble
from exneat_cli.commands.shipped import shipped_directory
from exneat_cli.rollouts import Executor, Noise, Outcomes, Runner
from exneat_cli.runs import RunSettings, train
from exneat_cli.seeding import EpisodeSeeds, stream, training_episodes
from exneat_cli.tasks import TASKS, GeneralMaze, Hunting, Task
from exneat_cli.wiring import Plan, plan_body
from tests.bench.measurement import RATIO, SECONDS, Bar, Pace, Row, VerificationError, pace_ratios, seconds_of
from tests.bench.plain_python_worlds import PlainHunting, PlainMaze, PlainOutcome, PlainWorld, run_episode

GENOMES = 200
EPISODES = 20
"""Per genome, both as in a generation of the paper budget."""
EVERY = 10
"""One genome in so many is enough for the reference's pace."""
BLOCK = 10
"""Genomes that the reference runs before it is our turn again, with all of them."""
CHECK_EPISODES = 100
"""Per genome, before anything is timed."""
FOLLOWERS = 5
"""Copies of a genome that follows the cues: untrained ones tell little of the signals."""
ROOT_SEED = 0
STANDARD_ERRORS = 5.0
"""Largest difference of the two sides' means; they draw different worlds."""
ROUNDING = 1e-9
"""Allowed on top, where all episodes agree."""

SPEED_BAR = Bar(150.0, at_least=True)
SPEED_AIM = "the aim is 300"
PAPER_BAR = Bar(3.0, at_least=False)
PAPER_TASKS = ("track_maze", "general_maze", "foraging", "hunting")
PAPER_ALGORITHMS = ("exneat", "neat")


class Contest(NamedTuple):
    """Both sides of a comparison.

    Attributes:
        task, runner, plan: ours.
        config: neat-python's configuration of the genomes.
        world: the reference's.
        rng: that all its episodes draw from.
    """

    task: Task
    runner: Runner
    plan: Plan
    config: neat.Config
    world: PlainWorld
    rng: np.random.Generator

    def run_ours(self, genomes: Sequence[ArrayGenome], seeds: Sequence[EpisodeSeeds]) -> Outcomes:
        """Outcomes of all genomes in the same episodes, as in training; networks and worlds are made here."""
        brains = assemble(self.plan, [[genome] for genome in genomes], feed_forward=False)
        return self.runner.run(brains, seeds)

    def run_reference(self, genomes: Sequence[neat.DefaultGenome], episodes: int) -> list[PlainOutcome]:
        """The same with neat-python's networks in plain Python worlds, a new one for each episode."""
        networks = [neat.nn.RecurrentNetwork.create(genome, self.config) for genome in genomes]
        return [run_episode(self.world, network, self.rng) for network in networks for _ in range(episodes)]


def compare_general_maze(repetitions: int) -> Row:
    """Agent steps per second of ours, on one thread, over those of plain Python in the general maze.

    Raises:
        VerificationError: the two sides are not the same world.
    """
    task = GeneralMaze()
    return _compare(task, PlainMaze(task.size), repetitions)


def compare_hunting(repetitions: int) -> Row:
    """The same in hunting.

    Raises:
        VerificationError: the two sides are not the same world.
    """
    task = Hunting()
    parameters = {name: getattr(task, name) for name in ("size", "n_prey", "steps", "p_e", "p_c", "p_m")}
    return _compare(task, PlainHunting(**parameters), repetitions)


def _compare(task: Task, world: PlainWorld, repetitions: int) -> Row:
    plan = plan_body(task, hidden=RECURRENT.neat_hidden)
    (shape,) = plan.subpopulation_shapes
    config = neat_config(RECURRENT, GENOMES, shape)
    genomes = list(Subpopulation(config, stream(ROOT_SEED, "evolution", 0)).genomes.values())
    rng = np.random.default_rng(ROOT_SEED)
    with Runner(task, Noise(), Executor("threads", 1), training=True) as runner:
        contest = Contest(task, runner, plan, config, world, rng)
        some = genomes[::EVERY]
        _check_same_world(contest, some)
        _check_same_world(contest, [_follower(genomes[0], task)] * FOLLOWERS)
        seeds = training_episodes(ROOT_SEED, 0, EPISODES)
        contest.run_ours(genomes, seeds)  # compiles what only many brains at once need
        ours = partial(_our_pace, contest, genomes, seeds)
        stock = [to_stock(genome) for genome in some]
        blocks = [stock[first : first + BLOCK] for first in range(0, len(stock), BLOCK)]
        paces = pace_ratios([(ours, partial(_reference_pace, contest, block)) for block in blocks], repetitions)
    note = f"{SPEED_AIM}; last repetition: {paces.ours.rate:,.0f} against {paces.reference.rate:,.0f} steps/s"
    network = f"NEAT {'-'.join(map(str, shape))}"
    name = f"exneat, {GENOMES} genomes at once / plain Python and NumPy, {task.name}, {network}, steps/s, 1 thread"
    return Row(name, RATIO, paces.ratios, SPEED_BAR, note)


def _our_pace(contest: Contest, genomes: Sequence[ArrayGenome], seeds: Sequence[EpisodeSeeds]) -> Pace:
    return _pace_of(lambda: int(contest.run_ours(genomes, seeds).steps.sum()))


def _reference_pace(contest: Contest, genomes: Sequence[neat.DefaultGenome]) -> Pace:
    return _pace_of(lambda: sum(outcome.steps for outcome in contest.run_reference(genomes, EPISODES)))


def _pace_of(run: Callable[[], int]) -> Pace:
    """The pace of `run`, which returns how many steps it did."""
    steps: list[int] = []
    seconds = seconds_of(lambda: steps.append(run()))
    return Pace(sum(steps), seconds)


def _follower(genome: ArrayGenome, task: Task) -> ArrayGenome:
    """A genome like a fully connected one that moves to where the sum of both channels is largest."""
    wanted = {(-1 - sensor, part.actuators[0]) for part in task.parts for sensor in part.sensors}
    follower = ArrayGenome(genome.key)
    follower.nodes, follower.connections = genome.nodes, genome.connections.copy()
    ends = zip(follower.connections["source"].tolist(), follower.connections["target"].tolist(), strict=True)
    follower.connections["weight"] = [float(pair in wanted) for pair in ends]
    return follower


def _check_same_world(contest: Contest, genomes: Sequence[ArrayGenome]) -> None:
    """Compare both sides' mean fitness and steps, every episode in a world of its own."""
    name = contest.task.name
    seeds = [training_episodes(ROOT_SEED, 1 + k, CHECK_EPISODES) for k in range(len(genomes))]
    ours = [contest.run_ours([genome], own) for genome, own in zip(genomes, seeds, strict=True)]
    reference = contest.run_reference([to_stock(genome) for genome in genomes], CHECK_EPISODES)
    if any(outcomes.failed.any() for outcomes in ours):
        raise VerificationError(f"{name}: a network exploded, so there is nothing to compare")
    for what in ("fitness", "steps"):
        sides = [
            np.concatenate([getattr(outcomes, what) for outcomes in ours]),
            np.reshape([getattr(outcome, what) for outcome in reference], (len(genomes), CHECK_EPISODES)),
        ]
        variance = sum(side.var(axis=1, ddof=1).mean() / side.size for side in sides)
        our_mean, reference_mean = (side.mean() for side in sides)
        tolerance = STANDARD_ERRORS * np.sqrt(variance) + ROUNDING
        if not abs(our_mean - reference_mean) <= tolerance:
            raise VerificationError(
                f"{name}: mean {what} {our_mean:.4f}; plain Python gives {reference_mean:.4f}, "
                f"expected a difference of at most {tolerance:.4f}"
            )


def measure_paper_training(task: str, algorithm: str) -> Row:
    """Wall seconds of one training, validation and test with the paper budget, everything compiled before.

    Args:
        task: a key of `TASKS`.
        algorithm: ``exneat`` (geometry single) or ``neat``.
    """
    with tempfile.TemporaryDirectory() as output:
        train(_settings(task, algorithm, "smoke", output))
        settings = _settings(task, algorithm, "paper", output)
        seconds = seconds_of(partial(train, settings))
        spent = settings.directory.read_manifest().budget_spent
    name = f"whole training, paper budget, {task}, {settings.variant}, 1 thread, warm compile cache"
    note = f"{spent['episodes']:,} training episodes, {spent['env_steps']:,} steps"
    return Row(name, SECONDS, [seconds], PAPER_BAR, note)


def _settings(task: str, algorithm: str, budget: str, output: str) -> RunSettings:
    path = shipped_directory("conf") / "task" / f"{task}.yaml"
    numbers = yaml.safe_load(path.read_text(encoding="utf-8"))["budgets"][budget]
    del numbers["sweep_episodes"]
    executor = Executor("threads", 1)
    return RunSettings(task=TASKS[task](), algorithm=algorithm, executor=executor, output=output, **numbers)
