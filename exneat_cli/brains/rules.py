"""Brains that follow a fixed rule: the untrained baselines."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from exneat_cli.algorithms import ACTIVATIONS
from exneat_cli.brains.brain import Brains
from exneat_cli.tasks import Part, Task


def acting_by_rule(rule: str, task: Task) -> Brains | None:
    """The brain that follows the rule ``motionless`` or ``linear_fusion`` in a task; None for ``random``."""
    if rule == "random":
        return None
    if rule == "motionless":
        return motionless(task.sensed_size, task.resting_action)
    return linear_fusion(task.sensed_size, len(task.actuator_names), task.parts)


def motionless(observation_size: int, resting_action: NDArray[np.float64]) -> Brains:
    """The brain that outputs `resting_action`, (A,), at every step."""
    return weighted_sums(np.zeros((len(resting_action), observation_size)), resting_action)


def linear_fusion(observation_size: int, action_size: int, parts: Sequence[Part]) -> Brains:
    """The brain that moves to where the sum of channels is largest: a part's actuators get the sum of its sensors."""
    weights = np.zeros((action_size, observation_size))
    for part in parts:
        weights[np.ix_(part.actuators, part.sensors)] = 1.0
    return weighted_sums(weights, np.zeros(action_size))


def weighted_sums(weights: NDArray[np.float64], bias: NDArray[np.float64]) -> Brains:
    """The brain whose action is ``weights @ observation + bias``.

    Args:
        weights: (A, observation size); zeros do not become edges.
        bias: (A,).
    """
    actions, inputs = weights.shape
    targets, sources = np.nonzero(weights)
    none = np.zeros(0, dtype=np.int64)
    slots = inputs + np.arange(actions)
    return Brains(
        observation_size=inputs,
        size=np.array([inputs + actions + 1]),
        recurrent=np.array([False]),
        first_node=np.array([0, actions]),
        first_link=np.array([0, 0]),
        node_slot=slots,
        edge_start=np.searchsorted(targets, np.arange(actions + 1)).astype(np.int64),
        edge_source=sources.astype(np.int64),
        edge_weight=weights[targets, sources],
        bias=np.array(bias, dtype=np.float64),
        response=np.ones(actions),
        activation=np.full(actions, ACTIVATIONS.index("identity")),
        link_slot=none,
        link_source=none,
        output_slot=slots[np.newaxis],
    )
