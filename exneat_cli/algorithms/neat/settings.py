"""Settings of evolution, and their translation into neat-python's configuration."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import neat

from exneat_cli.algorithms.neat.genes import ACTIVATIONS
from exneat_cli.algorithms.neat.genome import ArrayGenome
from exneat_cli.algorithms.neat.initial_connections import INITIAL_CONNECTIONS
from exneat_cli.algorithms.neat.reproduction import SteadyReproduction
from exneat_cli.algorithms.neat.stock_genome import HomologousGenome
from exneat_cli.errors import check_choice, check_flag, check_real, check_whole

GENOMES = {"array": ArrayGenome, "stock": HomologousGenome}


@dataclass(frozen=True)
class EvolutionSettings:
    """How genomes start, change and compete; the defaults are Ant's.

    Terms and their meaning are neat-python's (Stanley and Miikkulainen, "Evolving neural networks through
    augmenting topologies", 2002). Rates and shares are probabilities in [0, 1].

    Attributes:
        genome: ``array`` for compiled operators, ``stock`` for neat-python's own, which are slower and draw
            other random numbers.
        feed_forward: feed-forward networks, else recurrent ones.
        activation_default: of every node, with neat-python's scaling, e.g. tanh(2.5 x).
        initial_connection: connections of the first generation.
        neat_hidden, module_hidden: initial hidden nodes of NEAT's network, and of every ExNEAT module.
        positive_start: initial weights are abs(N(0, sd)); weights that mutations draw keep their sign.
        weight_init_stdev, bias_init_stdev: initial values are N(0, sd).
        weight_mutate_power, bias_mutate_power: a mutation adds N(0, power).
        weight_mutate_rate, bias_mutate_rate: share of values that a mutation shifts.
        weight_replace_rate, bias_replace_rate: share of values that a mutation draws anew.
        weight_max_value, bias_max_value: values stay within these, on both sides of 0.
        enabled_mutate_rate: share of connections whose enabled flag a mutation draws anew.
        conn_add_prob, conn_delete_prob, node_add_prob, node_delete_prob: chance of each structural mutation.
        compatibility_disjoint_coefficient, compatibility_weight_coefficient: of the genetic distance.
        compatibility_threshold: genomes closer than this share a species.
        elitism: best genomes of a species that survive unchanged.
        survival_threshold: share of a species that may have offspring.
        min_species_size: genomes that every species keeps.
        max_stagnation: generations without improvement after which a species dies.
        species_elitism: best species that never stagnate.

    Raises:
        ConfigError: a value is out of range.
    """

    genome: str = "array"
    feed_forward: bool = True
    activation_default: str = "tanh"
    initial_connection: str = "full_nodirect"
    neat_hidden: int = 6
    module_hidden: int = 4
    positive_start: bool = False
    weight_init_stdev: float = 0.12
    weight_mutate_power: float = 0.08
    weight_mutate_rate: float = 0.8
    weight_replace_rate: float = 0.1
    weight_max_value: float = 12.0
    bias_init_stdev: float = 0.4
    bias_mutate_power: float = 0.2
    bias_mutate_rate: float = 0.7
    bias_replace_rate: float = 0.1
    bias_max_value: float = 12.0
    enabled_mutate_rate: float = 0.01
    conn_add_prob: float = 0.2
    conn_delete_prob: float = 0.1
    node_add_prob: float = 0.1
    node_delete_prob: float = 0.1
    compatibility_disjoint_coefficient: float = 1.0
    compatibility_weight_coefficient: float = 1.25
    compatibility_threshold: float = 3.0
    elitism: int = 2
    survival_threshold: float = 0.2
    min_species_size: int = 2
    max_stagnation: int = 20
    species_elitism: int = 2

    def __post_init__(self) -> None:
        check_choice("evolution.genome", self.genome, tuple(GENOMES))
        check_flag("evolution.feed_forward", self.feed_forward)
        check_flag("evolution.positive_start", self.positive_start)
        check_choice("evolution.activation_default", self.activation_default, ACTIVATIONS)
        check_choice("evolution.initial_connection", self.initial_connection, INITIAL_CONNECTIONS)
        for name in ("neat_hidden", "module_hidden", "elitism", "species_elitism"):
            check_whole(f"evolution.{name}", getattr(self, name), 0, 10_000)
        for name in ("min_species_size", "max_stagnation"):
            check_whole(f"evolution.{name}", getattr(self, name), 1)
        for name in (
            "weight_init_stdev",
            "weight_mutate_power",
            "bias_init_stdev",
            "bias_mutate_power",
            "weight_max_value",
            "bias_max_value",
            "compatibility_threshold",
        ):
            check_real(f"evolution.{name}", getattr(self, name), 0.0)
        for name in ("compatibility_disjoint_coefficient", "compatibility_weight_coefficient"):
            check_real(f"evolution.{name}", getattr(self, name), 0.0)
        for name in (
            "weight_mutate_rate",
            "weight_replace_rate",
            "bias_mutate_rate",
            "bias_replace_rate",
            "enabled_mutate_rate",
            "survival_threshold",
        ):
            check_real(f"evolution.{name}", getattr(self, name), 0.0, 1.0)
        for name in ("conn_add_prob", "conn_delete_prob", "node_add_prob", "node_delete_prob"):
            check_real(f"evolution.{name}", getattr(self, name), 0.0, 1.0)


RECURRENT = EvolutionSettings(
    feed_forward=False,
    activation_default="relu",
    initial_connection="full_direct",
    neat_hidden=0,
    module_hidden=0,
    positive_start=True,
    weight_init_stdev=1.0,
    weight_mutate_power=0.5,
    weight_max_value=30.0,
    bias_init_stdev=0.0,
    bias_mutate_power=0.0,
    bias_mutate_rate=0.0,
    bias_replace_rate=0.0,
    bias_max_value=30.0,
    conn_add_prob=0.25,
    conn_delete_prob=0.25,
    node_add_prob=0.25,
    node_delete_prob=0.25,
    compatibility_disjoint_coefficient=1.1,
    compatibility_weight_coefficient=1.1,
    elitism=10,
    survival_threshold=0.4,
    min_species_size=20,
    species_elitism=1,
)
"""For the grid worlds: recurrent networks without biases, which keep their signals positive at first."""


def neat_config(
    settings: EvolutionSettings,
    population: int,
    shape: tuple[int, int, int],
    genome_type: type[Any] | None = None,
) -> neat.Config:
    """A neat-python configuration of its own for one subpopulation.

    Args:
        settings: see there.
        population: genomes per generation.
        shape: numbers of inputs, initial hidden nodes and outputs.
        genome_type: the genome's class, if not what the settings say.
    """
    config = neat.Config.__new__(neat.Config)  # its constructor takes nothing but a file
    config.genome_type = genome_type or GENOMES[settings.genome]
    config.species_set_type, config.stagnation_type = neat.DefaultSpeciesSet, neat.DefaultStagnation
    config.reproduction_type = SteadyReproduction
    config.config_information = config.seed = None
    config.pop_size, config.reset_on_extinction = population, True
    config.fitness_criterion, config.fitness_threshold, config.no_fitness_termination = "max", 0.0, True
    config.genome_config = config.genome_type.parse_config(_as_text(_genome_items(settings, shape)))
    config.genome_config.positive_start = settings.positive_start
    species = {"compatibility_threshold": settings.compatibility_threshold}
    config.species_set_config = config.species_set_type.parse_config(_as_text(species))
    stagnation = {
        "species_fitness_func": "max",
        "max_stagnation": settings.max_stagnation,
        "species_elitism": settings.species_elitism,
    }
    config.stagnation_config = config.stagnation_type.parse_config(_as_text(stagnation))
    reproduction = {
        "elitism": settings.elitism,
        "survival_threshold": settings.survival_threshold,
        "min_species_size": settings.min_species_size,
    }
    config.reproduction_config = config.reproduction_type.parse_config(_as_text(reproduction))
    return config


def _as_text(items: Mapping[str, object]) -> dict[str, str]:
    """The items as an INI file holds them, which is what neat-python parses."""
    return {name: str(value) for name, value in items.items()}


def _genome_items(settings: EvolutionSettings, shape: tuple[int, int, int]) -> dict[str, object]:
    return {
        **dict(zip(("num_inputs", "num_hidden", "num_outputs"), shape, strict=True)),
        **_number("weight", 0.0, settings.weight_init_stdev, settings.weight_max_value),
        **_change("weight", settings.weight_mutate_rate, settings.weight_replace_rate, settings.weight_mutate_power),
        **_number("bias", 0.0, settings.bias_init_stdev, settings.bias_max_value),
        **_change("bias", settings.bias_mutate_rate, settings.bias_replace_rate, settings.bias_mutate_power),
        **_number("response", 1.0, 0.0, 1.0),
        **_change("response", 0.0, 0.0, 0.0),
        "feed_forward": settings.feed_forward,
        "initial_connection": settings.initial_connection,
        # neat-python 2.0 takes its default, the string "false", for true.
        "single_structural_mutation": False,
        "compatibility_disjoint_coefficient": settings.compatibility_disjoint_coefficient,
        "compatibility_weight_coefficient": settings.compatibility_weight_coefficient,
        "conn_add_prob": settings.conn_add_prob,
        "conn_delete_prob": settings.conn_delete_prob,
        "node_add_prob": settings.node_add_prob,
        "node_delete_prob": settings.node_delete_prob,
        "activation_default": settings.activation_default,
        "activation_options": settings.activation_default,
        "activation_mutate_rate": 0.0,
        "aggregation_default": "sum",
        "aggregation_options": "sum",
        "aggregation_mutate_rate": 0.0,
        "enabled_default": True,
        "enabled_mutate_rate": settings.enabled_mutate_rate,
    }


def _number(name: str, mean: float, sd: float, bound: float) -> dict[str, object]:
    return {
        f"{name}_init_mean": mean,
        f"{name}_init_stdev": sd,
        f"{name}_max_value": bound,
        f"{name}_min_value": -bound,
    }


def _change(name: str, rate: float, replace: float, power: float) -> dict[str, object]:
    return {f"{name}_mutate_rate": rate, f"{name}_replace_rate": replace, f"{name}_mutate_power": power}
