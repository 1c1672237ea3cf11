"""Array genomes in neat-python's own hands: configuration, population, reporters, checkpoints."""

from __future__ import annotations

import copy
import pickle
import random
from configparser import ConfigParser
from pathlib import Path
from typing import Any

import neat
import numpy as np
import pytest

from exneat_cli.algorithms import ArrayGenome, EvolutionSettings, to_stock
from exneat_cli.errors import ConfigError
from tests.algorithms.neat.genomes import (
    assert_equal,
    assert_sound,
    genes_of,
    initial_genomes,
    lively,
    relatives,
    seeded_config,
)

XOR = [((0.0, 0.0), 0.0), ((0.0, 1.0), 1.0), ((1.0, 0.0), 1.0), ((1.0, 1.0), 0.0)]
NUMBER = {"max_value": 30.0, "min_value": -30.0, "mutate_power": 0.5, "mutate_rate": 0.7, "replace_rate": 0.1}
SECTIONS: dict[str, dict[str, object]] = {
    "NEAT": {"fitness_criterion": "max", "fitness_threshold": 99, "pop_size": 40, "reset_on_extinction": False}
    | {"no_fitness_termination": False},
    "ArrayGenome": {
        "num_inputs": 2,
        "num_hidden": 2,
        "num_outputs": 1,
        "feed_forward": True,
        "initial_connection": "full_direct",
        "compatibility_disjoint_coefficient": 1.0,
        "compatibility_weight_coefficient": 0.5,
        "conn_add_prob": 0.3,
        "conn_delete_prob": 0.2,
        "node_add_prob": 0.2,
        "node_delete_prob": 0.1,
        "single_structural_mutation": False,
        "activation_default": "sigmoid",
        "activation_options": "sigmoid",
        "activation_mutate_rate": 0.0,
        "aggregation_default": "sum",
        "aggregation_options": "sum product",
        "aggregation_mutate_rate": 0.0,
        "enabled_default": True,
        "enabled_mutate_rate": 0.05,
        **{f"weight_{name}": value for name, value in {**NUMBER, "init_mean": 0.0, "init_stdev": 1.0}.items()},
        **{f"bias_{name}": value for name, value in {**NUMBER, "init_mean": 0.0, "init_stdev": 1.0}.items()},
        **{f"response_{name}": value for name, value in {**NUMBER, "init_mean": 1.0, "init_stdev": 0.0}.items()},
    },
    "DefaultSpeciesSet": {"compatibility_threshold": 2.0},
    "DefaultStagnation": {"species_fitness_func": "max", "max_stagnation": 20, "species_elitism": 2},
    "DefaultReproduction": {"elitism": 2, "survival_threshold": 0.2, "min_species_size": 2},
}


def read(path: Path) -> neat.Config:
    return neat.Config(ArrayGenome, neat.DefaultReproduction, neat.DefaultSpeciesSet, neat.DefaultStagnation, str(path))


def config_with(path: Path, **items: object) -> neat.Config:
    """neat-python's configuration, read from an INI file, with these items of the genome changed."""
    parser = ConfigParser()
    parser.read_dict({**SECTIONS, "ArrayGenome": {**SECTIONS["ArrayGenome"], **items}})
    with path.open("w", encoding="utf-8") as file:
        parser.write(file)
    return read(path)


@pytest.fixture
def ini(tmp_path: Path) -> Path:
    return tmp_path / "neat.ini"


def evaluate(genomes: list[tuple[int, ArrayGenome]], config: neat.Config) -> None:
    for _, genome in genomes:
        network = neat.nn.FeedForwardNetwork.create(to_stock(genome), config)
        genome.fitness = float(4.0 - sum((network.activate(inputs)[0] - target) ** 2 for inputs, target in XOR))


def run(ini: Path, seed: int, generations: int = 10) -> tuple[neat.Population, list[object]]:
    """A plain run of neat-python; the last generation as data."""
    random.seed(seed)
    population = neat.Population(config_with(ini))
    population.run(evaluate, generations)
    return population, [genes_of(genome) for genome in population.population.values()]


def test_neat_pythons_population_gets_better_with_array_genomes(ini: Path) -> None:
    gains = []
    for seed in range(4):
        first, last = (run(ini, seed, generations)[0] for generations in (1, 20))
        gains.append(last.best_genome.fitness - first.best_genome.fitness)
        assert len(last.population) == 40
        for genome in last.population.values():
            assert isinstance(genome, ArrayGenome)
            assert_sound(genome)
    assert sum(gains) > 0.8


