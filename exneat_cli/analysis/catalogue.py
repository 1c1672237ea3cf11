"""The catalogue of figures and tables: data, read from experiments/catalogue.yaml and checked."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from exneat_cli.errors import ExneatError, check_choice
from exneat_cli.records import read_yaml

FIGURE_KINDS = ("training", "training_runs", "robustness", "cluster", "area", "network")
QUANTITIES = ("training", "test", "efficiency", "robustness")
VALUES = ("fitness", "full_reward")
_Part = TypeVar("_Part")


@dataclass(frozen=True)
class Panel:
    """One set of axes of a figure.

    Attributes:
        experiment, condition: where its runs come from.
        sweep: name of the robustness sweep on the horizontal axis; needed by robustness and cluster.
        value: ``fitness`` or ``full_reward``.
        highest: levels above it are left out.
        variant: whose champion a network panel shows.
    """

    experiment: str
    condition: str
    sweep: str | None = None
    value: str = "fitness"
    highest: float | None = None
    variant: str | None = None

    def __post_init__(self) -> None:
        check_choice("value", self.value, VALUES)


@dataclass(frozen=True)
class FigurePlan:
    """One figure.

    Attributes:
        name: e.g. ``figure-4.3``; its files are called so.
        kind: one of `FIGURE_KINDS`.
        title: above the picture, and first in its caption.
        panels: from left to right.
        variants: the trained variants that it shows; empty for all.
    """

    name: str
    kind: str
    title: str
    panels: tuple[Panel, ...]
    variants: tuple[str, ...] = ()


@dataclass(frozen=True)
class Column:
    """What one column of a table shows.

    Attributes:
        of: ``training`` (final best so far), ``test`` (the champion on the test episodes), ``efficiency``
            (first generation, from 1, at which the mean best so far reaches the final mean of the first
            variant), or ``robustness``.
        sweep, level, value: which entry of the robustness sweeps.
    """

    of: str
    sweep: str | None = None
    level: float | None = None
    value: str = "fitness"

    def __post_init__(self) -> None:
        check_choice("of", self.of, QUANTITIES)
        check_choice("value", self.value, VALUES)


@dataclass(frozen=True)
class TableRow:
    """One variant in one condition; `published` holds what the thesis prints, by column, numbers or e.g. ``>20``."""

    experiment: str
    condition: str
    variant: str
    published: Mapping[str, float | str] = field(default_factory=dict)


@dataclass(frozen=True)
class TablePlan:
    """One table.

    Attributes:
        name: e.g. ``table-5.1``.
        title: above it.
        columns: name -> what it shows.
        rows: from top to bottom.
        note: a sentence below it, or nothing.
    """

    name: str
    title: str
    columns: Mapping[str, Column]
    rows: tuple[TableRow, ...]
    note: str = ""


def read_catalogue(path: Path) -> dict[str, FigurePlan | TablePlan]:
    """Every figure and table by name, in the order of the file.

    Raises:
        ExneatError: the file is missing, or an entry lacks something, has too much or makes no sense.
    """
    artefacts: dict[str, FigurePlan | TablePlan] = {}
    for name, entry in read_yaml(path).items():
        try:
            artefacts[str(name)] = _artefact(str(name), dict(entry))
        except (KeyError, TypeError, ValueError, ExneatError) as error:
            raise ExneatError(f"{path}: {name}: {error}") from error
    return artefacts


def _artefact(name: str, entry: dict[str, Any]) -> FigurePlan | TablePlan:
    kind = entry.pop("kind", None)
    check_choice("kind", kind, (*FIGURE_KINDS, "table"))
    if kind == "table":
        columns = {str(key): _build(Column, value) for key, value in entry.pop("columns").items()}
        rows = tuple(_build(TableRow, row) for row in entry.pop("rows"))
        return _build(TablePlan, {"name": name, "columns": columns, "rows": rows, **entry})
    panels = tuple(_panel(kind, panel) for panel in _some(entry.pop("panels")))
    variants = tuple(entry.pop("variants", ()))
    return _build(FigurePlan, {"name": name, "kind": kind, "panels": panels, "variants": variants, **entry})


def _panel(kind: str, values: Mapping[str, Any]) -> Panel:
    panel = _build(Panel, values)
    if kind in ("robustness", "cluster") and panel.sweep is None:
        raise ValueError(f"a panel of kind {kind} needs a sweep")
    if kind == "network" and panel.variant is None:
        raise ValueError("a panel of kind network needs a variant")
    return panel


def _some(panels: Sequence[Any]) -> Sequence[Any]:
    if not panels:
        raise ValueError("expected at least one panel")
    return panels


def _build(part: type[_Part], values: Mapping[str, Any]) -> _Part:
    known = [f.name for f in dataclasses.fields(part)]  # type: ignore[arg-type]
    unknown = [key for key in values if key not in known]
    if unknown:
        raise ValueError(f"{unknown[0]}: unknown key; known here: {', '.join(known)}")
    return part(**values)
