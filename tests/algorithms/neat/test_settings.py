"""Settings of evolution: their mirror in conf/, and what is refused."""

from __future__ import annotations

import dataclasses

import pytest
import yaml

from exneat_cli.algorithms import RECURRENT, EvolutionSettings
from exneat_cli.commands.shipped import shipped_directory
from exneat_cli.errors import ConfigError


@pytest.mark.parametrize(("name", "settings"), [("feed_forward", EvolutionSettings()), ("recurrent", RECURRENT)])
def test_a_file_in_conf_spells_every_setting_as_the_dataclass_has_it(name: str, settings: EvolutionSettings) -> None:
    path = shipped_directory("conf") / "evolution" / f"{name}.yaml"
    assert yaml.safe_load(path.read_text(encoding="utf-8")) == dataclasses.asdict(settings)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("genome", "binary"),
        ("feed_forward", 1),
        ("activation_default", "gauss"),
        ("initial_connection", "full"),
        ("neat_hidden", 10_001),
        ("elitism", -1),
        ("elitism", True),
        ("min_species_size", 0),
        ("max_stagnation", 1.5),
        ("weight_init_stdev", -0.1),
        ("weight_max_value", float("inf")),
        ("compatibility_threshold", "3"),
        ("survival_threshold", 1.5),
        ("mutation", "sparse"),
        ("crossover_prob", 1.5),
        ("parent_selection", "best"),
        ("output_activation", "swish"),
        ("weight_mutate_rate", -0.1),
        ("node_add_prob", 1.01),
    ],
)
def test_values_out_of_range_are_refused_by_their_key(key: str, value: object) -> None:
    with pytest.raises(ConfigError, match=f"evolution.{key}: expected"):
        EvolutionSettings(**{key: value})  # type: ignore[arg-type]


def test_minimum_sizes_and_widths_have_no_upper_bound() -> None:
    settings = EvolutionSettings(min_species_size=10**6, max_stagnation=10**6, weight_init_stdev=1e9)
    assert settings.max_stagnation == 10**6
