"""Champions made up for the tests of pictures: what champion.json holds, as far as pictures need it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import msgspec

from exneat_cli.records.champion import Champion


def reads(index: int, module: int = -1, *, delayed: bool = False) -> dict[str, Any]:
    """A pin: an entry of the observation, or a node of a module."""
    return {"index": index, "module": module, "delayed": delayed}


def a_module(name: str, position: tuple[float, float], subpopulation: int, **others: Any) -> dict[str, Any]:
    return {
        "name": name,
        "position": list(position),
        "subpopulation": subpopulation,
        "hidden": 0,
        "drives": [],
        **others,
    }


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
    return {
        "format": 3,
        "variant": "made-up",
        "task": {"name": "made_up"},
        "sensors": [f"eye {k} (cd)" for k in range(sensors)],
        "actuators": list(actuators),
        "feed_forward": True,
        "scores": {"test": a_score(0.75, 0.75)},
        "plan": {"modules": list(modules), "observation_size": sensors, "action_size": len(actuators)},
        "genomes": list(genomes),
    }


def a_score(fitness: float, full_reward: float) -> dict[str, Any]:
    """Figures of a brain on 20 episodes."""
    means = {"fitness_mean": fitness, "full_reward_mean": full_reward}
    return {"episodes": 20, **means, "fitness_std": 0.1, "full_reward_std": 0.1, "failed_episodes": 0, "fitness": []}


def champion_of(content: dict[str, Any]) -> Champion:
    """What reading champion.json would give."""
    return msgspec.convert(content, Champion)


def grid_champion() -> dict[str, Any]:
    """One module with two sensors, two outputs and three hidden nodes.

    Node 2 lies between the first sensor and output 0, node 3 behind it, and node 4 leads nowhere. The
    connection to output 1 starts at node 4's only source, the second sensor.
    """
    connections = [(-1, 2, 1.5), (2, 3, -0.5), (3, 0, 2.0), (2, 0, 0.3), (-2, 4, 1.0), (-2, 1, -1.0), (1, 1, 0.7)]
    body = a_module("body", (0.0, 0.0), 0, pins=[reads(0), reads(1)], outputs=2, drives=[0, 1])
    champion = a_champion([body], [a_genome([0, 1, 2, 3, 4], connections)], ["left", "right"], 2)
    return {**champion, "feed_forward": False}


def modular_champion() -> dict[str, Any]:
    """Four legs that share a genome, each linked to the next one's hidden node, and a central module.

    The back right leg's output is read by nothing.
    """
    places = [(0.2, 0.2), (0.2, -0.2), (-0.2, 0.2), (-0.2, -0.2)]
    legs = [
        a_module(
            f"{'front' if x > 0 else 'back'}_{'left' if y > 0 else 'right'}",
            (x, y),
            0,
            pins=[reads(2 * k), reads(2 * k + 1), reads(1, (k + 1) % 4, delayed=True)],
            outputs=1,
            hidden=1,
        )
        for k, (x, y) in enumerate(places)
    ]
    pins = [reads(8), *(reads(0, leg) for leg in range(3))]
    central = a_module("central", (0.0, 0.0), 1, pins=pins, outputs=2, drives=[0, 1])
    leg_genome = a_genome([0, 1], [(-1, 1, 0.5), (-2, 1, -0.8), (-3, 1, 0.2), (1, 0, 1.2)])
    middle = a_genome([0, 1], [(-k, k % 2, 0.4 * k - 1.0) for k in range(1, 5)])
    return a_champion([*legs, central], [leg_genome, middle], ["hip_1 (3 N m)", "ankle_1"], 9)
