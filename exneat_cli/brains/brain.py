"""Whole brains as flat arrays, and the compiled kernel that runs them.

All values are kept in one vector: the sensed values, then the nodes of every module, then copies of the values that
links read (in feed-forward brains), then a slot that stays 0. Results are those of neat-python's networks, including
the order of summation.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exneat_cli.compiling import compiled_lean


class Brains(NamedTuple):
    """B compiled teams for one task, end to end, so that one compiled call can run them all.

    They have N nodes, in the order of evaluation, E edges and L links in total, and A actuators each.

    Attributes:
        observation_size: number of sensed values, `Task.sensed_size`.
        size: (B,) length of each value vector; its last entry stays 0.
        recurrent: (B,) whether all nodes advance together from the previous step's values, rather than one after
            another.
        first_node: (B + 1,) the nodes of brain b are first_node[b] to first_node[b + 1].
        first_link: (B + 1,) its links, likewise.
        node_slot: (N,) slot of each node's value.
        edge_start: (N + 1,) the edges of node n are edge_start[n] to edge_start[n + 1].
        edge_source: (E,) slot that each edge reads.
        edge_weight: (E,) its weight.
        bias, response: (N,) a node's value is act(bias + response * sum).
        activation: (N,) indices into `exneat_cli.algorithms.ACTIVATIONS`.
        link_slot, link_source: (L,) at the start of each step, the source's old value is copied to the slot.
        output_slot: (B, A) slot that sets each actuator.
    """

    observation_size: int
    size: NDArray[np.int64]
    recurrent: NDArray[np.bool_]
    first_node: NDArray[np.int64]
    first_link: NDArray[np.int64]
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

    def part(self, first: int, last: int) -> Brains:
        """The brains from `first` to before `last`, renumbered from 0; arrays are views where possible."""
        brains, nodes = slice(first, last), slice(int(self.first_node[first]), int(self.first_node[last]))
        links = slice(int(self.first_link[first]), int(self.first_link[last]))
        edges = slice(int(self.edge_start[nodes.start]), int(self.edge_start[nodes.stop]))
        places = dict.fromkeys(("size", "recurrent", "output_slot"), brains)
        places |= dict.fromkeys(("node_slot", "bias", "response", "activation"), nodes)
        places |= dict.fromkeys(("edge_source", "edge_weight"), edges)
        places |= dict.fromkeys(("link_slot", "link_source"), links)
        return self._replace(
            first_node=self.first_node[first : last + 1] - nodes.start,
            first_link=self.first_link[first : last + 1] - links.start,
            edge_start=self.edge_start[nodes.start : nodes.stop + 1] - edges.start,
            **{name: getattr(self, name)[place] for name, place in places.items()},
        )


def lay_out(brains: Sequence[Brains]) -> Brains:
    """All of `brains`, end to end.

    Raises:
        ValueError: there are none, or they have different sizes of observation or action.
    """
    sizes = {(each.observation_size, each.output_slot.shape[1]) for each in brains}
    if len(sizes) != 1:
        expected = "at least one, all of one size of observation and action"
        raise ValueError(f"brains: expected {expected}, got {sorted(sizes)}")

    def joined(field: str) -> NDArray[Any]:
        columns = [getattr(each, field) for each in brains]
        if field in ("first_node", "first_link", "edge_start"):  # positions, which continue from one to the next
            return np.cumsum(np.concatenate([[0], *(np.diff(column) for column in columns)]))
        return np.concatenate(columns)

    return Brains(brains[0].observation_size, *(joined(field) for field in Brains._fields[1:]))


def memory_size(brains: Brains) -> int:
    """Size of the memory for any of `brains`: its value vector and a scratch entry for each of its nodes."""
    return int(np.max(brains.size + np.diff(brains.first_node)))


@compiled_lean
def activate(brains: Brains, b: int, memory: NDArray[np.float64], action: NDArray[np.float64]) -> None:
    """One step of brain `b`: advance `memory` and write `action`.

    Args:
        brains: the compiled teams.
        b: index of the brain.
        memory: (`memory_size`,), all 0 when an episode starts; it begins with the values sensed at this step.
        action: (A,), overwritten.
    """
    # 1. Copy the values that links read, before they are overwritten.
    for i in range(brains.first_link[b], brains.first_link[b + 1]):
        memory[brains.link_slot[i]] = memory[brains.link_source[i]]
    # 2. Evaluate; new values of a recurrent brain are kept behind the value vector until all are known.
    first, last = brains.first_node[b], brains.first_node[b + 1]
    recurrent, scratch = brains.recurrent[b], brains.size[b] - first
    for node in range(first, last):
        total = 0.0
        for edge in range(brains.edge_start[node], brains.edge_start[node + 1]):
            total += memory[brains.edge_source[edge]] * brains.edge_weight[edge]
        value = _activation(brains.activation[node], brains.bias[node] + brains.response[node] * total)
        memory[scratch + node if recurrent else brains.node_slot[node]] = value
    if recurrent:
        for node in range(first, last):
            memory[brains.node_slot[node]] = memory[scratch + node]
    # 3. Act.
    for i in range(action.size):
        action[i] = memory[brains.output_slot[b, i]]


@compiled_lean
def _activation(code, value):  # type: ignore[no-untyped-def]
    """neat-python's functions, with its scaling and clipping; `code` indexes `exneat_cli.algorithms.ACTIVATIONS`."""
    if code == 0:
        return math.tanh(max(-60.0, min(60.0, 2.5 * value)))
    if code == 1:
        return value if value > 0.0 else 0.0
    if code == 2:
        return 1.0 / (1.0 + math.exp(-max(-60.0, min(60.0, 5.0 * value))))
    if code == 4:
        return max(-1.0, min(1.0, value))
    return value
