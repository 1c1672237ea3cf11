"""Settings of a run: names, hashes, refusals."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from exneat_cli.algorithms import ARS, EvolutionSettings
from exneat_cli.errors import ConfigError, ExneatError
from exneat_cli.rollouts import Noise
from exneat_cli.runs import RunSettings
from exneat_cli.tasks import AntTask, GeneralMaze, Hunting, Task, TrackMaze
from exneat_cli.wiring import Geometry, Wiring


@pytest.mark.parametrize(
    ("changes", "variant"),
    [
        ({"algorithm": "neat"}, "neat"),
        ({"algorithm": "random"}, "random"),
        ({"geometry": Geometry("all")}, "exneat-all-none"),
        ({"geometry": Geometry("all"), "wiring": Wiring(central=True)}, "exneat-all-none"),
        ({"linkage": "hidden", "wiring": Wiring(central=False)}, "exneat-single-hidden-nocentral"),
        ({"geometry": Geometry("custom", (0, 1, 1, 2))}, "exneat-custom0112-none"),
    ],
)
def test_a_variant_is_algorithm_geometry_linkage_and_central(changes: dict[str, Any], variant: str) -> None:
    assert RunSettings(**changes).variant == variant


def test_seeds_share_the_hash_in_the_directory_and_everything_else_changes_it() -> None:
    def short_hash(**changes: Any) -> str:
        return RunSettings(**changes).directory.path.name.rsplit("-", 1)[1]

    assert len(short_hash()) == 6
    assert short_hash(seed=0) == short_hash(seed=9)
    assert short_hash(output="elsewhere", name="other") == short_hash()
    assert short_hash(generations=3) == short_hash(), "a run may be made longer"
    for changes in ({"population": 3}, {"pairing": "index"}, {"task": AntTask(patience=3)}, {"linkage": "output"}):
        assert short_hash(**changes) != short_hash(), changes


def test_what_means_nothing_for_an_evolution_strategy_is_no_part_of_its_hash() -> None:
    def full_hash(**changes: Any) -> str:
        evolution = replace(ARS().usual_evolution(EvolutionSettings()), **changes)
        return RunSettings(algorithm="ars", evolution=evolution).full_hash

    assert full_hash(conn_add_prob=0.9, weight_mutate_power=1.0, bias_init_stdev=9.0, neat_hidden=3) == full_hash()
    for changes in (
        {"module_hidden": 3},
        {"output_activation": "tanh"},
        {"bias_init_stdev": 0.0, "bias_mutate_rate": 0.0},
    ):
        assert full_hash(**changes) != full_hash(), changes


def test_the_same_run_has_one_hash_however_it_is_written() -> None:
    same = [
        (RunSettings(), RunSettings(noise=Noise(sensor_std=0))),
        (RunSettings(), RunSettings(wiring=Wiring(central=True))),
        (
            RunSettings(geometry=Geometry("custom", (0, 1, 1, 0))),
            RunSettings(geometry=Geometry("custom", (1, 0, 0, 1))),
        ),
    ]
    for one, other in same:
        assert one.directory == other.directory
        assert one.full_hash == other.full_hash
    assert RunSettings().full_hash != RunSettings(wiring=Wiring(central=False)).full_hash


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        ({"seed": -1}, "seed"),
        ({"seed": 1.5}, "seed"),
        ({"generations": 0}, "generations"),
        ({"population": 1}, "population"),
        ({"episodes": 0}, "episodes"),
        ({"pairing": "random"}, "pairing"),
        ({"test_episodes": 0}, "test_episodes"),
        ({"name": "../x"}, "name"),
        ({"name": ".."}, "name"),
        ({"name": "a/b"}, "name"),
        ({"output": ""}, "output"),
        ({"resume": "yes"}, "resume"),
        ({"algorithm": "cma"}, "algorithm"),
        ({"linkage": "some"}, "linkage"),
    ],
)
def test_values_out_of_range_are_refused_by_their_key(changes: dict[str, Any], key: str) -> None:
    with pytest.raises(ConfigError, match=f"^{key}: expected"):
        RunSettings(**changes)


def test_settings_survive_plain_data() -> None:
    settings = RunSettings(geometry=Geometry("custom", (0, 1, 0, 1)), task=AntTask(reward="gymnasium"), seed=4)
    assert RunSettings.from_plain(settings.to_plain()) == settings


def test_an_unknown_key_is_refused_with_the_closest_known_one() -> None:
    plain = RunSettings().to_plain()
    with pytest.raises(ExneatError, match=r"evolution\.elitsm: unknown key .*\n.*did you mean evolution\.elitism"):
        RunSettings.from_plain({**plain, "evolution": {**plain["evolution"], "elitsm": 1}})


@pytest.mark.parametrize(
    ("before", "changed", "recorded"),
    [
        (TrackMaze(), TrackMaze(leading="second"), "a25d1e"),
        (GeneralMaze(), GeneralMaze(channel_weights=(0.2, 0.8)), "aa743e"),
        (Hunting(), Hunting(rules="library"), None),
    ],
)
def test_later_parameters_of_grid_worlds_are_hashed_only_where_they_change_something(
    before: Task, changed: Task, recorded: str | None
) -> None:
    old, new = (RunSettings(task=task).directory.path.name[-6:] for task in (before, changed))
    assert recorded in (None, old)
    assert new != old
