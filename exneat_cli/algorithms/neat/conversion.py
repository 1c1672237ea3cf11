"""Lossless conversion of array genomes to neat-python's and to columns of a file, and checks of genomes from files."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from graphlib import CycleError, TopologicalSorter
from typing import Any

import neat
import numpy as np
from neat.genes import DefaultConnectionGene, DefaultNodeGene
from numpy.typing import NDArray

from exneat_cli.algorithms.algorithm import Problem, Team
from exneat_cli.algorithms.neat.genes import ACTIVATIONS, CONNECTION, NODE, Connections, Nodes, end_to_end
from exneat_cli.algorithms.neat.genome import ArrayGenome
from exneat_cli.errors import ExneatError

Columns = Mapping[str, NDArray[Any]]
_WHOLE = np.dtype(np.int64)


def from_stock(genome: neat.DefaultGenome) -> ArrayGenome:
    """The same genome in arrays; raises the errors of `tables_of`."""
    nodes, connections = tables_of(genome)
    in_order = np.sort(nodes, order="key"), np.sort(connections, order=["target", "source"])
    converted = ArrayGenome(genome.key, *in_order)
    converted.fitness = genome.fitness
    return converted


def to_stock(genome: ArrayGenome) -> neat.DefaultGenome:
    """The same genome as one of neat-python's, with its genes in the same order."""
    converted = neat.DefaultGenome(genome.key)
    converted.fitness = genome.fitness
    for key, bias, response, activation in genome.nodes.tolist():
        node = DefaultNodeGene(key)
        node.bias, node.response, node.activation = bias, response, ACTIVATIONS[activation]
        node.aggregation, node.time_constant = "sum", 1.0
        converted.nodes[key] = node
    for target, source, innovation, weight, enabled in genome.connections.tolist():
        gene = DefaultConnectionGene((source, target), innovation=innovation)
        gene.weight, gene.enabled = weight, enabled
        converted.connections[source, target] = gene
    return converted


def tables_of(genome: ArrayGenome | neat.DefaultGenome) -> tuple[Nodes, Connections]:
    """Nodes and connections in the genome's own order.

    Raises:
        ExneatError: a node has an activation, aggregation or time constant that arrays do not support.
    """
    if isinstance(genome, ArrayGenome):
        return genome.nodes, genome.connections
    rows = [
        (target, source, gene.innovation, gene.weight, gene.enabled)
        for (source, target), gene in genome.connections.items()
    ]
    return np.array([_node_row(node) for node in genome.nodes.values()], NODE), np.array(rows, CONNECTION)


def _node_row(gene: DefaultNodeGene) -> tuple[int, float, float, int]:
    if gene.aggregation != "sum" or gene.time_constant != 1.0 or gene.activation not in ACTIVATIONS:
        expected = f"aggregation sum, time constant 1 and an activation of {', '.join(ACTIVATIONS)}"
        came = f"{gene.aggregation}, {gene.time_constant} and {gene.activation}"
        raise ExneatError(f"node {gene.key}: expected {expected}, got {came}")
    return gene.key, gene.bias, gene.response, ACTIVATIONS.index(gene.activation)


def check_genes(genome: ArrayGenome) -> None:
    """Refuse a genome whose genes, in any order, do not form a graph.

    Raises:
        ValueError: a node or connection occurs twice, a node's key is below 0, an activation does not exist, or a
            connection has an end that does not exist.
    """
    key, nodes, connections = genome.key, genome.nodes, genome.connections
    keys = set(nodes["key"].tolist())
    ends = list(zip(connections["target"].tolist(), connections["source"].tolist(), strict=True))
    if len(keys) < len(nodes) or min(keys, default=0) < 0:
        raise ValueError(f"genome {key}: expected nodes with different ids of at least 0")
    if not set(nodes["activation"].tolist()) <= set(range(len(ACTIVATIONS))):
        raise ValueError(f"genome {key}: a node has an activation that does not exist")
    if len(set(ends)) < len(ends):
        raise ValueError(f"genome {key}: expected at most one connection between two nodes")
    for target, source in ends:
        if target not in keys or (source >= 0 and source not in keys):
            raise ValueError(f"genome {key}: the connection from {source} to {target} has an end that does not exist")


def check_genome(genome: ArrayGenome, inputs: int, outputs: int, *, feed_forward: bool) -> None:
    """Refuse a genome that has passed `check_genes` but is not a network of this shape.

    Raises:
        ValueError: it reads pins other than -1 to -inputs or lacks one of the nodes 0 to outputs - 1, or it must be
            `feed_forward` and its connections, enabled or not, form a cycle.
    """
    sources = genome.connections["source"]
    if not set(range(outputs)) <= set(genome.nodes["key"].tolist()):
        raise ValueError(f"genome {genome.key}: expected outputs 0 to {outputs - 1}")
    if sources.min(initial=0) < -inputs:
        raise ValueError(f"genome {genome.key}: expected connections from at most {inputs} inputs")
    if feed_forward:
        graph: TopologicalSorter[int] = TopologicalSorter()
        for target, source in zip(genome.connections["target"].tolist(), sources.tolist(), strict=True):
            graph.add(target, source)
        try:
            graph.prepare()
        except CycleError as error:
            expected = "expected a feed-forward network, got one that feeds itself"
            raise ValueError(f"genome {genome.key}: {expected}") from error


