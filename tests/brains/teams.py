"""Random teams, and what brains do."""

from __future__ import annotations

import random
from dataclasses import replace
from typing import Any

import neat
import numpy as np
from neat.innovation import InnovationTracker

from exneat_cli.algorithms import EvolutionSettings, neat_config
from exneat_cli.brains import Brains
from exneat_cli.brains.brain import activate, memory_size
from exneat_cli.tasks import Part
from exneat_cli.wiring import Plan

STEPS = 50


class Cross:
    """What planning asks of a task: four parts with two sensors and one actuator each, like the grid worlds'."""

    name = "cross"
    parts = tuple(
        Part(name, (2 * k, 2 * k + 1), (k,), position)
        for k, (name, position) in enumerate(
            {"left": (-1.0, 0.0), "right": (1.0, 0.0), "up": (0.0, 1.0), "down": (0.0, -1.0)}.items()
        )
    )
    trunk = None
    sensed_size = 8
    actuator_names = ("left", "right", "up", "down")


def busy(settings: EvolutionSettings, **changes: Any) -> EvolutionSettings:
    """The same for neat-python's own genomes, with much structural mutation."""
    rates = dict.fromkeys(("node_add_prob", "node_delete_prob", "conn_add_prob", "conn_delete_prob"), 0.5)
    return replace(settings, **{**rates, "genome": "stock", **changes})


def random_team(plan: Plan, settings: EvolutionSettings, seed: int) -> list[neat.DefaultGenome]:
    """One genome per subpopulation after up to 40 mutations, with a fifth of its connections disabled."""
    state = random.getstate()
    random.seed(seed)
    genomes = []
    for shape in plan.subpopulation_shapes:
        config = neat_config(settings, 10, shape).genome_config
        config.innovation_tracker = InnovationTracker()
        genome = neat.DefaultGenome(1)
        genome.configure_new(config)
        for _ in range(random.randrange(40)):
            genome.mutate(config)
        for gene in genome.connections.values():
            gene.enabled = random.random() > 0.2
        for node in genome.nodes.values():
            node.response = random.uniform(-2.0, 2.0)
        genomes.append(genome)
    random.setstate(state)
    return genomes


def actions_of(brains: Brains, b: int, sensed: np.ndarray) -> np.ndarray:
    """(steps, A) what brain `b` does from its start on, given (steps, sensed size)."""
    memory = np.zeros(memory_size(brains))
    actions = np.full((len(sensed), brains.output_slot.shape[1]), np.nan)
    for row, action in zip(sensed, actions, strict=True):
        memory[: row.size] = row
        activate(brains, b, memory, action)
    return actions
