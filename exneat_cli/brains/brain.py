"""Whole brains as flat arrays, and the compiled kernel that runs them.

All values live in one vector: the observation first, then the nodes of every module, then a copy of what
links read (feed-forward brains), then a slot that stays 0. Semantics are those of neat-python's networks,
weights and order of summation included.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exneat_cli.compiling import compiled_lean


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
        activation: (N,) indices into `exneat_cli.algorithms.ACTIVATIONS`.
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


class Brains(NamedTuple):
    """Several brains for one task, laid end to end, so that one compiled call can run them all.

    Attributes:
        observation_size: entries of the observation that all were wired for.
        size, recurrent: (B,) of each brain.
        first_node, first_link: (B + 1,) the nodes of brain b are first_node[b] to first_node[b + 1], and so on.
        node_slot, edge_start, edge_source, edge_weight, bias, response, activation: as in `Brain`, nodes and
            edges counted through.
        link_slot, link_source: as in `Brain`, counted through.
        output_slot: (B, A).
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

    def first(self) -> Brain:
        """The first one, which must be the only one."""
        own = {name: value for name, value in self._asdict().items() if name in Brain._fields}
        recurrent = bool(self.recurrent[0])
        return Brain(**{**own, "size": int(self.size[0]), "recurrent": recurrent, "output_slot": self.output_slot[0]})

    def part(self, first: int, last: int) -> Brains:
        """Those from `first` to before `last`, counted from 0 again; their arrays are views where they can be."""
        nodes = slice(int(self.first_node[first]), int(self.first_node[last]))
        links = slice(int(self.first_link[first]), int(self.first_link[last]))
        edges = slice(int(self.edge_start[nodes.start]), int(self.edge_start[nodes.stop]))
        return Brains(
            observation_size=self.observation_size,
            size=self.size[first:last],
            recurrent=self.recurrent[first:last],
            first_node=self.first_node[first : last + 1] - nodes.start,
            first_link=self.first_link[first : last + 1] - links.start,
            node_slot=self.node_slot[nodes],
            edge_start=self.edge_start[nodes.start : nodes.stop + 1] - edges.start,
            edge_source=self.edge_source[edges],
            edge_weight=self.edge_weight[edges],
            bias=self.bias[nodes],
            response=self.response[nodes],
            activation=self.activation[nodes],
            link_slot=self.link_slot[links],
            link_source=self.link_source[links],
            output_slot=self.output_slot[first:last],
        )


def lay_out(brains: Sequence[Brain]) -> Brains:
    """All of `brains` end to end.

    Raises:
        ValueError: there are none, or they were wired for different sizes of observation or action.
    """
    sizes = {(brain.observation_size, len(brain.output_slot)) for brain in brains}
    if len(sizes) != 1:
        raise ValueError(
            f"brains: expected at least one, all of one size of observation and action, got {sorted(sizes)}"
        )

    def joined(field: str) -> NDArray[Any]:
        return np.concatenate([getattr(brain, field) for brain in brains])

    edges = np.cumsum([0] + [len(brain.edge_source) for brain in brains])
    starts = [brain.edge_start[:-1] + first for brain, first in zip(brains, edges[:-1], strict=True)]
    return Brains(
        observation_size=brains[0].observation_size,
        size=np.array([brain.size for brain in brains], np.int64),
        recurrent=np.array([brain.recurrent for brain in brains]),
        first_node=np.cumsum([0] + [len(brain.node_slot) for brain in brains]),
        first_link=np.cumsum([0] + [len(brain.link_slot) for brain in brains]),
        node_slot=joined("node_slot"),
        edge_start=np.concatenate([*starts, edges[-1:]]),
        edge_source=joined("edge_source"),
        edge_weight=joined("edge_weight"),
        bias=joined("bias"),
        response=joined("response"),
        activation=joined("activation"),
        link_slot=joined("link_slot"),
        link_source=joined("link_source"),
        output_slot=np.stack([brain.output_slot for brain in brains]),
    )


def memory_size(brains: Brains) -> int:
    """Room for the value vector of any of `brains` and a scratch entry for each of its nodes."""
    return int(np.max(brains.size + np.diff(brains.first_node)))


@compiled_lean
def activate(brains: Brains, b: int, memory: NDArray[np.float64], action: NDArray[np.float64]) -> None:
    """One step of brain `b`: advance `memory` and write `action`.

    Args:
        brains: see there.
        b: which of them.
        memory: (`memory_size`,), all 0 when an episode starts; its head is the observation of this step.
        action: (A,), overwritten.
    """
    for i in range(brains.first_link[b], brains.first_link[b + 1]):
        memory[brains.link_slot[i]] = memory[brains.link_source[i]]
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
    for i in range(action.size):
        action[i] = memory[brains.output_slot[b, i]]


@compiled_lean
def _activation(code, value):  # type: ignore[no-untyped-def]
    if code == 0:
        return math.tanh(max(-60.0, min(60.0, 2.5 * value)))
    if code == 1:
        return value if value > 0.0 else 0.0
    if code == 2:
        return 1.0 / (1.0 + math.exp(-max(-60.0, min(60.0, 5.0 * value))))
    return value
