"""Settings of evolution, and their translation into neat-python's configuration."""

from __future__ import annotations

from configparser import ConfigParser
from dataclasses import dataclass
from typing import Any

import neat

from exneat_cli.errors import ExneatError, check_choice, check_flag, check_real, check_whole
from exneat_cli.evolution.array_genome import ArrayGenome
from exneat_cli.evolution.genes import ACTIVATIONS
from exneat_cli.evolution.initial_connections import INITIAL_CONNECTIONS
from exneat_cli.evolution.reproduction import SteadyReproduction
from exneat_cli.evolution.stock_genome import HomologousGenome
from exneat_cli.interruption import scratch_directory

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
        activation: of every node, with neat-python's scaling, e.g. tanh(2.5 x).
        initial_connection: connections of the first generation.
        neat_hidden, module_hidden: initial hidden nodes of NEAT's network, and of every ExNEAT module.
        positive_start: initial weights are abs(N(0, sd)); weights that mutations draw keep their sign.
        weight_sd, bias_sd: initial values are N(0, sd).
        weight_power, bias_power: a mutation adds N(0, power).
        weight_rate, bias_rate: share of values that a mutation shifts.
        weight_replace, bias_replace: share of values that a mutation draws anew.
        bound: weights and biases stay in [-bound, bound].
        enable_rate: share of connections whose enabled flag a mutation draws anew.
        connection_add, connection_delete, node_add, node_delete: chance of each structural mutation.
        disjoint_coefficient, weight_coefficient: of the genetic distance.
        distance_threshold: genomes closer than this share a species.
        elitism: best genomes of a species that survive unchanged.
        survival: share of a species that may have offspring.
        min_species_size: genomes that every species keeps.
        max_stagnation: generations without improvement after which a species dies.
        species_elitism: best species that never stagnate.

    Raises:
        ConfigError: a value is out of range.
    """

    genome: str = "array"
    feed_forward: bool = True
    activation: str = "tanh"
    initial_connection: str = "full_nodirect"
    neat_hidden: int = 6
    module_hidden: int = 4
    positive_start: bool = False
    weight_sd: float = 0.12
    weight_power: float = 0.08
    weight_rate: float = 0.8
    weight_replace: float = 0.1
    bias_sd: float = 0.4
    bias_power: float = 0.2
    bias_rate: float = 0.7
    bias_replace: float = 0.1
    bound: float = 12.0
    enable_rate: float = 0.01
    connection_add: float = 0.2
    connection_delete: float = 0.1
    node_add: float = 0.1
    node_delete: float = 0.1
    disjoint_coefficient: float = 1.0
    weight_coefficient: float = 1.25
    distance_threshold: float = 3.0
    elitism: int = 2
    survival: float = 0.2
    min_species_size: int = 2
    max_stagnation: int = 20
    species_elitism: int = 2

    def __post_init__(self) -> None:
        check_choice("evolution.genome", self.genome, tuple(GENOMES))
        check_flag("evolution.feed_forward", self.feed_forward)
        check_flag("evolution.positive_start", self.positive_start)
        check_choice("evolution.activation", self.activation, ACTIVATIONS)
        check_choice("evolution.initial_connection", self.initial_connection, INITIAL_CONNECTIONS)
        for name in ("neat_hidden", "module_hidden", "elitism", "species_elitism"):
            check_whole(f"evolution.{name}", getattr(self, name), 0, 10_000)
        for name in ("min_species_size", "max_stagnation"):
            check_whole(f"evolution.{name}", getattr(self, name), 1)
        for name in ("weight_sd", "weight_power", "bias_sd", "bias_power", "bound", "distance_threshold"):
            check_real(f"evolution.{name}", getattr(self, name), 0.0)
        for name in ("disjoint_coefficient", "weight_coefficient"):
            check_real(f"evolution.{name}", getattr(self, name), 0.0)
        for name in ("weight_rate", "weight_replace", "bias_rate", "bias_replace", "enable_rate", "survival"):
            check_real(f"evolution.{name}", getattr(self, name), 0.0, 1.0)
        for name in ("connection_add", "connection_delete", "node_add", "node_delete"):
            check_real(f"evolution.{name}", getattr(self, name), 0.0, 1.0)


RECURRENT = EvolutionSettings(
    feed_forward=False,
    activation="relu",
    initial_connection="full_direct",
    neat_hidden=0,
    module_hidden=0,
    positive_start=True,
    weight_sd=1.0,
    weight_power=0.5,
    bias_sd=0.0,
    bias_power=0.0,
    bias_rate=0.0,
    bias_replace=0.0,
    bound=30.0,
    connection_add=0.25,
    connection_delete=0.25,
    node_add=0.25,
    node_delete=0.25,
    disjoint_coefficient=1.1,
    weight_coefficient=1.1,
    elitism=10,
    survival=0.4,
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

    Raises:
        ExneatError: neat-python reads its configuration from a file only, and none could be written.
    """
    genome_type = genome_type or GENOMES[settings.genome]
    inputs, hidden, outputs = shape
    sections: dict[str, dict[str, object]] = {
        "NEAT": {
            "fitness_criterion": "max",
            "fitness_threshold": 0,
            "no_fitness_termination": True,
            "pop_size": population,
            "reset_on_extinction": True,
        },
        genome_type.__name__: {
            "num_inputs": inputs,
            "num_hidden": hidden,
            "num_outputs": outputs,
            **_structure(settings),
            **_number("weight", 0.0, settings.weight_sd, settings.bound),
            **_change("weight", settings.weight_rate, settings.weight_replace, settings.weight_power),
            **_number("bias", 0.0, settings.bias_sd, settings.bound),
            **_change("bias", settings.bias_rate, settings.bias_replace, settings.bias_power),
            **_number("response", 1.0, 0.0, 1.0),
            **_change("response", 0.0, 0.0, 0.0),
        },
        "DefaultSpeciesSet": {"compatibility_threshold": settings.distance_threshold},
        "DefaultStagnation": {
            "species_fitness_func": "max",
            "max_stagnation": settings.max_stagnation,
            "species_elitism": settings.species_elitism,
        },
        SteadyReproduction.__name__: {
            "elitism": settings.elitism,
            "survival_threshold": settings.survival,
            "min_species_size": settings.min_species_size,
        },
    }
    config = _read_config(sections, genome_type)
    config.genome_config.positive_start = settings.positive_start
    return config


