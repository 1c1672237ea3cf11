"""Champions made up for the tests of pictures: what champion.json holds, as far as pictures need it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any


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
    body = a_module("body", (0.0, 0.0), 0, pins=[reads(0), reads(1)], outputs=2, drives=[0, 1])
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
            pins=[reads(2 * k), reads(2 * k + 1), reads(1, (k + 1) % 4, delayed=True)],
            outputs=1,
            hidden=1,
        )
        for k, (name, place) in enumerate(places.items())
    ]
    pins = [reads(8), *(reads(0, leg) for leg in range(3))]
    central = a_module("central", (0.0, 0.0), 1, pins=pins, outputs=2, drives=[0, 1])
    leg_genome = a_genome([0, 1], [(-1, 1, 0.5), (-2, 1, -0.8), (-3, 1, 0.2), (1, 0, 1.2)])
    middle = a_genome([0, 1], [(-k, k % 2, 0.4 * k - 1.0) for k in range(1, 5)])
    return a_champion([*legs, central], [leg_genome, middle], ["hip_1", "ankle_1"], 9)
