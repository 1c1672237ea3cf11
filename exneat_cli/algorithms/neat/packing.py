"""Many genomes as a few columns, for files that a run goes on from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import neat
import numpy as np
from numpy.typing import NDArray

from exneat_cli.algorithms.neat.conversion import tables_of, to_stock
from exneat_cli.algorithms.neat.genes import CONNECTION, NODE, end_to_end
from exneat_cli.algorithms.neat.genome import ArrayGenome
from exneat_cli.algorithms.neat.soundness import check_genes, check_genome

Columns = Mapping[str, NDArray[Any]]
_WHOLE = np.dtype(np.int64)


def pack(genomes: Sequence[ArrayGenome | neat.DefaultGenome], prefix: str) -> dict[str, NDArray[Any]]:
    """Ids and numbers of genes, one entry per genome, and every field of all genes end to end, in their order.

    The names of all columns begin with ``prefix.``.
    """
    columns = {f"{prefix}.id": np.array([genome.key for genome in genomes], _WHOLE)}
    tables = zip(*(tables_of(genome) for genome in genomes), strict=True)
    for (kind, dtype), own in zip((("node", NODE), ("connection", CONNECTION)), tables, strict=True):
        genes = end_to_end(own, dtype)
        columns[f"{prefix}.{kind}s"] = np.array([len(table) for table in own], _WHOLE)
        columns |= {f"{prefix}.{kind}.{name}": np.ascontiguousarray(genes[name]) for name in dtype.names or ()}
    return columns


def unpack(
    columns: Columns, prefix: str, shape: tuple[int, int, int], *, feed_forward: bool, stock: bool = False
) -> list[Any]:
    """The genomes that `pack` was given.

    Args:
        columns: from `pack`, or from a file of anyone's.
        prefix: as it was.
        shape: of the networks that they must make: inputs, initial hidden nodes and outputs.
        feed_forward: whether these must have no cycle.
        stock: whether the genomes are neat-python's own, else they are in arrays.

    Raises:
        KeyError, ValueError: a column is missing, of the wrong type or length, or the genes make no such network.
    """
    keys = _column(columns, f"{prefix}.id", _WHOLE)
    if len(np.unique(keys)) < len(keys):
        raise ValueError(f"{prefix}.id: expected genomes with different ids")
    nodes = _tables(columns, f"{prefix}.node", NODE, len(keys))
    connections = _tables(columns, f"{prefix}.connection", CONNECTION, len(keys))
    genomes = []
    for key, own_nodes, own_connections in zip(keys.tolist(), nodes, connections, strict=True):
        genome = ArrayGenome(key)
        genome.nodes, genome.connections = own_nodes.copy(), own_connections.copy()
        check_genes(key, own_nodes, own_connections)
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
