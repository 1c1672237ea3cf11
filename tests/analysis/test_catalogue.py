"""Entries of a catalogue: what they become, and how one that makes no sense is refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from exneat_cli.analysis.catalogue import FigurePlan, Panel, TablePlan, read_catalogue
from exneat_cli.errors import ExneatError

FIGURE = "figure-9.1: {kind: training, title: F, panels: [{experiment: track, condition: calm}]}"
TABLE = (
    "table-9.1: {kind: table, title: T, columns: {a: {of: test}},"
    " rows: [{experiment: track, condition: calm, variant: neat, published: {a: 7}}]}"
)


def written(directory: Path, text: str) -> Path:
    path = directory / "catalogue.yaml"
    path.write_text(text)
    return path


def test_figures_and_tables_are_read_in_the_order_of_the_file(tmp_path: Path) -> None:
    table, figure = read_catalogue(written(tmp_path, f"{TABLE}\n{FIGURE}\n")).values()
    assert figure == FigurePlan("figure-9.1", "training", "F", (Panel("track", "calm"),))
    assert isinstance(table, TablePlan)
    assert str(table.rows[0].published["a"]) == "7"


@pytest.mark.parametrize(
    ("entry", "old", "new", "named"),
    [
        (FIGURE, "training", "trainin", "kind: expected one of training, training_runs, .*, got 'trainin'"),
        (FIGURE, "title", "titel", "unknown field titel; the nearest valid one is title"),
        (
            FIGURE,
            "condition:",
            "conditon:",
            r"panels\[0\]: .* unknown field conditon; the nearest valid one is condition",
        ),
        (FIGURE, ", title: F", "", "missing required field title"),
        (FIGURE, "[{experiment: track, condition: calm}]", "[]", r"panels: expected a list of length >= 1, got \[\]"),
        (FIGURE, "calm", "calm, value: fit", "value: expected one of fitness, full_reward, got 'fit'"),
        (FIGURE, "training", "cluster", "a panel of kind cluster needs a sweep"),
        (FIGURE, "training", "network", "a panel of kind network needs a variant"),
        (TABLE, "of: test", "of: tests", "of: expected one of training, test, .*, got 'tests'"),
        (TABLE, "of: test", "of: robustness, level: 1", "a column of robustness needs a sweep and a level"),
        (TABLE, "variant:", "varant:", r"rows\[0\]: .* unknown field varant; the nearest valid one is variant"),
        (TABLE, "a: 7", "b: 7", "published: expected one of a, got 'b'"),
        ("table-9.1: 3", "", "", "expected a section with keys of its own, got 3"),
    ],
)
def test_an_entry_that_makes_no_sense_is_refused_by_its_file_and_name_in_a_line_or_two(
    tmp_path: Path, entry: str, old: str, new: str, named: str
) -> None:
    with pytest.raises(ExneatError, match=rf"catalogue.yaml: \w+-9.1: .*{named}") as raised:
        read_catalogue(written(tmp_path, entry.replace(old, new)))
    assert len(str(raised.value).splitlines()) <= 2
