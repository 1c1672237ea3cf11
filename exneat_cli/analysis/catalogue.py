"""The catalogue of figures and tables: what experiments/catalogue.yaml may contain, and what is built from an entry."""

from __future__ import annotations

import difflib
import re
from pathlib import Path
from typing import Annotated, NamedTuple

import msgspec

from exneat_cli.analysis.curve_values import Strip
from exneat_cli.errors import ExneatError, check_choice, check_section
from exneat_cli.records import converted, read_yaml

FIGURE_KINDS = ("training", "training_runs", "robustness", "cluster", "area", "network")
QUANTITIES = ("training", "test", "full_reward", "efficiency", "robustness")
VALUES = ("fitness", "full_reward")


class Panel(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One set of axes of a figure.

    Attributes:
        experiment, condition: where its runs come from.
        sweep: name of the robustness sweep on the horizontal axis; needed by robustness and cluster.
        value: one of `VALUES`, on the vertical axis.
        highest: levels above it are left out.
        variant: whose champion a network panel shows; needed there.
    """

    experiment: str
    condition: str
    sweep: str | None = None
    value: str = "fitness"
    highest: float | None = None
    variant: str | None = None

    def __post_init__(self) -> None:
        check_choice("value", self.value, VALUES)


class FigurePlan(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One figure: name (also of its files), kind (of `FIGURE_KINDS`), title, and panels from left to right.

    Of the trained variants it shows those in `variants`, or all if that is empty.
    """

    name: str
    kind: str
    title: str
    panels: Annotated[tuple[Panel, ...], msgspec.Meta(min_length=1)]
    variants: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        needed = {"robustness": "sweep", "cluster": "sweep", "network": "variant"}.get(self.kind)
        if needed and any(getattr(panel, needed) is None for panel in self.panels):
            raise ValueError(f"a panel of kind {self.kind} needs a {needed}")


class Column(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What one column of a table shows.

    Attributes:
        of: ``training`` (final best so far), ``test`` and ``full_reward`` (of the champion on the test episodes),
            ``efficiency`` (first generation, from 1, at which the mean best so far reaches the final mean of the first
            variant), or ``robustness``.
        sweep, level, value: of a robustness sweep, with one of `VALUES`; needed there alone.
        minus: a variant whose mean in the same condition is subtracted, e.g. a baseline.
    """

    of: str
    sweep: str | None = None
    level: float | None = None
    value: str = "fitness"
    minus: str | None = None

    def __post_init__(self) -> None:
        check_choice("of", self.of, QUANTITIES)
        check_choice("value", self.value, VALUES)
        if self.of == "robustness" and (self.sweep is None or self.level is None):
            raise ValueError("a column of robustness needs a sweep and a level")


class TableRow(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One variant in one condition; `published` holds what the thesis prints, by column, numbers or e.g. ``>20``."""

    experiment: str
    condition: str
    variant: str
    published: dict[str, int | float | str] = {}


class TablePlan(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="kind", tag="table"):
    """One table: name (also of its files), title, columns by name, rows from top to bottom, and a note below."""

    name: str
    title: str
    columns: Annotated[dict[str, Column], msgspec.Meta(min_length=1)]
    rows: Annotated[tuple[TableRow, ...], msgspec.Meta(min_length=1)]
    note: str = ""

    def __post_init__(self) -> None:
        for row in self.rows:
            for column in row.published:
                check_choice("published", column, tuple(self.columns))


class Built(NamedTuple):
    """One figure or table on disk.

    Attributes:
        name, title, caption: what it is called, what it shows in a few words, and the sentences below it.
        paths: its files.
        header, rows: the cells of a table, as printed; empty for a figure.
        strips: which values are where on the picture of a figure.
    """

    name: str
    title: str
    caption: str
    paths: tuple[Path, ...]
    header: tuple[str, ...] = ()
    rows: tuple[tuple[str, ...], ...] = ()
    strips: tuple[Strip, ...] = ()


def read_catalogue(path: Path) -> dict[str, FigurePlan | TablePlan]:
    """Read every figure and table, by name and in the order of the file.

    Raises:
        ExneatError: the file is missing, or an entry lacks something, has too much or makes no sense.
    """
    plans: dict[str, FigurePlan | TablePlan] = {}
    for name, entry in read_yaml(path).items():
        try:
            kind = check_section("entry", entry).get("kind")
            check_choice("kind", kind, (*FIGURE_KINDS, "table"))
            schema: type[FigurePlan | TablePlan] = TablePlan if kind == "table" else FigurePlan
            plans[str(name)] = converted({**entry, "name": str(name)}, schema, "")
        except ExneatError as error:
            raise ExneatError(f"{path}: {name}: {error}{_nearest(str(error))}") from error
    return plans


def _nearest(message: str) -> str:
    """For a message about an unknown key: what was probably meant."""
    unknown = re.search(r"(?:(\w+)\[.*\]: )?object contains unknown field (.*)", message)
    if not unknown:
        return ""
    part = {"panels": Panel, "columns": Column, "rows": TableRow}.get(unknown[1])
    known = part.__struct_fields__ if part else {*FigurePlan.__struct_fields__, *TablePlan.__struct_fields__}
    return f"; the nearest valid one is {difflib.get_close_matches(unknown[2], sorted(known), n=1, cutoff=0.0)[0]}"
