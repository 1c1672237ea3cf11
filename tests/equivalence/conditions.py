"""What both kinds of genomes are let loose on, and the final fitness that a seed reaches."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from functools import partial

import numpy as np
import yaml

from exneat_cli.algorithms import RECURRENT, Coevolution, EvolutionSettings, Problem, Results
from exneat_cli.brains import Brains, assemble
from exneat_cli.brains.brain import activate, memory_size
from exneat_cli.commands.shipped import shipped_directory
from exneat_cli.rollouts import Executor, Noise, Runner
from exneat_cli.runs import RunSettings
from exneat_cli.runs.training import Training
from exneat_cli.tasks import TASKS
from exneat_cli.wiring import Module, Pin, Plan

XOR_INPUTS = np.array([[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]])
XOR_TARGETS = np.array([0.0, 1.0, 1.0, 0.0])
XOR_PLAN = Plan((Module("body", (0.0, 0.0), 0, (Pin(0), Pin(1)), 1, 1, (0,)),), 2, 1)
XOR_SETTINGS = EvolutionSettings(
    neat_hidden=1,
    weight_init_stdev=1.0,
    weight_mutate_power=0.5,
    node_add_prob=0.2,
    conn_add_prob=0.4,
    compatibility_threshold=1.5,
)
XOR_POPULATION = 50
XOR_GENERATIONS = 15


def xor(genome: str, seed: int) -> float:
    """Best fitness of a population that is to learn exclusive or: 4 less the squared errors."""
    settings = dataclasses.replace(XOR_SETTINGS, genome=genome)
    evolution = Coevolution(Problem(XOR_PLAN, settings, XOR_POPULATION, episodes=1, pairing="rank", seed=seed))
    best = -np.inf
    for _ in range(XOR_GENERATIONS):
        brains = assemble(XOR_PLAN, [team.genomes for team in evolution.ask()[0]], feed_forward=True)
        fitness = np.array([[_xor_fitness(brains, b)] for b in range(XOR_POPULATION)])
        evolution.tell(Results(fitness, np.zeros(XOR_POPULATION, np.bool_)))
        best = max(best, float(fitness.max()))
    return best


def _xor_fitness(brains: Brains, b: int) -> float:
    memory, action = np.zeros(memory_size(brains)), np.zeros(1)
    answers = []
    for inputs in XOR_INPUTS:
        memory[:2] = inputs
        activate(brains, b, memory, action)
        answers.append(action[0])
    return 4.0 - float(np.sum((np.array(answers) - XOR_TARGETS) ** 2))


def grid_world(task: str, sensor_std: float, genome: str, seed: int) -> float:
    """Best fitness so far after NEAT's paper budget in a grid world, sensor noise N(0, `sensor_std`)."""
    path = shipped_directory("conf") / "task" / f"{task}.yaml"
    paper = yaml.safe_load(path.read_text(encoding="utf-8"))["budgets"]["paper"]
    settings = RunSettings(
        task=TASKS[task](),
        algorithm="neat",
        noise=Noise(sensor_std=sensor_std),
        evolution=dataclasses.replace(RECURRENT, genome=genome),
        executor=Executor("serial"),
        seed=seed,
        **{key: paper[key] for key in ("generations", "population", "episodes")},
    )
    with Runner(settings.task, settings.noise, settings.executor, training=True) as runner:
        training = Training.start(settings)
        while not training.is_over:
            training.advance(runner)
    return float(training.history[-1]["best_so_far"])


CONDITIONS: dict[str, Callable[[str, int], float]] = {
    "exclusive or": xor,
    "general_maze": partial(grid_world, "general_maze", 0.0),
    "hunting, sensor noise 0.01": partial(grid_world, "hunting", 0.01),
}
"""Name -> final fitness, given ``array`` or ``stock`` and a seed."""
