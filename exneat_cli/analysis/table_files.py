"""Cells of tables, and a table as CSV for machines and as Markdown for people."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Sequence
from pathlib import Path

from exneat_cli.analysis.artefacts import Built
from exneat_cli.analysis.statistics import Interval
from exneat_cli.records import make_directory, write_csv, write_whole

LARGE = 10.0
"""Where figures reach this, one decimal says enough; a share between 0 and 1 needs three."""


def decimals_for(values: Iterable[float]) -> int:
    """How many decimals all figures of one kind are printed with."""
    return 1 if max((abs(value) for value in values if math.isfinite(value)), default=0.0) >= LARGE else 3


def figure_cell(value: float, decimals: int) -> str:
    """A rounded figure; nothing for NaN."""
    if math.isnan(value):
        return ""
    # Adding zero turns a rounded -0.0 into 0.0.
    return f"{round(value, decimals) + 0.0:.{decimals}f}"


def interval_cell(interval: Interval, decimals: int) -> str:
    """Both ends of an interval, rounded; nothing where there is none."""
    if math.isnan(interval.low):
        return ""
    return f"[{figure_cell(interval.low, decimals)}, {figure_cell(interval.high, decimals)}]"


def p_cell(p: float) -> str:
    """A p-value, never rounded to zero; nothing for NaN."""
    return "<0.001" if p < 0.001 else figure_cell(p, 3)


def csv_cell(value: object) -> object:
    """The value with every digit; nothing for NaN or None."""
    return "" if value is None or (isinstance(value, float) and math.isnan(value)) else value


def markdown(title: str, header: Sequence[str], rows: Iterable[Sequence[str]], caption: str) -> str:
    """A page with a title, one table and one paragraph."""
    lines = [f"# {title}", "", _line(header), _line(["---"] * len(header)), *(_line(row) for row in rows)]
    return "\n".join([*lines, "", caption, ""])


def _line(cells: Iterable[str]) -> str:
    return "| " + " | ".join(" ".join(cell.split()).replace("|", "\\|") for cell in cells) + " |"


def write_table(directory: Path, table: Built, columns: Sequence[str], rows: Iterable[Sequence[object]]) -> Built:
    """Write ``<name>.csv`` and ``<name>.md``.

    Args:
        directory: where; made if need be.
        table: name, title, caption and the cells as printed; its paths are ignored.
        columns: names of the columns of the CSV file.
        rows: of the CSV file, with every digit.

    Returns:
        `table` with its paths.

    Raises:
        ExneatError: they cannot be written.
    """
    make_directory(directory)
    exact, readable = directory / f"{table.name}.csv", directory / f"{table.name}.md"
    write_csv(exact, columns, [[csv_cell(value) for value in row] for row in rows])
    write_whole(readable, markdown(f"{table.name}: {table.title}", table.header, table.rows, table.caption))
    return dataclasses.replace(table, paths=(exact, readable))
