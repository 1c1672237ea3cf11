"""Run directories and studies made up for the tests of figures: no training, every number from a formula."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib.image
import numpy as np

from exneat_cli.analysis.study import PlannedRun, Study
from exneat_cli.records import (
    DONE,
    UNPERTURBED,
    RobustnessRow,
    RunDirectory,
    merge_robustness,
    write_history,
    write_json,
)
from tests.analysis.fake_studies import history_row

LEVELS = tuple(round(0.1 * k, 1) for k in range(6))
SWEEPS = {"sensor_noise": "sensor noise (standard deviation)", "gap": "gap before the goal (tiles)"}
COMMAND = "exneat sweep experiment=made_up budget=quick"


def a_study(
    root: Path,
    *,
    variants: Mapping[str, str] | None = None,
    baselines: Sequence[str] = ("random",),
    seeds: int = 3,
    scale: float = 1.0,
    swept: Sequence[str] | None = None,
    generations: int = 8,
) -> Study:
    """Two conditions, all runs finished; `swept` names the variants with sweeps in robustness.csv, by default all."""
    variants = variants or {"neat": "NEAT", "exneat": "ExNEAT single", "random": "random actions"}
    conditions = {"noise": "sensor noise 0.05", "long": "17 tiles"}
    runs = []
    for condition in conditions:
        for place, variant in enumerate(variants):
            for seed in range(1 if variant in baselines else seeds):
                run = RunDirectory(root / condition / f"{variant}-s{seed}")
                runs.append(PlannedRun(condition, variant, seed, run))
                if variant in baselines:
                    finish_baseline(run, variant, scale)
                else:
                    finish(run, variant, seed, scale * (0.5 + 0.1 * place), generations)
                sweeps = SWEEPS if swept is None or variant in swept else {}
                write_robustness(run, variant, seed, scale * (0.4 + 0.1 * place), sweeps)
    return Study(
        experiment="made_up",
        budget="quick",
        claim="Numbers come from formulas.",
        command=COMMAND,
        fitness_name="forward reward" if scale > 1.0 else "fitness",
        has_full_reward=scale > 1.0,
        variants=variants,
        baselines=tuple(baselines),
        conditions=conditions,
        sweeps=SWEEPS,
        runs=tuple(runs),
    )


def finish(run: RunDirectory, variant: str, seed: int, height: float, generations: int = 8) -> None:
    """A trained run: the better on validation, the higher its seed."""
    run.path.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng([seed, len(variant)])
    gains = np.abs(rng.normal(0.06, 0.04, generations)) * height
    best = height * 0.5 + np.cumsum(gains) + 0.03 * height * seed
    steps = np.cumsum(rng.integers(5_000, 9_000, generations))
    rows = [
        history_row(g + 1, float(best[g]), 0.0, 0.0, float(best[g]), 1000 * (g + 1), int(steps[g]), 1, 8, 0, 0, 0, 0.1)
        for g in range(generations)
    ]
    write_history(run.history, rows)
    write_json(run.champion, grid_champion() if variant == "neat" else modular_champion())
    scores = {"fitness_mean": float(best[-1]), "fitness_std": 0.1, "full_reward_mean": float(best[-1]), "episodes": 20}
    result = {"training": float(best[-1]), "validation": float(seed), "champion": scores}
    spent = {"episodes": 1000 * generations, "env_steps": int(steps[-1]), "wall_seconds": 1.0}
    write_json(run.manifest, {"status": DONE, "result": result, "budget_spent": spent})


def finish_baseline(run: RunDirectory, variant: str, scale: float) -> None:
    """A run that nothing trained."""
    run.path.mkdir(parents=True, exist_ok=True)
    champion = {"fitness_mean": 0.2 * scale, "fitness_std": 0.1, "full_reward_mean": 0.2 * scale, "episodes": 20}
    write_json(run.manifest, {"status": DONE, "variant": variant, "result": {"champion": champion}})


def write_robustness(
    run: RunDirectory, variant: str, seed: int, height: float, sweeps: Mapping[str, str] = SWEEPS
) -> None:
    """robustness.csv: fitness falls with the level, and rises by a hundredth of `height` per seed."""
    rows = [RobustnessRow(variant, seed, UNPERTURBED, 0.0, 20, height, 0.1, height, 0.1)]
    for parameter in sweeps:
        for level in LEVELS:
            fitness = height * (1.0 - level) * (1.0 if variant != "random" else 0.4) + 0.01 * height * seed
            rows.append(
                RobustnessRow(variant, seed, parameter, level, 20, fitness, 0.1 * height, 2 * fitness, 0.2 * height)
            )
    merge_robustness(run.robustness, rows)


def has_white_edges(path: Path) -> bool:
    """Whether nothing in a PNG is cut off: its outermost pixels are all white."""
    picture = matplotlib.image.imread(path)[..., :3]
    edges = [picture[:1], picture[-1:], picture[:, :1], picture[:, -1:]]
    return all(bool((edge == 1.0).all()) for edge in edges)


def a_pin(index: int, module: int = -1, *, delayed: bool = False) -> dict[str, Any]:
    return {"index": index, "module": module, "delayed": delayed}


def a_module(name: str, position: tuple[float, float], subpopulation: int, **others: Any) -> dict[str, Any]:
    return {"name": name, "position": position, "subpopulation": subpopulation, "hidden": 0, "drives": [], **others}


def a_genome(nodes: Sequence[int], connections: Sequence[tuple[int, int, float]]) -> dict[str, Any]:
    """A genome with every connection enabled."""
    return {
        "id": 1,
        "nodes": [{"id": node, "bias": 0.0, "response": 1.0, "activation": "tanh"} for node in nodes],
        "connections": [
            {"from": source, "to": target, "weight": weight, "enabled": True, "innovation": k}
            for k, (source, target, weight) in enumerate(connections)
        ],
    }


def a_champion(
    modules: Sequence[dict[str, Any]], genomes: Sequence[dict[str, Any]], actuators: Sequence[str], sensors: int
) -> dict[str, Any]:
    """What a champion file holds, as far as pictures need it."""
    return {
        "format": 2,
        "variant": "made-up",
        "task": {"name": "made_up"},
        "actuators": list(actuators),
        "feed_forward": True,
        "scores": {"test": {"fitness_mean": 0.75, "fitness_std": 0.1, "episodes": 20}},
        "plan": {"modules": list(modules), "observation_size": sensors, "action_size": len(actuators)},
        "genomes": list(genomes),
    }


def grid_champion() -> dict[str, Any]:
    """One module with two sensors, two outputs and three hidden nodes.

    Node 2 lies between the first sensor and output 0, node 3 behind it, and node 4 leads nowhere. The
    connection to output 1 starts at node 4's only source, the second sensor.
    """
    connections = [(-1, 2, 1.5), (2, 3, -0.5), (3, 0, 2.0), (2, 0, 0.3), (-2, 4, 1.0), (-2, 1, -1.0), (1, 1, 0.7)]
    body = a_module("body", (0.0, 0.0), 0, pins=[a_pin(k) for k in range(2)], outputs=2, drives=[0, 1])
    champion = a_champion([body], [a_genome([0, 1, 2, 3, 4], connections)], ["left", "right"], 2)
    return {**champion, "feed_forward": False}


def modular_champion() -> dict[str, Any]:
    """Four legs that share a genome, each linked to the next one's hidden node, and a central module.

    The back right leg's output is read by nothing.
    """
    places = {
        "front_left": (0.2, 0.2),
        "front_right": (0.2, -0.2),
        "back_left": (-0.2, 0.2),
        "back_right": (-0.2, -0.2),
    }
    legs = [
        a_module(
            name,
            place,
            0,
            pins=[a_pin(2 * k), a_pin(2 * k + 1), a_pin(1, (k + 1) % 4, delayed=True)],
            outputs=1,
            hidden=1,
        )
        for k, (name, place) in enumerate(places.items())
    ]
    reads = [a_pin(8), *(a_pin(0, leg) for leg in range(3))]
    central = a_module("central", (0.0, 0.0), 1, pins=reads, outputs=2, drives=[0, 1])
    leg_genome = a_genome([0, 1], [(-1, 1, 0.5), (-2, 1, -0.8), (-3, 1, 0.2), (1, 0, 1.2)])
    middle = a_genome([0, 1], [(-k, k % 2, 0.4 * k - 1.0) for k in range(1, 5)])
    return a_champion([*legs, central], [leg_genome, middle], ["hip_1", "ankle_1"], 9)
