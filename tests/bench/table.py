"""The table, printed for people and written as CSV."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from exneat_cli.records import write_csv
from tests.bench.measurement import Row

COLUMNS = ("comparison", "unit", "median", "min", "max", "repetitions", "bar", "verdict", "note")


def _cells(row: Row) -> tuple[object, ...]:
    figures = (row.median, min(row.values), max(row.values))
    return (row.comparison, row.unit, *figures, len(row.values), str(row.bar or "-"), row.verdict, row.note)


def print_table(rows: Sequence[Row]) -> None:
    """Print all rows in aligned columns, figures to two decimals, small ones to four."""
    lines = [COLUMNS, *(tuple(_shown(c) for c in _cells(row)) for row in rows)]
    widths = [max(len(line[k]) for line in lines) for k in range(len(COLUMNS))]
    figures = {COLUMNS.index(name) for name in ("median", "min", "max", "repetitions")}
    for line in lines:
        cells = (c.rjust(w) if k in figures else c.ljust(w) for k, (c, w) in enumerate(zip(line, widths, strict=True)))
        print("  ".join(cells).rstrip())


def write_table(path: Path, rows: Sequence[Row]) -> None:
    """Write all rows, every digit kept; the folder is made if absent."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_csv(path, COLUMNS, [_cells(row) for row in rows])


def _shown(cell: object) -> str:
    if not isinstance(cell, float):
        return str(cell)
    return f"{cell:.2f}" if abs(cell) >= 1.0 else f"{cell:.4f}"
