"""Settings of evolution and what neat-python makes of them."""

from __future__ import annotations

import numpy as np
import pytest

from exneat_cli.algorithms import EvolutionSettings, neat_config
from exneat_cli.algorithms.neat.subpopulation import Subpopulation
from exneat_cli.errors import ConfigError
from exneat_cli.seeding import stream


def test_every_setting_reaches_neat_python(ant_settings: EvolutionSettings) -> None:
    config = neat_config(ant_settings, 50, (105, 6, 8))
    genome = config.genome_config
    assert (config.pop_size, genome.num_inputs, genome.num_hidden, genome.num_outputs) == (50, 105, 6, 8)
    assert genome.feed_forward is True
    assert genome.initial_connection == "full_nodirect"
    assert (genome.weight_init_stdev, genome.weight_mutate_power) == (0.12, 0.08)
    assert (genome.weight_mutate_rate, genome.weight_replace_rate) == (0.8, 0.1)
    assert (genome.bias_init_stdev, genome.bias_mutate_power) == (0.4, 0.2)
    assert (genome.bias_mutate_rate, genome.bias_replace_rate) == (0.7, 0.1)
    assert (genome.weight_min_value, genome.weight_max_value) == (-12.0, 12.0)
    assert (genome.conn_add_prob, genome.conn_delete_prob) == (0.2, 0.1)
    assert (genome.node_add_prob, genome.node_delete_prob) == (0.1, 0.1)
    assert genome.enabled_mutate_rate == 0.01
    assert (genome.compatibility_disjoint_coefficient, genome.compatibility_weight_coefficient) == (1.0, 1.25)
    assert config.species_set_config.compatibility_threshold == 3.0
    reproduction, stagnation = config.reproduction_config, config.stagnation_config
    assert (reproduction.elitism, reproduction.survival_threshold, reproduction.min_species_size) == (2, 0.2, 2)
    assert (stagnation.species_fitness_func, stagnation.max_stagnation, stagnation.species_elitism) == ("max", 20, 2)


def test_two_configurations_share_nothing_that_evolution_changes(ant_settings: EvolutionSettings) -> None:
    one, other = (neat_config(ant_settings, 10, (3, 2, 1)) for _ in range(2))
    assert one.genome_config is not other.genome_config


def test_a_positive_start_makes_initial_weights_positive_and_lets_mutations_draw_both_signs(
    grid_settings: EvolutionSettings,
) -> None:
    subpopulation = Subpopulation(neat_config(grid_settings, 30, (8, 0, 5)), stream(0, "evolution", 0))

    def weights() -> list[float]:
        genomes = subpopulation.genomes.values()
        return [weight for genome in genomes for weight in genome.connections["weight"].tolist()]

    assert min(weights()) >= 0.0
    assert 0.7 < float(np.mean(weights())) < 0.9
    for _ in range(3):
        subpopulation.advance(dict.fromkeys(subpopulation.genomes, 0.0))
    assert min(weights()) < 0.0


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("survival_threshold", 1.5),
        ("weight_mutate_rate", -0.1),
        ("elitism", -1),
        ("min_species_size", 0),
        ("activation_default", "gauss"),
    ],
)
def test_values_out_of_range_are_refused_by_their_key(key: str, value: object) -> None:
    with pytest.raises(ConfigError, match=f"evolution.{key}"):
        EvolutionSettings(**{key: value})  # type: ignore[arg-type]
