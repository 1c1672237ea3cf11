"""Tables as CSV for machines and Markdown for people: those of the catalogue, and one comparison per experiment.

Both show lines of a summary, one per condition, variant and quantity: a table of the catalogue one under another,
beside what was published; a comparison with the quantities side by side.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from exneat_cli.analysis.captions import table_sentences
from exneat_cli.analysis.catalogue import Built, Column, TablePlan
from exneat_cli.analysis.statistics import compare, efficiency, mean
from exneat_cli.analysis.study import BEST, MissingRunsError, Study
from exneat_cli.errors import check_choice
from exneat_cli.records import make_directory, write_whole

STATISTICS = ["mean", "low", "high", "iqm", "best_5"]
"""Columns of a summary that are in the unit of their quantity."""
_KEY = ["experiment", "condition", "variant", "quantity"]
_SUMMARY = [*_KEY, "runs", *STATISTICS, "p_holm", "a12", "efficiency"]
LARGE = 10.0
"""Where values reach this, one decimal says enough; a share between 0 and 1 needs three."""
_PLACE = ["condition", "variant", "quantity", "published"]


def build_table(plan: TablePlan, studies: Mapping[str, Study], directory: Path) -> Built:
    """Write ``<name>.csv`` and ``<name>.md`` into `directory`: one line per row and column of the plan.

    Raises:
        MissingRunsError: a variant of the table, or the one that it is compared with, lacks runs or a level.
        ExneatError: the plan names something unknown, or a file cannot be written.
    """
    lines = _planned_lines(plan, studies)
    of = {column.of for column in plan.columns.values()}
    sentences: list[str] = []
    for experiment, own in lines.groupby("experiment", sort=False):
        sentences += table_sentences(studies[str(experiment)], own, of)
    best = {}
    if "robustness" in of:
        best = {"best_5": f"ours, best {BEST}"}
        mean_of_best = f"mean over the {BEST} runs that are best on validation, or all if there are fewer."
        sentences.append(f"Best {BEST}: {mean_of_best}")
    ours = {"mean": "ours (mean)", "interval": "95% interval", "iqm": "IQM", **best}
    headings = {**dict(zip(_PLACE, _PLACE, strict=True)), **ours, "runs": "runs", "p_holm": "p (Holm)", "a12": "A12"}
    labelled = _labelled(lines, studies)
    exact = labelled[[*_PLACE, *STATISTICS, "runs", "p_holm", "a12"]]
    is_number = lines["efficiency"] == ""
    exact = exact.assign(mean=lines["mean"].astype(object).where(is_number, lines["efficiency"]))
    cells = _printed(labelled)[list(headings)].set_axis(list(headings.values()), axis=1)
    caption = " ".join(filter(None, [*sentences, plan.note]))
    return _write(directory, Built(plan.name, plan.title, caption, ()), exact, cells)


def _planned_lines(plan: TablePlan, studies: Mapping[str, Study]) -> pd.DataFrame:
    """The lines of the summary that the plan shows, in its order, with a column ``published``."""
    rows = []
    for row in plan.rows:
        check_choice(f"{plan.name}: experiment", row.experiment, tuple(studies))
        study = studies[row.experiment]
        check_choice(f"{plan.name}: condition of {row.experiment}", row.condition, tuple(study.conditions))
        check_choice(f"{plan.name}: variant of {row.experiment}", row.variant, tuple(study.variants))
        place = (row.experiment, row.condition, row.variant)
        rows += [(*place, name, str(row.published.get(name, ""))) for name in plan.columns]
    planned = pd.DataFrame(rows, columns=[*_KEY, "published"])
    for (experiment, condition), own in planned.groupby(["experiment", "condition"], sort=False):
        study = studies[str(experiment)]
        study.require(str(condition), dict.fromkeys([study.first_variant, *own["variant"]]))
    summaries = [
        _summary(studies[str(experiment)], own["condition"].unique(), plan.columns)
        for experiment, own in planned.groupby("experiment", sort=False)
    ]
    lines = planned.merge(pd.concat(summaries), on=_KEY, how="left")
    swept = [name for name, column in plan.columns.items() if column.of == "robustness"]
    unmeasured = lines[lines["quantity"].isin(swept) & (lines["runs"] == 0)]
    for (experiment, condition, quantity), own in unmeasured.groupby(["experiment", "condition", "quantity"]):
        study, column = studies[str(experiment)], plan.columns[str(quantity)]
        labels = ", ".join(own["variant"].map(study.variants))
        raise study.lacking(str(condition), f"sweep {column.sweep}, level {column.level}: not measured for {labels}")
    return lines


def build_comparison(study: Study, directory: Path) -> Built:
    """Write ``comparison-<experiment>.csv`` and ``.md`` into `directory`: one line per condition and variant.

    Conditions without a finished run are left out. Where the first variant has none, nothing is compared with it.

    Raises:
        MissingRunsError: no run is finished at all.
        ExneatError: a file cannot be written.
    """
    if not study.finished:
        what = f"{study.experiment}, budget {study.budget}: no finished run to compare"
        raise MissingRunsError(f"{what}\n  {study.command}")
    conditions = [name for name in study.conditions if (study.results["condition"] == name).any()]
    measured = ["training", "test", *(["full_reward"] if study.has_full_reward else [])]
    columns = {name: Column(of=name) for name in (*measured, "efficiency")}
    exact = [("runs", "efficiency", "runs")]
    exact += [(f"{name}_{each}", name, each) for name in measured for each in STATISTICS if each != "best_5"]
    exact += [(f"test_{each}", "test", each) for each in ("p_holm", "a12")]
    exact += [("efficiency", "efficiency", "efficiency")]
    shown = [("runs", "efficiency", "runs")]
    for name in measured:
        shown += [(name.replace("_", " "), name, "mean"), ("95% interval", name, "interval")]
    shown += [("test IQM", "test", "iqm"), ("test p (Holm)", "test", "p_holm"), ("test A12", "test", "a12")]
    shown += [("efficiency", "efficiency", "mean")]
    lines = _summary(study, conditions, columns)
    labelled = _labelled(lines, {study.experiment: study})
    name, title = f"comparison-{study.experiment}", f"All variants of {study.experiment}"
    words = Built(name, title, " ".join(filter(None, table_sentences(study, lines, columns))), ())
    return _write(directory, words, _side_by_side(labelled, exact), _side_by_side(_printed(labelled), shown))


def _side_by_side(lines: pd.DataFrame, columns: Iterable[tuple[str, str, str]]) -> pd.DataFrame:
    """One line per condition and variant; `columns` are headings, each with a quantity and a column of its lines."""
    of = {quantity: rows.reset_index(drop=True) for quantity, rows in lines.groupby("quantity")}
    places = of["efficiency"][["condition", "variant"]]
    wide = pd.concat([places, *(of[quantity][name] for _, quantity, name in columns)], axis=1)
    return wide.set_axis([*places, *(heading for heading, _, _ in columns)], axis=1)


def _labelled(lines: pd.DataFrame, studies: Mapping[str, Study]) -> pd.DataFrame:
    """Lines with the labels of conditions and variants in place of their names."""
    places = lines[["experiment", "condition", "variant"]].itertuples(index=False, name=None)
    labels = [(studies[e].conditions[condition], studies[e].variants[variant]) for e, condition, variant in places]
    return lines.assign(condition=[label for label, _ in labels], variant=[label for _, label in labels])


def _printed(lines: pd.DataFrame) -> pd.DataFrame:
    """Lines as text, rounded; all statistics of a quantity with as many decimals as its largest needs."""
    largest = lines[STATISTICS].abs().max(axis=1).groupby(lines["quantity"]).transform("max")
    decimals = np.where(largest >= LARGE, 1, 3)

    def cells(column: str) -> list[str]:
        return [rounded(value, digits) for value, digits in zip(lines[column], decimals, strict=True)]

    return lines.assign(
        mean=np.where(lines["efficiency"] == "", cells("mean"), lines["efficiency"]),
        interval=[f"[{low}, {high}]" if low else "" for low, high in zip(cells("low"), cells("high"), strict=True)],
        iqm=cells("iqm"),
        best_5=cells("best_5"),
        runs=lines["runs"].astype(str),
        p_holm=["<0.001" if p < 0.001 else rounded(p, 3) for p in lines["p_holm"]],
        a12=[rounded(share, 2) for share in lines["a12"]],
    )


def rounded(value: float, decimals: int) -> str:
    """Print a number for people; nothing for NaN."""
    # Adding zero turns a rounded -0.0 into 0.0.
    return "" if math.isnan(value) else f"{round(value, decimals) + 0.0:.{decimals}f}"


def _write(directory: Path, words: Built, exact: pd.DataFrame, cells: pd.DataFrame) -> Built:
    """Write ``<name>.csv`` from `exact`, with every digit, and ``<name>.md`` from `cells`."""
    header, rows = tuple(cells.columns), tuple(cells.itertuples(index=False, name=None))
    make_directory(directory)
    paths = directory / f"{words.name}.csv", directory / f"{words.name}.md"
    write_whole(paths[0], exact.to_csv(index=False, lineterminator="\n"))
    lines = [f"# {words.name}: {words.title}", "", *map(_line, (header, ["---"] * len(header), *rows))]
    write_whole(paths[1], "\n".join([*lines, "", words.caption, ""]))
    return words._replace(paths=paths, header=header, rows=rows)


def _line(cells: Iterable[str]) -> str:
    return "| " + " | ".join(" ".join(cell.split()).replace("|", "\\|") for cell in cells) + " |"


def _summary(study: Study, conditions: Iterable[str], columns: Mapping[str, Column]) -> pd.DataFrame:
    """One row per condition, quantity and variant of the study, which are compared within each condition.

    Columns: `_SUMMARY`; best_5 is the mean over the `BEST` runs best on validation, of robustness alone. Rows of
    efficiency, which is a text, count all finished runs and have no statistics.
    """
    parts = []
    for condition in conditions:
        measured = _measured(study, condition, columns)
        for name, column in columns.items():
            if column.of == "efficiency":
                runs = {variant: len(study.of(condition, variant)) for variant in study.variants}
                part = pd.DataFrame({"runs": runs, "efficiency": _efficiencies(study, condition)})
            else:
                groups = {variant: runs.droplevel(0) for variant, runs in measured[name].dropna().groupby(level=0)}
                values = {variant: groups.get(variant, pd.Series(dtype=float)) for variant in study.variants}
                part = compare({variant: each.to_numpy() for variant, each in values.items()}, study.baselines)
                part["efficiency"] = ""
                if column.of == "robustness":
                    part["best_5"] = [_mean_of_best(study, condition, *each) for each in values.items()]
            place = {"experiment": study.experiment, "condition": condition, "quantity": name}
            parts.append(part.rename_axis("variant").reset_index().assign(**place))
    return pd.concat(parts, ignore_index=True).reindex(columns=_SUMMARY)


def _measured(study: Study, condition: str, columns: Mapping[str, Column]) -> pd.DataFrame:
    """One row per finished run, indexed by variant and seed; one column per quantity, NaN where a run has none."""
    results = study.results[study.results["condition"] == condition].set_index(["variant", "seed"])
    measured = pd.DataFrame(index=results.index)
    if any(column.of == "robustness" for column in columns.values()):
        swept = study.robustness(condition).set_index(["variant", "seed"])
    for name, column in columns.items():
        if column.of == "robustness":
            level = np.isclose(swept["level"].astype(float), float(column.level or 0.0))
            here = swept.loc[level & (swept["parameter"] == column.sweep), f"{column.value}_mean"]
            measured[name] = here[~here.index.duplicated(keep="last")].astype(float)
        elif column.of != "efficiency":
            measured[name] = results[column.of]
    return measured


def _mean_of_best(study: Study, condition: str, variant: str, values: pd.Series) -> float:
    best = [values[run.seed] for run in study.best_first(condition, variant) if run.seed in values]
    return mean(best[:BEST])


def _efficiencies(study: Study, condition: str) -> dict[str, str]:
    """The generation at which each variant's mean curve reaches the final mean of the study's first variant.

    E.g. ``7``, ``>20`` if 20 were not enough, or nothing if the variant or the first one has no curve.
    """
    best = study.history(condition).groupby(["variant", "generation"])["best_so_far"].mean()
    curves = {variant: curve.to_numpy() for variant, curve in best.groupby("variant")}
    found = dict.fromkeys(study.variants, "")
    if study.first_variant in curves:
        target = float(curves[study.first_variant][-1])
        for variant, curve in curves.items():
            found[str(variant)] = str(efficiency(curve, target) or f">{len(curve)}")
    return found
