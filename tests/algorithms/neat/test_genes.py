"""Compiled questions to graphs, against neat-python and plain Python."""

from __future__ import annotations

import random
from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from neat.graphs import creates_cycle, required_for_output

from exneat_cli.algorithms.neat.genes import (
    CONNECTION,
    NODE,
    Connections,
    Nodes,
    mark_sources,
    node_row,
    row_of,
    would_close_a_cycle,
)


@st.composite
def graphs(draw: st.DrawFn, acyclic: bool) -> tuple[Nodes, Connections]:
    """Nodes 0 and 1, hidden ones with gaps between their keys, and connections in any pattern."""
    rng = random.Random(draw(st.integers(0, 2**32 - 1)))
    keys = [0, 1, *sorted(rng.sample(range(2, 41), draw(st.integers(0, 7))))]
    places = {key: rng.random() for key in keys}
    density = draw(st.sampled_from([0.0, 0.1, 0.3, 0.6, 1.0]))
    pairs = [(t, s) for t in keys for s in (-2, -1, *keys) if rng.random() < density]
    if acyclic:
        pairs = [(t, s) for t, s in pairs if s < 0 or places[s] < places[t]]
    rows = [(t, s, n, n / 8, rng.random() < 0.7) for n, (t, s) in enumerate(pairs)]
    return np.array([(key, key / 4, 1.0, key % 3) for key in keys], NODE), np.array(rows, CONNECTION)


def rows_of(connections: Connections) -> dict[tuple[int, int], tuple[Any, ...]]:
    return {(row[0], row[1]): row for row in connections.tolist()}


@settings(max_examples=150, deadline=None)
@given(graphs(acyclic=True))
def test_a_connection_closes_a_cycle_where_neat_python_says_so(graph: tuple[Nodes, Connections]) -> None:
    nodes, connections = graph
    pairs = [(source, target) for target, source in rows_of(connections)]
    for target in nodes["key"].tolist():
        for source in (-1, -2, *nodes["key"].tolist()):
            ours = would_close_a_cycle(nodes, connections, target, source)
            assert ours == creates_cycle(pairs, (source, target))


@settings(max_examples=150, deadline=None)
@given(graphs(acyclic=False), st.booleans())
def test_nodes_that_lead_to_outputs_are_those_that_neat_python_requires(
    graph: tuple[Nodes, Connections], only_enabled: bool
) -> None:
    nodes, connections = graph
    marked = nodes["key"] < 2
    mark_sources(nodes, connections, marked, only_enabled)
    followed = [(row[1], row[0]) for row in connections.tolist() if row[4] or not only_enabled]
    assert set(nodes["key"][marked].tolist()) == required_for_output([-1, -2], [0, 1], followed)


@settings(max_examples=100, deadline=None)
@given(graphs(acyclic=False))
def test_rows_are_found_where_they_are_and_nowhere_else(graph: tuple[Nodes, Connections]) -> None:
    nodes, connections = graph
    keys, pairs = nodes["key"].tolist(), list(rows_of(connections))
    for target in range(-1, 42):
        assert node_row(nodes, target) == (keys.index(target) if target in keys else -1)
        for source in (-3, -2, -1, 0, 1, 5, 40, 41):
            assert row_of(connections, target, source) == sum(pair < (target, source) for pair in pairs)
