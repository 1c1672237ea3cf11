"""What a genome consists of: two tables, one row per gene.

Rows are sorted, nodes by `key` and connections by (`target`, `source`): two genomes are compared and crossed
in one pass, and a network finds the connections into a node side by side.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

ACTIVATIONS = ("tanh", "relu", "sigmoid", "identity")
"""neat-python's names; a node gene holds the index."""

NODE = np.dtype(
    [("key", np.int64), ("bias", np.float64), ("response", np.float64), ("activation", np.int64)], align=True
)
"""Outputs have the keys 0, 1, ...; then come initial hidden nodes, then those that mutations added."""

CONNECTION = np.dtype(
    [
        ("target", np.int64),
        ("source", np.int64),
        ("innovation", np.int64),
        ("weight", np.float64),
        ("enabled", np.bool_),
    ],
    align=True,
)
"""`source` is a node's key, or -1 - k for input pin k. `innovation` numbers the mutation that it began with."""

Nodes = NDArray[np.void]
Connections = NDArray[np.void]
Genes = tuple[Nodes, Connections]
"""All genes of one genome."""


def end_to_end(tables: Iterable[NDArray[np.void]], kind: np.dtype[np.void]) -> NDArray[np.void]:
    """All rows of all tables, which are of this kind; bytes are copied, where NumPy would go field by field."""
    return np.frombuffer(bytearray().join(table.data for table in tables), kind)