def _structure(settings: EvolutionSettings) -> dict[str, object]:
    return {
        "feed_forward": settings.feed_forward,
        "initial_connection": settings.initial_connection,
        # neat-python 2.0 takes its default, the string "false", for true.
        "single_structural_mutation": False,
        "compatibility_disjoint_coefficient": settings.disjoint_coefficient,
        "compatibility_weight_coefficient": settings.weight_coefficient,
        "conn_add_prob": settings.connection_add,
        "conn_delete_prob": settings.connection_delete,
        "node_add_prob": settings.node_add,
        "node_delete_prob": settings.node_delete,
        "activation_default": settings.activation,
        "activation_options": settings.activation,
        "activation_mutate_rate": 0.0,
        "aggregation_default": "sum",
        "aggregation_options": "sum",
        "aggregation_mutate_rate": 0.0,
        "enabled_default": True,
        "enabled_mutate_rate": settings.enable_rate,
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


def _read_config(sections: dict[str, dict[str, object]], genome_type: type[Any]) -> neat.Config:
    parser = ConfigParser()
    parser.read_dict(sections)
    try:
        with scratch_directory() as directory:
            path = directory / "neat.ini"
            with path.open("w", encoding="utf-8") as file:
                parser.write(file)
            kinds = (SteadyReproduction, neat.DefaultSpeciesSet, neat.DefaultStagnation)
            return neat.Config(genome_type, *kinds, str(path))
    except OSError as error:
        why = f"a temporary file of neat-python's configuration could not be written: {error.strerror}"
        raise ExneatError(f"{why}\n  check the disk, or set TMPDIR to a directory with room") from error
