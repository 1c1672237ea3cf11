"""A whole brain as flat arrays, and the compiled kernel that runs it.

All values live in one vector: the observation first, then the nodes of every module, then a copy of what
links read (feed-forward brains), then a slot that stays 0. Semantics are those of neat-python's networks,
weights and order of summation included.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from exneat_cli.tasks.compiling import compiled

ACTIVATION_CODES = {"tanh": 0, "relu": 1, "sigmoid": 2, "identity": 3}
"""neat-python's name of an activation -> its number in the kernel."""


class Brain(NamedTuple):
    """A compiled team. E edges, N nodes in the order of evaluation, L links, A actuators.

    Attributes:
        observation_size: entries of the observation that it was wired for.
        size: length of the value vector; its last entry stays 0.
        recurrent: all nodes advance together from the previous step's values, else one after another.
        node_slot: (N,) where each node's value is kept.
        edge_start: (N + 1,) the edges of node n are edge_start[n] to edge_start[n + 1].
        edge_source: (E,) slot that each edge reads.
        edge_weight: (E,) its weight.
        bias, response: (N,) a node's value is act(bias + response * sum).
        activation: (N,) numbers of `ACTIVATION_CODES`.
        link_slot, link_source: (L,) at each step's start the source's old value is copied to the slot.
        output_slot: (A,) slot that sets each actuator.
    """

    observation_size: int
    size: int
    recurrent: bool
    node_slot: NDArray[np.int64]
    edge_start: NDArray[np.int64]
    edge_source: NDArray[np.int64]
    edge_weight: NDArray[np.float64]
    bias: NDArray[np.float64]
    response: NDArray[np.float64]
    activation: NDArray[np.int64]
    link_slot: NDArray[np.int64]
    link_source: NDArray[np.int64]
    output_slot: NDArray[np.int64]


def sizes(brain: Brain) -> tuple[int, int]:
    """Lengths of the observation and the action that `brain` was wired for."""
    return brain.observation_size, len(brain.output_slot)


@compiled
def fresh_memory(brain: Brain) -> NDArray[np.float64]:
    """The value vector at an episode's start, (size,), plus a scratch entry per node."""
    return np.zeros(brain.size + brain.node_slot.size)


@compiled
def activate(
    brain: Brain,
    memory: NDArray[np.float64],
    observation: NDArray[np.float64],
    action: NDArray[np.float64],
    rng: Generator,
) -> None:
    """One step: read `observation`, advance `memory`, write `action`.

    Args:
        brain: see there.
        memory: what `fresh_memory` gave, carried through the episode.
        observation: (observation size,).
        action: (A,), overwritten.
        rng: what chance in the choice of actions draws from; networks leave nothing to chance.
    """
    for i in range(observation.size):
        memory[i] = observation[i]
    for i in range(brain.link_slot.size):
        memory[brain.link_slot[i]] = memory[brain.link_source[i]]
    for node in range(brain.node_slot.size):
        total = 0.0
        for edge in range(brain.edge_start[node], brain.edge_start[node + 1]):
            total += memory[brain.edge_source[edge]] * brain.edge_weight[edge]
        value = _activation(brain.activation[node], brain.bias[node] + brain.response[node] * total)
        memory[brain.size + node if brain.recurrent else brain.node_slot[node]] = value
    if brain.recurrent:
        for node in range(brain.node_slot.size):
            memory[brain.node_slot[node]] = memory[brain.size + node]
    for i in range(action.size):
        action[i] = memory[brain.output_slot[i]]


@compiled
def _activation(code, value):  # type: ignore[no-untyped-def]
    if code == 0:
        return math.tanh(max(-60.0, min(60.0, 2.5 * value)))
    if code == 1:
        return value if value > 0.0 else 0.0
    if code == 2:
        return 1.0 / (1.0 + math.exp(-max(-60.0, min(60.0, 5.0 * value))))
    return value
