"""How settings are composed, against Hydra's own composition of the same words."""

from __future__ import annotations

from dataclasses import replace

import pytest
from omegaconf import OmegaConf

from exneat_cli.commands.command_line import CommandLine, read_command_line

WORDS = [
    ["task=hunting", "sweep=[n_prey,p_c]", "task.p_m=0.1", "sweep.levels=[0,1]", "name=x"],
    [
        "task=hunting",
        "sweep=[n_prey,p_c]",
        "task.p_m=0.2",
        "evolution.weight_mutate_rate=0.3",
        "wiring={output_width: 3}",
    ],
    ["task=ant", "algorithm=ars", "recipe=walking", "wiring.output_width=3", "wiring.output_width=4", "budget=smoke"],
]


def by_hydra(line: CommandLine) -> object:
    with line.composed() as config:
        return OmegaConf.to_container(
            OmegaConf.masked_copy(config, [str(key) for key in config if key != "hydra"]), resolve=True
        )


@pytest.mark.parametrize("command", ["train", "sweep"])
def test_settings_come_out_as_hydra_composes_them_also_after_others_with_the_same_options(command: str) -> None:
    line = read_command_line(command, [])
    for words in (*WORDS, WORDS[0]):
        own = replace(line, settings=read_command_line(command, words).settings)
        assert own.compose() == by_hydra(own)
