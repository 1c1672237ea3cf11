"""Compiled questions and changes to graphs, against neat-python and plain Python."""

from __future__ import annotations

import random
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from neat.genome import get_pruned_genes
from neat.graphs import creates_cycle, required_for_output

from exneat_cli.algorithms import ArrayGenome, from_stock, to_stock
from exneat_cli.algorithms.neat.genes import CONNECTION, NODE, Connections, Nodes
from exneat_cli.algorithms.neat.structure import (
    is_connected,
    mark_sources,
    node_row,
    pruned,
    row_of,
    with_connection,
    with_node,
    without_connection,
    without_node,
    would_close_a_cycle,
)
from tests.algorithms.neat.genomes import assert_equal, assert_sound, genome_of, lively, relatives, seeded_config


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
            assert is_connected(connections, target, source) == ((target, source) in pairs)
            assert row_of(connections, target, source) == sum(pair < (target, source) for pair in pairs)


@settings(max_examples=100, deadline=None)
@given(graphs(acyclic=False), st.randoms(use_true_random=False))
def test_connections_added_in_any_order_make_the_same_sorted_table(
    graph: tuple[Nodes, Connections], shuffler: random.Random
) -> None:
    _, connections = graph
    rows = connections.tolist()
    shuffler.shuffle(rows)
    table = np.zeros(0, CONNECTION)
    for row in rows:
        before = table.copy()
        longer = with_connection(table, *row)
        np.testing.assert_array_equal(table, before)
        table = longer
    np.testing.assert_array_equal(table, connections, strict=True)


@settings(max_examples=100, deadline=None)
@given(graphs(acyclic=False), st.data())
def test_a_table_without_one_connection_has_all_others(graph: tuple[Nodes, Connections], data: st.DataObject) -> None:
    _, connections = graph
    if connections.size:
        row = data.draw(st.integers(0, connections.size - 1))
        before = connections.copy()
        shorter = without_connection(connections, row)
        assert shorter.tolist() == before.tolist()[:row] + before.tolist()[row + 1 :]
        np.testing.assert_array_equal(connections, before)


@settings(max_examples=100, deadline=None)
@given(graphs(acyclic=False), st.data())
def test_without_a_node_its_connections_are_gone_and_no_others(
    graph: tuple[Nodes, Connections], data: st.DataObject
) -> None:
    nodes, connections = graph
    row = data.draw(st.integers(0, nodes.size - 1))
    key = int(nodes["key"][row])
    fewer_nodes, fewer_connections = without_node(nodes, connections, row)
    assert fewer_nodes.tolist() == [node for node in nodes.tolist() if node[0] != key]
    assert fewer_connections.tolist() == [row for row in connections.tolist() if key not in row[:2]]


def test_a_node_more_comes_last_and_leaves_the_others_alone() -> None:
    nodes = np.array([(0, 0.5, 1.0, 1), (3, -0.5, 2.0, 0)], NODE)
    longer = with_node(nodes, 7, 0.25, 1.5, 2)
    assert longer.tolist() == [*nodes.tolist(), (7, 0.25, 1.5, 2)]


@settings(max_examples=150, deadline=None)
@given(graphs(acyclic=False))
def test_pruning_leaves_what_neat_pythons_leaves(graph: tuple[Nodes, Connections]) -> None:
    nodes, connections = graph
    genome = genome_of(nodes.tolist(), connections.tolist())
    stock = to_stock(genome)
    kept_nodes, kept_connections = get_pruned_genes(stock.nodes, stock.connections, [-1, -2], [0, 1])
    ours = genome_of(*(table.tolist() for table in pruned(nodes, connections, 2)))
    stock.nodes, stock.connections = kept_nodes, kept_connections
    assert_equal(ours, from_stock(stock))


@pytest.mark.parametrize("column", ["ant", "grid"])
def test_pruned_copies_of_relatives_are_neat_pythons(request: pytest.FixtureRequest, column: str) -> None:
    config = seeded_config(lively(request.getfixturevalue(f"{column}_settings")), (3, 2, 2), 5)
    genomes = relatives(config, 40, 500)
    smaller = 0
    for genome in genomes:
        nodes, connections = genome.nodes.copy(), genome.connections.copy()
        copy = genome.get_pruned_copy(config.genome_config)
        assert isinstance(copy, ArrayGenome)
        assert_sound(copy)
        assert_equal(copy, from_stock(to_stock(genome).get_pruned_copy(config.genome_config)))
        smaller += copy.nodes.size < nodes.size
        copy.connections["weight"] = 99.0
        copy.nodes["bias"] = 99.0
        np.testing.assert_array_equal(genome.nodes, nodes)
        np.testing.assert_array_equal(genome.connections, connections)
    assert 0 < smaller < len(genomes)
