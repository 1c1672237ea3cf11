"""Array genomes against neat-python's own, both in neat-python's reproduction and speciation."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from itertools import pairwise

import neat
import numpy as np

from exneat_cli.algorithms import EvolutionSettings, from_stock, neat_config, to_stock
from exneat_cli.algorithms.neat.subpopulation import Subpopulation
from exneat_cli.seeding import stream
from tests.bench.measurement import RATIO, Bar, Pair, Row, VerificationError, seconds_of, speed_ratios

INITIAL_CONNECTIONS = ("full_nodirect", "full_direct")
POPULATION = 100
SHAPE = (105, 6, 8)
"""Inputs, initial hidden nodes and outputs of NEAT's network on Ant."""
ROOT_SEED = 0
WARM_UP = 3
"""Generations that are not counted: structure comes apart, and what is compiled gets compiled."""
GENERATIONS = 5
"""That are, each a ratio of its own."""
TOLERANCE = 1e-12
"""Largest relative difference of the two sides' distances between the same genomes."""
BAR = Bar(40.0, at_least=True)


class Evolving:
    """A subpopulation whose fitness is standard normal noise, so that no side learns another structure.

    Args:
        settings: say which genomes it has; the rest is Ant's.
    """

    def __init__(self, settings: EvolutionSettings) -> None:
        self._rng = np.random.default_rng(ROOT_SEED)
        self.subpopulation = Subpopulation(neat_config(settings, POPULATION, SHAPE), stream(ROOT_SEED, "evolution", 0))

    def advance(self) -> float:
        """Wall seconds of reproduction and speciation, once."""
        genomes = self.subpopulation.genomes
        fitness = dict(zip(genomes, self._rng.standard_normal(len(genomes)).tolist(), strict=True))
        return seconds_of(partial(self.subpopulation.advance, fitness))

    def describe(self) -> str:
        """Size and species of the current generation, in words."""
        genes = np.mean([len(genome.connections) for genome in self.subpopulation.genomes.values()])
        species = self.subpopulation.species_count
        return f"{genes:,.0f} connections per genome in {species} species"


def compare_with_stock(initial_connection: str) -> Row:
    """Generations per second of array genomes over those of neat-python's own, one ratio per generation.

    Args:
        initial_connection: neat-python's name for the connections of the first generation.

    Raises:
        VerificationError: a side lost genomes, or the two measure distances differently.
    """
    settings = replace(EvolutionSettings(), initial_connection=initial_connection)
    array, stock = (Evolving(replace(settings, genome=genome)) for genome in ("array", "stock"))
    pair = Pair(array.advance, stock.advance)
    speed_ratios([pair], WARM_UP)
    ratios = speed_ratios([pair], GENERATIONS)
    _check(array.subpopulation, stock.subpopulation)
    name = f"reproduce + speciate, array genomes / neat-python's, NEAT {'-'.join(map(str, SHAPE))} {initial_connection}"
    note = f"at the end: array {array.describe()}, neat-python's {stock.describe()}"
    return Row(f"{name}, population {POPULATION}, generations/s", RATIO, ratios, BAR, note)


def _check(array: Subpopulation, stock: Subpopulation) -> None:
    for side in (array, stock):
        if len(side.genomes) != POPULATION:
            raise VerificationError(f"expected {POPULATION} genomes, got {len(side.genomes)}")
    config: neat.DefaultGenomeConfig = stock.config.genome_config
    sides = [(genome, to_stock(genome)) for genome in array.genomes.values()]
    sides += [(from_stock(genome), genome) for genome in stock.genomes.values()]
    for (one, stock_one), (other, stock_other) in pairwise(sides):
        ours, expected = one.distance(other, config), stock_one.distance(stock_other, config)
        if not abs(ours - expected) <= TOLERANCE * expected:
            raise VerificationError(f"distance of two genomes: {ours!r}; neat-python gives {expected!r}")
