"""Whole training on Ant against what a user of neat-python and Gymnasium would write, on all cores."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

from exneat_cli.algorithms import EvolutionSettings, neat_config, to_stock
from exneat_cli.algorithms.neat.subpopulation import Subpopulation
from exneat_cli.brains import assemble
from exneat_cli.rollouts import Executor
from exneat_cli.runs import RunSettings
from exneat_cli.runs.training import Training
from exneat_cli.seeding import stream, training_episodes
from tests.bench.generation_cost import WatchedRunner
from tests.bench.measurement import RATIO, Bar, Row, VerificationError
from tests.bench.neat_population import Generation, NeatTraining, evaluate_genome
from tests.bench.two_threads import usable_cores

SHORT_GENERATIONS = 4
FULL_GENERATIONS = 30
CHECKED_GENOMES = 5
TOLERANCE = 1e-6
"""Largest relative difference of the two sides' forward rewards."""
BAR = Bar(2.0, at_least=True)

SETTINGS = RunSettings(algorithm="neat")
STOCK_SETTINGS = replace(SETTINGS, evolution=EvolutionSettings(genome="stock"))


def compare_with_neat_python(*, full: bool) -> Row:
    """Environment steps per wall second of a whole training over those of neat-python's, one ratio per generation.

    Both have population 100 and the same settings; the networks that they come upon differ, so do the numbers of
    steps. A generation of ours, then one of theirs, and so on; the first of each has the making of the population.

    Args:
        full: do `FULL_GENERATIONS` instead of `SHORT_GENERATIONS`.

    Raises:
        VerificationError: the two sides' episodes differ.
    """
    cores = usable_cores()
    settings = replace(SETTINGS, generations=FULL_GENERATIONS if full else SHORT_GENERATIONS)
    with (
        NeatTraining(STOCK_SETTINGS, cores) as theirs,  # first, since its processes are forks of this one
        WatchedRunner(settings.task, settings.noise, Executor("threads", cores), training=True) as runner,
    ):
        theirs.warm_up()
        small = Training.start(replace(settings, population=10))
        for _ in range(2):
            small.advance(runner)  # compiles
        _check_episodes(theirs, runner)
        ours, reference = _take_turns(settings, runner, theirs)
    ratios = [(a.steps / a.seconds) / (b.steps / b.seconds) for a, b in zip(ours, reference, strict=True)]
    name = f"whole training, exneat / neat-python's population over Gymnasium's Ant-v5, steps/s, {cores} cores"
    note = f"{len(ours)} generations; ours: {_describe(ours)}; neat-python's: {_describe(reference)}"
    return Row(name, RATIO, ratios, BAR, note)


def _take_turns(
    settings: RunSettings, runner: WatchedRunner, theirs: NeatTraining
) -> tuple[list[Generation], list[Generation]]:
    ours: list[Generation] = []
    reference: list[Generation] = []
    began = time.perf_counter()
    training = Training.start(settings)
    while not training.is_over:
        training.advance(runner)
        seconds = time.perf_counter() - began
        ours.append(Generation(int(runner.outcomes.steps.sum()), seconds, runner.seconds))
        reference.append(theirs.advance())
        began = time.perf_counter()
    return ours, reference


def _describe(generations: Sequence[Generation]) -> str:
    steps, seconds, evaluation = (sum(column) for column in zip(*generations, strict=True))
    count = len(generations)
    return (
        f"{steps / seconds:,.0f} steps/s, per generation {steps / count:,.0f} steps, "
        f"{(seconds - evaluation) / count:.3f} s of evolution and {evaluation / count:.3f} s of episodes"
    )


def _check_episodes(theirs: NeatTraining, runner: WatchedRunner) -> None:
    """Compare forward reward and steps of some untrained genomes in a training episode that ends early."""
    (shape,) = SETTINGS.plan.subpopulation_shapes
    config = neat_config(SETTINGS.evolution, SETTINGS.population, shape)
    population = Subpopulation(config, stream(SETTINGS.seed, "evolution", 0))
    genomes = list(population.genomes.values())[:CHECKED_GENOMES]
    brains = assemble(SETTINGS.plan, [[genome] for genome in genomes], feed_forward=True)
    outcomes = runner.run(brains, training_episodes(SETTINGS.seed, 0, 1))
    for genome, fitness, steps in zip(genomes, outcomes.fitness[:, 0], outcomes.steps[:, 0], strict=True):
        expected = evaluate_genome(to_stock(genome), theirs.config)
        if steps != expected.steps or not abs(fitness - expected) <= TOLERANCE * abs(expected):
            raise VerificationError(
                f"genome {genome.key}: forward reward {fitness!r} after {steps} steps; "
                f"Gymnasium gives {float(expected)!r} after {expected.steps}"
            )