def pack(genomes: Sequence[ArrayGenome | neat.DefaultGenome], prefix: str) -> dict[str, NDArray[Any]]:
    """Ids, numbers of genes and any mutation powers of the genomes, and each field of all genes, end to end.

    The names of columns begin with `prefix`.
    """
    columns: dict[str, NDArray[Any]] = {f"{prefix}.id": np.array([genome.key for genome in genomes], _WHOLE)}
    powers = [genome.power for genome in genomes if isinstance(genome, ArrayGenome)]
    if powers and None not in powers:
        columns[f"{prefix}.power"] = np.array(powers, np.float64)
    tables = zip(*(tables_of(genome) for genome in genomes), strict=True)
    for (kind, dtype), own in zip((("node", NODE), ("connection", CONNECTION)), tables, strict=True):
        genes = end_to_end(own, dtype)
        columns[f"{prefix}.{kind}s"] = np.array([len(table) for table in own], _WHOLE)
        columns |= {f"{prefix}.{kind}.{name}": np.ascontiguousarray(genes[name]) for name in dtype.names or ()}
    return columns


def unpack(
    columns: Columns, prefix: str, shape: tuple[int, int, int], *, feed_forward: bool, stock: bool = False
) -> list[Any]:
    """The genomes that were packed by `pack`.

    Args:
        columns: from `pack`, or from an untrusted file.
        prefix: the one given to `pack`.
        shape: required numbers of inputs, initial hidden nodes and outputs of the networks.
        feed_forward: whether networks must not have cycles.
        stock: whether to make neat-python's own genomes rather than array genomes.

    Raises:
        KeyError, ValueError: a column is missing or of the wrong type or length, or genes do not form such a network.
    """
    keys = _column(columns, f"{prefix}.id", _WHOLE)
    if len(np.unique(keys)) < len(keys):
        raise ValueError(f"{prefix}.id: expected genomes with different ids")
    nodes = _tables(columns, f"{prefix}.node", NODE, len(keys))
    connections = _tables(columns, f"{prefix}.connection", CONNECTION, len(keys))
    powers: list[Any] = [None] * len(keys)
    if f"{prefix}.power" in columns:
        powers = _column(columns, f"{prefix}.power", np.dtype(np.float64), len(keys)).tolist()
        if not all(math.isfinite(power) and power > 0.0 for power in powers):
            raise ValueError(f"{prefix}.power: expected finite numbers above 0")
    genomes = []
    for key, power, own_nodes, own_connections in zip(keys.tolist(), powers, nodes, connections, strict=True):
        genome = ArrayGenome(key, own_nodes.copy(), own_connections.copy())
        genome.power = power
        check_genes(genome)
        check_genome(genome, shape[0], shape[2], feed_forward=feed_forward)
        ordered = np.lexsort((own_connections["source"], own_connections["target"]))
        if not stock and ((np.diff(own_nodes["key"]) < 0).any() or (np.diff(ordered) < 0).any()):
            raise ValueError(f"genome {key}: genes are out of order")
        genomes.append(to_stock(genome) if stock else genome)
    return genomes


def _tables(columns: Columns, name: str, dtype: np.dtype[np.void], genomes: int) -> list[NDArray[np.void]]:
    """The genes of one kind, genome by genome."""
    sizes = _column(columns, f"{name}s", _WHOLE, genomes)
    table = np.zeros(_column(columns, f"{name}.{(dtype.names or ())[0]}", dtype[0]).size, dtype)
    if (sizes < 0).any() or int(sizes.sum()) != table.size:
        raise ValueError(f"{name}s: expected sizes that add up to {table.size}")
    for field in dtype.names or ():
        table[field] = _column(columns, f"{name}.{field}", dtype[field], table.size)
        if not np.isfinite(table[field]).all():
            raise ValueError(f"{name}.{field}: expected finite numbers")
    return np.split(table, np.cumsum(sizes)[:-1])


def _column(columns: Columns, name: str, dtype: np.dtype[Any], length: int | None = None) -> NDArray[Any]:
    column = columns[name]
    if column.ndim != 1 or column.dtype != dtype or (length is not None and len(column) != length):
        raise ValueError(f"{name}: expected {length} numbers of type {dtype}, got {column.dtype} {column.shape}")
    return column


def pack_teams(teams: Sequence[Team], prefix: str) -> dict[str, NDArray[Any]]:
    """Ids of the teams' genomes, (T, subpopulations), and each genome once; column names begin with `prefix`."""
    arrays: dict[str, NDArray[Any]] = {f"{prefix}.ids": np.array([team.ids for team in teams], np.int64)}
    for index, genomes in enumerate(zip(*(team.genomes for team in teams), strict=True)):
        arrays |= pack(list({genome.key: genome for genome in genomes}.values()), f"{prefix}.{index}")
    return arrays


def unpack_teams(columns: Columns, prefix: str, problem: Problem) -> list[Team]:
    """The teams that were packed by `pack_teams`, from an untrusted file; their genomes must fit the problem.

    Raises:
        KeyError, ValueError: a column is missing or damaged, or a genome does not fit.
    """
    shapes, ids = problem.plan.subpopulation_shapes, columns[f"{prefix}.ids"]
    if not ids.size:
        return []
    if ids.dtype != np.int64 or ids.shape[1:] != (len(shapes),):
        expected = f"whole numbers, {len(shapes)} of each team"
        raise ValueError(f"{prefix}.ids: expected {expected}, got {ids.dtype} {ids.shape}")
    known: list[dict[int, Any]] = []
    for index, shape in enumerate(shapes):
        genomes = unpack(columns, f"{prefix}.{index}", shape, feed_forward=problem.evolution.feed_forward)
        known.append({genome.key: genome for genome in genomes})
    return [Team(tuple(own[key] for own, key in zip(known, keys, strict=True)), tuple(keys)) for keys in ids.tolist()]