def test_one_seed_of_pythons_random_state_repeats_a_run_and_another_does_not(ini: Path) -> None:
    assert run(ini, 1)[1] == run(ini, 1)[1]
    assert run(ini, 1)[1] != run(ini, 2)[1]


def test_neat_pythons_reporters_report_on_array_genomes(
    ini: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(ini.parent)
    random.seed(1)
    population, statistics = neat.Population(config_with(ini)), neat.StatisticsReporter()
    population.add_reporter(neat.StdOutReporter(True))
    population.add_reporter(statistics)
    winner = population.run(evaluate, 5)
    assert_equal(statistics.best_genome(), winner)
    assert statistics.best_genome() is not winner
    assert statistics.best_unique_genomes(3)[0].key == winner.key
    assert f"size: {winner.size()!r}" in capsys.readouterr().out
    statistics.save()
    assert len(Path("fitness_history.csv").read_text().split()) == 10


def test_a_run_resumed_from_neat_pythons_checkpoint_repeats_itself_and_stays_sound(
    ini: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ini.parent)
    random.seed(1)
    population = neat.Population(config_with(ini))
    population.add_reporter(neat.Checkpointer(4, filename_prefix="at-"))
    population.run(evaluate, 4)
    ends = []
    for _ in range(2):
        resumed = neat.Checkpointer.restore_checkpoint("at-4")
        resumed.run(evaluate, 4)
        ends.append([genes_of(genome) for genome in resumed.population.values()])
        for genome in resumed.population.values():
            assert_sound(genome)
    assert ends[0] == ends[1]


def test_a_configuration_that_is_saved_reads_back_the_same(ini: Path) -> None:
    config = config_with(ini)
    saved = ini.with_name("saved.ini")
    config.save(saved)
    back = read(saved).genome_config
    for name in (parameter.name for parameter in config.genome_config._params):
        assert getattr(back, name) == getattr(config.genome_config, name)


@pytest.mark.parametrize(
    ("item", "value"),
    [
        ("initial_connection", "partial 0.5"),
        ("initial_connection", "full"),
        ("single_structural_mutation", True),
        ("structural_mutation_surer", "true"),
        ("aggregation_default", "product"),
        ("aggregation_default", "random"),
        ("aggregation_mutate_rate", 0.1),
        ("activation_mutate_rate", 0.1),
        ("activation_default", "random"),
        ("enabled_default", "random"),
        ("enabled_default", False),
        ("weight_init_type", "uniform"),
        ("bias_init_type", "uniform"),
        ("response_init_type", "uniform"),
        ("time_constant_init_mean", 2.0),
        ("time_constant_init_stdev", 0.5),
        ("time_constant_mutate_rate", 0.5),
        ("time_constant_replace_rate", 0.5),
    ],
)
def test_what_array_genomes_cannot_do_is_refused_by_its_item(ini: Path, item: str, value: object) -> None:
    with pytest.raises(ConfigError, match=rf"\[ArrayGenome\] {item}: expected "):
        config_with(ini, **{item: value})


def test_an_activation_that_array_genomes_lack_is_refused_by_its_item(ini: Path) -> None:
    with pytest.raises(ConfigError, match=r"activation_default: expected tanh or relu or .*, got 'gauss'"):
        config_with(ini, activation_default="gauss", activation_options="gauss sigmoid")


def test_a_missing_item_is_neat_pythons_to_report(ini: Path) -> None:
    config_with(ini)
    ini.write_text(ini.read_text().replace("num_inputs = 2\n", ""))
    with pytest.raises(RuntimeError, match="num_inputs"):
        read(ini)


@pytest.mark.parametrize("twin", [lambda genome: pickle.loads(pickle.dumps(genome)), copy.deepcopy])
def test_genomes_survive_pickle_and_deep_copy(ant_settings: EvolutionSettings, twin: Any) -> None:
    for genome in relatives(seeded_config(lively(ant_settings), (3, 2, 2), 0), 5, 50):
        other = twin(genome)
        assert_equal(other, genome)
        other.nodes["bias"] += 1.0
        assert (other.nodes["bias"] != genome.nodes["bias"]).all()


def test_the_generator_begins_with_pythons_random_state_and_is_not_drawn_anew(ant_settings: EvolutionSettings) -> None:
    def first_weights(seed: int) -> np.ndarray:
        config = seeded_config(ant_settings, (3, 2, 2), seed)
        return np.concatenate([genome.connections["weight"] for genome in initial_genomes(config, 2)])

    np.testing.assert_array_equal(first_weights(1), first_weights(1))
    assert (first_weights(1) != first_weights(2)).all()
    assert len(set(first_weights(1).tolist())) == first_weights(1).size
