"""The tables of the catalogue: published figures beside ours."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from exneat_cli.analysis import captions
from exneat_cli.analysis.artefacts import Built
from exneat_cli.analysis.catalogue import TablePlan, TableRow
from exneat_cli.analysis.quantities import BEST, best_on_validation, efficiency_of, per_run, require_level
from exneat_cli.analysis.statistics import Interval, Summary, compare, mean
from exneat_cli.analysis.study import Study
from exneat_cli.analysis.table_files import decimals_for, figure_cell, interval_cell, p_cell, write_table
from exneat_cli.errors import ExneatError

_NAN = math.nan
_CSV = (
    "condition",
    "variant",
    "quantity",
    "published",
    "mean",
    "low",
    "high",
    "iqm",
    "best_5",
    "runs",
    "p_holm",
    "a12",
)
_NOTHING = Summary(0, _NAN, _NAN, Interval(_NAN, _NAN), _NAN, _NAN)


@dataclass(frozen=True)
class _Line:
    """One row and column of the plan; `efficiency` is empty but for lines of efficiency, which have no summary."""

    condition: str
    variant: str
    quantity: str
    published: str
    runs: int = 0
    summary: Summary = _NOTHING
    best: float = _NAN
    efficiency: str = ""


def build_table(plan: TablePlan, studies: Mapping[str, Study], directory: Path) -> Built:
    """Write one table of the catalogue as ``<name>.csv`` and ``<name>.md``: one line per row and column of the plan.

    Args:
        plan: which variants and quantities.
        studies: by the name of their experiment.
        directory: where the files go; made if need be.

    Raises:
        MissingRunsError: a variant of the table, or the one that it is compared with, lacks runs or a level.
        ExneatError: the plan names something unknown, or a file cannot be written.
    """
    _check(plan, studies)
    _require(plan, studies)
    lines = list(_lines(plan, studies))
    decimals = {name: decimals_for(_printed(lines, name)) for name in plan.columns}
    table = Built(
        name=plan.name,
        title=plan.title,
        caption=" ".join(filter(None, _sentences(plan, studies, min(line.runs for line in lines)))),
        paths=(),
        header=_header(plan),
        rows=tuple(_cells(plan, line, decimals[line.quantity]) for line in lines),
    )
    return write_table(directory, table, _CSV, [_exact(line) for line in lines])


def _check(plan: TablePlan, studies: Mapping[str, Study]) -> None:
    if not plan.rows or not plan.columns:
        raise ExneatError(f"{plan.name}: expected at least one row and one column")
    for name, column in plan.columns.items():
        if column.of == "robustness" and (column.sweep is None or column.level is None):
            raise ExneatError(f"{plan.name}: {name}: expected a sweep and a level, got {column.sweep}, {column.level}")
    for row in plan.rows:
        study = studies.get(row.experiment)
        if study is None:
            raise ExneatError(f"{plan.name}: expected an experiment of {', '.join(studies)}, got {row.experiment!r}")
        _check_known(f"{plan.name}: {row.experiment}", "condition", row.condition, study.conditions)
        _check_known(f"{plan.name}: {row.experiment}", "variant", row.variant, study.variants)
        for column_name in row.published:
            _check_known(f"{plan.name}: published", "column", column_name, plan.columns)


def _check_known(where: str, what: str, name: str, known: Mapping[str, object]) -> None:
    if name not in known:
        raise ExneatError(f"{where}: expected a {what} of {', '.join(known)}, got {name!r}")


def _require(plan: TablePlan, studies: Mapping[str, Study]) -> None:
    for experiment, condition in _places(plan):
        study = studies[experiment]
        variants = [row.variant for row in plan.rows if (row.experiment, row.condition) == (experiment, condition)]
        study.require(condition, dict.fromkeys((next(iter(study.variants)), *variants)))
        for column in plan.columns.values():
            if column.of == "robustness":
                require_level(study, condition, variants, column)


def _places(plan: TablePlan) -> list[tuple[str, str]]:
    """Experiment and condition of all rows, each pair once."""
    return list(dict.fromkeys((row.experiment, row.condition) for row in plan.rows))


def _lines(plan: TablePlan, studies: Mapping[str, Study]) -> Iterator[_Line]:
    values = {
        (*place, name): {
            variant: per_run(studies[place[0]], place[1], variant, column) for variant in studies[place[0]].variants
        }
        for place in _places(plan)
        for name, column in plan.columns.items()
        if column.of != "efficiency"
    }
    summaries = {
        key: compare({variant: list(runs.values()) for variant, runs in variants.items()}, studies[key[0]].baselines)
        for key, variants in values.items()
    }
    for row in plan.rows:
        study = studies[row.experiment]
        for name, column in plan.columns.items():
            line = _Line(
                study.conditions[row.condition], study.variants[row.variant], name, str(row.published.get(name, ""))
            )
            key = (row.experiment, row.condition, name)
            if column.of == "efficiency":
                runs = len(study.of(row.condition, row.variant))
                yield replace(line, runs=runs, efficiency=efficiency_of(study, row.condition, row.variant))
            else:
                best = _mean_of_best(study, row, values[key][row.variant]) if column.of == "robustness" else _NAN
                summary = summaries[key][row.variant]
                yield replace(line, runs=summary.runs, summary=summary, best=best)


def _mean_of_best(study: Study, row: TableRow, by_seed: Mapping[int, float]) -> float:
    seeds = [seed for seed in best_on_validation(study, row.condition, row.variant) if seed in by_seed]
    return mean([by_seed[seed] for seed in seeds[:BEST]])


def _printed(lines: Sequence[_Line], quantity: str) -> Iterator[float]:
    for line in lines:
        if line.quantity == quantity:
            yield from (line.summary.mean, line.summary.iqm, *line.summary.interval, line.best)


def _has_robustness(plan: TablePlan) -> bool:
    return any(column.of == "robustness" for column in plan.columns.values())


def _header(plan: TablePlan) -> tuple[str, ...]:
    best = (f"ours, best {BEST}",) if _has_robustness(plan) else ()
    figures = ("published", "ours (mean)", "95% interval", "IQM", *best)
    return ("condition", "variant", "quantity", *figures, "runs", "p (Holm)", "A12")


def _cells(plan: TablePlan, line: _Line, decimals: int) -> tuple[str, ...]:
    summary = line.summary
    best = (figure_cell(line.best, decimals),) if _has_robustness(plan) else ()
    ours = line.efficiency or figure_cell(summary.mean, decimals)
    figures = (line.published, ours, interval_cell(summary.interval, decimals), figure_cell(summary.iqm, decimals))
    verdict = (str(line.runs), p_cell(summary.p), figure_cell(summary.a12, 2))
    return (line.condition, line.variant, line.quantity, *figures, *best, *verdict)


def _exact(line: _Line) -> tuple[object, ...]:
    summary = line.summary
    figures = (line.efficiency or summary.mean, *summary.interval, summary.iqm, line.best)
    place = (line.condition, line.variant, line.quantity, line.published)
    return (*place, *figures, line.runs, summary.p, summary.a12)


def _sentences(plan: TablePlan, studies: Mapping[str, Study], fewest: int) -> Iterator[str]:
    quantities = [column.of for column in plan.columns.values()]
    for experiment in dict.fromkeys(row.experiment for row in plan.rows):
        study = studies[experiment]
        rows = [row for row in plan.rows if row.experiment == experiment]
        conditions = list(dict.fromkeys(row.condition for row in rows))
        variants = list(dict.fromkeys(row.variant for row in rows))
        yield captions.runs_sentence(study, conditions, variants)
        if study.budget != "paper" and any(row.published for row in rows):
            yield "The published figures rest on a larger budget."
        yield captions.quantity_sentence(study, quantities)
        yield captions.interval_sentence()
        yield captions.few_runs_sentence(fewest)
        yield captions.test_sentence(study)
        if "efficiency" in quantities:
            yield captions.efficiency_sentence(study)
            yield "Published efficiencies are not exactly comparable."
        yield captions.budgets_sentence(study, conditions, variants)
    if _has_robustness(plan):
        yield f"Best {BEST}: mean over the {BEST} runs that are best on validation, or all if there are fewer."
    yield plan.note
