"""Tables as CSV, Markdown and LaTeX: those of the catalogue, and one comparison per experiment.

Both show lines of a summary, one per condition, variant and quantity: a table of the catalogue shows them one under
another, beside what was published; a comparison shows the quantities side by side.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from exneat_cli.analysis.captions import table_sentences
from exneat_cli.analysis.catalogue import Built, Column, TablePlan
from exneat_cli.analysis.latex import latex_table
from exneat_cli.analysis.statistics import compare, efficiency, mean
from exneat_cli.analysis.study import BEST, MissingRunsError, Study
from exneat_cli.errors import check_choice
from exneat_cli.records import make_directory, write_whole

STATISTICS = ["mean", "low", "high", "iqm", "best_5", "margin"]
"""Columns of a summary that are in the unit of their quantity."""
_KEY = ["experiment", "condition", "variant", "quantity"]
_SUMMARY = [*_KEY, "runs", *STATISTICS, "p_holm", "a12", "efficiency"]
_TESTED = ["runs", "margin", "p_holm", "a12"]
LARGE = 10.0
"""Where values reach this, one decimal is enough; shares between 0 and 1 need three."""
_PLACE = ["condition", "variant", "quantity", "published"]


def build_table(plan: TablePlan, studies: Mapping[str, Study], directory: Path) -> Built:
    """Write ``<name>.csv``, ``<name>.md`` and ``<name>.tex`` into `directory`: one line per row and column of the plan.

    Raises:
        MissingRunsError: a variant of the table, or the one that it is compared with, lacks runs or a level.
        ExneatError: the plan names something unknown, or a file cannot be written.
    """
    lines = _planned_lines(plan, studies)
    of = {column.of for column in plan.columns.values()}
    sentences: list[str] = []
    for experiment, own in lines.groupby("experiment", sort=False):
        sentences += table_sentences(studies[str(experiment)], own, of)
    headings = {name: name for name in _PLACE} | {"mean": "ours (mean)", "interval": "95% interval", "iqm": "IQM"}
    if "robustness" in of:
        headings["best_5"] = f"ours, best {BEST}"
        mean_of_best = f"mean over the {BEST} runs that are best on validation, or all if there are fewer."
        sentences.append(f"Best {BEST}: {mean_of_best}")
    headings |= {"runs": "runs", "margin": "margin", "p_holm": "p (Holm)", "a12": "A12"}
    labelled = _labelled(lines, studies)
    means = lines["mean"].astype(object).where(lines["efficiency"] == "", lines["efficiency"])
    statistics = [name for name in STATISTICS if name not in _TESTED]
    exact = labelled.assign(mean=means)[[*_PLACE, *statistics, *_TESTED]]
    cells = _printed(labelled)[list(headings)].rename(columns=headings)
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
    summaries = []
    for (experiment, condition), own in planned.groupby(["experiment", "condition"], sort=False):
        study = studies[str(experiment)]
        minuends = [column.minus for column in plan.columns.values() if column.minus]
        variants = [each for variant in own["variant"] for each in (study.reference_of(variant), variant)]
        for variant in minuends:
            check_choice(f"{plan.name}: minus of {experiment}", variant, tuple(study.variants))
        study.require(str(condition), dict.fromkeys([*variants, *minuends]))
        summaries.append(_summary(study, str(condition), plan.columns))
    lines = planned.merge(pd.concat(summaries), on=_KEY, how="left")
    swept = [name for name, column in plan.columns.items() if column.of == "robustness"]
    unmeasured = lines[lines["quantity"].isin(swept) & (lines["runs"] == 0)]
    for (experiment, condition, quantity), own in unmeasured.groupby(["experiment", "condition", "quantity"]):
        study, column = studies[str(experiment)], plan.columns[str(quantity)]
        labels = ", ".join(own["variant"].map(study.variants))
        raise study.lacking(str(condition), f"sweep {column.sweep}, level {column.level}: not measured for {labels}")
    return lines


def build_comparison(study: Study, directory: Path) -> Built:
    """Write ``comparison-<experiment>.csv``, ``.md`` and ``.tex`` into `directory`: one line per condition and variant.

    Conditions without a finished run are left out. Where the first variant has none, nothing is compared with it.

    Raises:
        MissingRunsError: no run is finished at all.
        ExneatError: a file cannot be written.
    """
    if not study.reached:
        what = f"{study.experiment}, budget {study.budget}: no finished run to compare"
        raise MissingRunsError(f"{what}\n  {study.command}")
    conditions = [name for name in study.conditions if (study.results["condition"] == name).any()]
    measured = ["training", "test", *(["full_reward"] if study.has_full_reward else [])]
    columns = {name: Column(of=name) for name in (*measured, "efficiency")}
    exact, shown = [("runs", "efficiency", "runs")], [("runs", "efficiency", "runs")]
    for name in measured:
        exact += [(f"{name}_{each}", name, each) for each in ("mean", "low", "high", "iqm")]
        shown += [(name.replace("_", " "), name, "mean"), ("95% interval", name, "interval")]
    exact += [(f"test_{each}", "test", each) for each in ("margin", "p_holm", "a12")]
    exact += [("efficiency", "efficiency", "efficiency")]
    shown += [("test IQM", "test", "iqm"), ("test margin", "test", "margin")]
    shown += [("test p (Holm)", "test", "p_holm"), ("test A12", "test", "a12")]
    shown += [("efficiency", "efficiency", "mean")]
    lines = pd.concat([_summary(study, condition, columns) for condition in conditions], ignore_index=True)
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
        margin=cells("margin"),
        best_5=cells("best_5"),
        runs=lines["runs"].astype(str),
        p_holm=["<0.001" if p < 0.001 else rounded(p, 3) for p in lines["p_holm"]],
        a12=[rounded(share, 2) for share in lines["a12"]],
    )


def rounded(value: float, decimals: int) -> str:
    """Write a number for people; nothing for NaN."""
    # Adding zero turns a rounded -0.0 into 0.0.
    return "" if math.isnan(value) else f"{round(value, decimals) + 0.0:.{decimals}f}"


def _write(directory: Path, words: Built, exact: pd.DataFrame, cells: pd.DataFrame) -> Built:
    """Write ``<name>.csv`` from `exact`, with every digit, and ``<name>.md`` and ``<name>.tex`` from `cells`."""
    header, rows = tuple(cells.columns), tuple(cells.itertuples(index=False, name=None))
    make_directory(directory)
    paths = tuple(directory / f"{words.name}.{kind}" for kind in ("csv", "md", "tex"))
    write_whole(paths[0], exact.to_csv(index=False, lineterminator="\n"))
    lines = [
        "| " + " | ".join(" ".join(text.split()).replace("|", "\\|") for text in texts) + " |"
        for texts in (header, ["---"] * len(header), *rows)
    ]
    write_whole(paths[1], "\n".join([f"# {words.name}: {words.title}", "", *lines, "", words.caption, ""]))
    write_whole(paths[2], latex_table(f"{words.name}: {words.title}", words.caption, header, rows))
    return words._replace(paths=paths, header=header, rows=rows)


def _summary(study: Study, condition: str, columns: Mapping[str, Column]) -> pd.DataFrame:
    """One row per quantity and variant of the study, which are compared within the condition.

    Columns: `_SUMMARY`; best_5 is the mean over the `BEST` runs best on validation, for robustness only. Rows of
    efficiency, which is a text, count all finished runs and have no statistics.
    """
    parts = []
    for name, column in columns.items():
        if column.of == "efficiency":
            counts = {variant: len(study.of(condition, variant)) for variant in study.variants}
            part = pd.DataFrame({"runs": counts, "efficiency": _efficiencies(study, condition)})
        else:
            values = _values(study, condition, column)
            of_runs = {variant: list(runs.values()) for variant, runs in values.items()}
            part = compare(of_runs, study.baselines, study.references)
            part["efficiency"] = ""
            if column.of == "robustness":
                best = [(study.best_seeds(condition, variant, runs), runs) for variant, runs in values.items()]
                part["best_5"] = [mean([runs[seed] for seed in seeds]) for seeds, runs in best]
        place = {"experiment": study.experiment, "condition": condition, "quantity": name}
        parts.append(part.rename_axis("variant").reset_index().assign(**place))
    return pd.concat(parts, ignore_index=True).reindex(columns=_SUMMARY)


def _values(study: Study, condition: str, column: Column) -> dict[str, dict[int, float]]:
    """What the finished runs of each variant reached, by seed; those that lack the figure are left out."""
    name = column.of
    rows = study.results[study.results["condition"] == condition]
    if column.of == "robustness":
        name, rows = f"{column.value}_mean", study.robustness(condition)
        is_level = np.isclose(rows["level"].astype(float), float(column.level or 0.0))
        rows = rows[is_level & (rows["parameter"] == column.sweep)]
    rows = rows.dropna(subset=name)
    if column.minus is not None:
        rows = rows.assign(**{name: rows[name] - rows.loc[rows["variant"] == column.minus, name].mean()})
    return {v: dict(rows.loc[rows["variant"] == v, ["seed", name]].itertuples(index=False)) for v in study.variants}


def _efficiencies(study: Study, condition: str) -> dict[str, str]:
    """The generation at which each variant's mean curve reaches the final mean of its reference.

    E.g. ``7``, ``>20`` if 20 were not enough, or nothing if the variant or its reference has no curve.
    """
    best = study.history(condition).groupby(["variant", "generation"])["best_so_far"].mean()
    curves = {str(variant): curve.to_numpy() for variant, curve in best.groupby("variant")}
    found = dict.fromkeys(study.variants, "")
    for variant, curve in curves.items():
        reference = curves.get(study.reference_of(variant))
        if reference is not None:
            found[variant] = str(efficiency(curve, float(reference[-1])) or f">{len(curve)}")
    return found
