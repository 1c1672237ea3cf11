"""A recipe is many settings in one word; those that are given count more, and thesis is what there was before."""

from __future__ import annotations

import pytest

from exneat_cli.commands.command_line import read_command_line
from exneat_cli.commands.jobs import read_job
from exneat_cli.runs import RunSettings
from exneat_cli.tasks import RobotTask


def settings_of(*arguments: str) -> RunSettings:
    return read_job("train", read_command_line("train", list(arguments))).settings


@pytest.mark.parametrize(
    ("arguments", "directory"),
    [
        (["algorithm=neat"], "ant/neat-s0-afd784"),
        (["geometry=all"], "ant/exneat-all-none-s0-51b5de"),
        (["task=robot"], "robot/exneat-single-none-s0-49a480"),
    ],
)
def test_runs_of_the_thesis_keep_the_names_that_they_had(arguments: list[str], directory: str) -> None:
    assert str(settings_of("recipe=thesis", *arguments).directory.path) == f"outputs/{directory}"


def test_from_python_the_thesis_is_the_default() -> None:
    assert settings_of("recipe=thesis").full_hash == RunSettings().full_hash


@pytest.mark.parametrize("task", ["ant", "robot"])
def test_walking_is_the_default_of_robots_on_the_command_line(task: str) -> None:
    chosen = settings_of(f"task={task}")
    assert chosen == settings_of(f"task={task}", "recipe=walking")
    assert isinstance(chosen.task, RobotTask)
    assert (chosen.task.frame, chosen.task.contact_forces) == ("part", False)
    assert (chosen.linkage, chosen.wiring.trunk, chosen.judging, chosen.champion) == (
        "joints",
        "shared",
        "mean",
        "race",
    )
    assert (chosen.evolution.mutation, chosen.evolution.module_hidden) == ("adaptive", 0)


def test_keys_and_options_that_are_given_count_more_than_the_recipe_in_any_order() -> None:
    given = ["task.frame=world", "linkage=output", "wiring.trunk=none", "judging=last", "evolution.module_hidden=4"]
    for arguments in ([*given, "recipe=walking"], ["recipe=walking", *given]):
        chosen = settings_of(*arguments)
        assert isinstance(chosen.task, RobotTask)
        assert (chosen.task.frame, chosen.task.contact_forces, chosen.linkage) == ("world", False, "output")
        assert (chosen.wiring.trunk, chosen.judging, chosen.champion) == ("none", "last", "race")
        assert (chosen.evolution.module_hidden, chosen.evolution.mutation) == (4, "adaptive")
    assert settings_of("evolution=feed_forward").evolution == RunSettings().evolution


@pytest.mark.parametrize("algorithm", ["neat", "random", "motionless"])
def test_a_recipe_wires_no_modules_where_an_algorithm_has_none(algorithm: str) -> None:
    chosen = settings_of(f"algorithm={algorithm}")
    assert (chosen.linkage, chosen.wiring.trunk, chosen.judging) == ("none", "none", "mean")
    assert settings_of("task=hunting", f"algorithm={algorithm}").judging == "last"


def test_what_differs_for_an_algorithm_or_a_geometry_counts_more_than_the_recipe_and_less_than_what_is_given() -> None:
    assert settings_of().evolution.weight_mutate_power == 0.015
    assert settings_of("algorithm=neat").evolution.weight_mutate_power == 0.005
    four = settings_of("geometry=all")
    assert (four.evolution.weight_mutate_power, four.pairing) == (0.01, "parents")
    assert settings_of("geometry=all", "pairing=rank").pairing == "rank"
    assert settings_of("geometry=all", "algorithm=ars").pairing == "rank"
    chosen = settings_of("algorithm=neat", "evolution.weight_mutate_power=0.02").evolution
    assert (chosen.weight_mutate_power, chosen.bias_mutate_power) == (0.02, 0.005)
    assert settings_of("recipe=thesis", "algorithm=neat").evolution == RunSettings().evolution


def test_later_settings_stay_out_of_the_hash_only_while_they_are_as_before() -> None:
    before = settings_of("recipe=thesis").full_hash
    for changed in ("judging=mean", "champion=race", "evolution.crossover_prob=0.5", "evolution.parent_selection=rank"):
        assert settings_of("recipe=thesis", changed).full_hash != before
