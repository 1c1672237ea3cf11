"""One table per experiment: every variant in every condition that has been run."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from exneat_cli.analysis import captions
from exneat_cli.analysis.artefacts import Built
from exneat_cli.analysis.catalogue import Column
from exneat_cli.analysis.quantities import efficiency_of, per_run
from exneat_cli.analysis.statistics import Summary, compare
from exneat_cli.analysis.study import MissingRunsError, Study
from exneat_cli.analysis.table_files import decimals_for, figure_cell, interval_cell, p_cell, write_table

_COLUMNS = {
    "training": Column(of="training"),
    "test": Column(of="test"),
    "full_reward": Column(of="test", value="full_reward"),
}
_VERDICT = ("test_p_holm", "test_a12", "efficiency")


@dataclass(frozen=True)
class _Line:
    """One variant in one condition, both by label; `summaries` are by the names of `_COLUMNS`."""

    condition: str
    variant: str
    runs: int
    summaries: dict[str, Summary]
    efficiency: str


def build_comparison(study: Study, directory: Path) -> Built:
    """Write ``comparison-<experiment>.csv`` and ``.md``: one line per condition and variant, trained or not.

    Conditions without a finished run are left out. Where the first variant has none, nothing is compared with it.

    Args:
        study: what was run.
        directory: where the files go; made if need be.

    Raises:
        MissingRunsError: no run is finished at all.
        ExneatError: a file cannot be written.
    """
    conditions = [c for c in study.conditions if any(study.of(c, variant) for variant in study.variants)]
    if not conditions:
        raise MissingRunsError(
            f"{study.experiment}, budget {study.budget}: no finished run to compare\n  {study.command}"
        )
    names = [name for name in _COLUMNS if name != "full_reward" or study.has_full_reward]
    lines = [line for condition in conditions for line in _lines(study, condition, names)]
    decimals = {name: decimals_for(_printed(lines, name)) for name in names}
    table = Built(
        name=f"comparison-{study.experiment}",
        title=f"All variants of {study.experiment}",
        caption=" ".join(filter(None, _sentences(study, conditions, names))),
        paths=(),
        header=_header(names),
        rows=tuple(_cells(line, decimals) for line in lines),
    )
    return write_table(directory, table, _csv_header(names), [_exact(line, names) for line in lines])


def _lines(study: Study, condition: str, names: Sequence[str]) -> Iterator[_Line]:
    compared = {}
    for name in names:
        values = {
            variant: list(per_run(study, condition, variant, _COLUMNS[name]).values()) for variant in study.variants
        }
        compared[name] = compare(values, study.baselines)
    for variant, label in study.variants.items():
        yield _Line(
            condition=study.conditions[condition],
            variant=label,
            runs=len(study.of(condition, variant)),
            summaries={name: compared[name][variant] for name in names},
            efficiency=efficiency_of(study, condition, variant),
        )


def _printed(lines: Sequence[_Line], name: str) -> Iterator[float]:
    for line in lines:
        summary = line.summaries[name]
        yield from (summary.mean, summary.iqm, *summary.interval)


def _header(names: Sequence[str]) -> tuple[str, ...]:
    figures = [cell for name in names for cell in (name.replace("_", " "), "95% interval")]
    return ("condition", "variant", "runs", *figures, "test IQM", "test p (Holm)", "test A12", "efficiency")


def _cells(line: _Line, decimals: dict[str, int]) -> tuple[str, ...]:
    figures = [
        cell
        for name, each in line.summaries.items()
        for cell in (figure_cell(each.mean, decimals[name]), interval_cell(each.interval, decimals[name]))
    ]
    test = line.summaries["test"]
    verdict = (figure_cell(test.iqm, decimals["test"]), p_cell(test.p), figure_cell(test.a12, 2), line.efficiency)
    return (line.condition, line.variant, str(line.runs), *figures, *verdict)


def _csv_header(names: Sequence[str]) -> tuple[str, ...]:
    figures = [f"{name}_{figure}" for name in names for figure in ("mean", "low", "high", "iqm")]
    return ("condition", "variant", "runs", *figures, *_VERDICT)


def _exact(line: _Line, names: Sequence[str]) -> tuple[object, ...]:
    figures = [
        figure for each in (line.summaries[name] for name in names) for figure in (each.mean, *each.interval, each.iqm)
    ]
    test = line.summaries["test"]
    return (line.condition, line.variant, line.runs, *figures, test.p, test.a12, line.efficiency)


def _sentences(study: Study, conditions: Sequence[str], names: Sequence[str]) -> Iterator[str]:
    trained = [len(study.of(condition, variant)) for condition in conditions for variant in study.trained_variants]
    yield captions.runs_sentence(study, conditions, study.variants)
    yield captions.quantity_sentence(study, names)
    yield captions.interval_sentence()
    yield captions.few_runs_sentence(min((runs for runs in trained if runs), default=math.inf))
    yield captions.test_sentence(study)
    yield captions.efficiency_sentence(study)
    yield captions.budgets_sentence(study, conditions, study.trained_variants)
