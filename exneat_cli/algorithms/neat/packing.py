"""Many genomes as a few columns, for files that a run goes on from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import neat
import numpy as np
from numpy.typing import NDArray

from exneat_cli.algorithms.neat.conversion import stock_genome, tables_of
from exneat_cli.algorithms.neat.genes import ACTIVATIONS, CONNECTION, NODE, end_to_end
from exneat_cli.algorithms.neat.genome import ArrayGenome
from exneat_cli.algorithms.neat.soundness import check_genes

Columns = dict[str, NDArray[Any]]

_SIZES = {"id": np.dtype(np.int64), "nodes": np.dtype(np.int64), "connections": np.dtype(np.int64)}


def pack(genomes: Sequence[ArrayGenome | neat.DefaultGenome]) -> Columns:
    """Ids and numbers of genes, one entry per genome, and every field of all genes end to end, in their order."""
    tables = [tables_of(genome) for genome in genomes]
    nodes = end_to_end((own for own, _ in tables), NODE)
    connections = end_to_end((own for _, own in tables), CONNECTION)
    return {
        "id": np.array([genome.key for genome in genomes], np.int64),
        "nodes": np.array([len(own) for own, _ in tables], np.int64),
        "connections": np.array([len(own) for _, own in tables], np.int64),
        **{f"node.{name}": np.ascontiguousarray(nodes[name]) for name in NODE.names or ()},
        **{f"connection.{name}": np.ascontiguousarray(connections[name]) for name in CONNECTION.names or ()},
    }


def unpack(columns: Mapping[str, NDArray[Any]], kind: type[Any] = ArrayGenome) -> list[Any]:
    """The genomes that `pack` was given.

    Args:
        columns: from `pack`, or from a file of anyone's.
        kind: the genomes' class.

    Raises:
        KeyError, ValueError: a column is missing, of the wrong type or length, or the genes make no genome.
    """
    sizes = {name: _column(columns, name, dtype, None) for name, dtype in _SIZES.items()}
    if len({len(column) for column in sizes.values()}) != 1 or any((column < 0).any() for column in sizes.values()):
        raise ValueError("expected an id and numbers of nodes and connections of every genome")
    if len(np.unique(sizes["id"])) < len(sizes["id"]):
        raise ValueError("expected genomes with different ids")
    nodes = _table(columns, "node", NODE, int(sizes["nodes"].sum()))
    connections = _table(columns, "connection", CONNECTION, int(sizes["connections"].sum()))
    own_nodes = np.split(nodes, np.cumsum(sizes["nodes"])[:-1])
    own_connections = np.split(connections, np.cumsum(sizes["connections"])[:-1])
    return [
        _genome(kind, key, *own) for key, *own in zip(sizes["id"].tolist(), own_nodes, own_connections, strict=True)
    ]


def columns_of(arrays: Mapping[str, NDArray[Any]], prefix: str) -> Columns:
    """The columns whose names begin with ``prefix.``, without it."""
    start = f"{prefix}."
    return {name.removeprefix(start): column for name, column in arrays.items() if name.startswith(start)}


def _table(columns: Mapping[str, NDArray[Any]], prefix: str, dtype: np.dtype[np.void], length: int) -> NDArray[np.void]:
    table = np.zeros(length, dtype)
    for name in dtype.names or ():
        table[name] = _column(columns, f"{prefix}.{name}", dtype[name], length)
        if not np.isfinite(table[name]).all():
            raise ValueError(f"{prefix}.{name}: expected finite numbers")
    return table


def _column(columns: Mapping[str, NDArray[Any]], name: str, dtype: np.dtype[Any], length: int | None) -> NDArray[Any]:
    column = columns[name]
    if column.ndim != 1 or column.dtype != dtype or (length is not None and len(column) != length):
        raise ValueError(f"{name}: expected {length} numbers of type {dtype}, got {column.dtype} {column.shape}")
    return column


def _genome(kind: type[Any], key: int, nodes: NDArray[np.void], connections: NDArray[np.void]) -> Any:
    _check(key, nodes, connections, in_order=issubclass(kind, ArrayGenome))
    if not issubclass(kind, ArrayGenome):
        return stock_genome(key, nodes, connections, kind)
    genome = kind(key)
    genome.nodes, genome.connections = nodes.copy(), connections.copy()
    return genome


def _check(key: int, nodes: NDArray[np.void], connections: NDArray[np.void], *, in_order: bool) -> None:
    check_genes(key, nodes, connections)
    if in_order:
        ordered = np.lexsort((connections["source"], connections["target"]))
        if (np.diff(nodes["key"]) < 0).any() or (np.diff(ordered) < 0).any():
            raise ValueError(f"genome {key}: genes are out of order")
    if not ((nodes["activation"] >= 0) & (nodes["activation"] < len(ACTIVATIONS))).all():
        raise ValueError(f"genome {key}: a node has an activation that does not exist")
