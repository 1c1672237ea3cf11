"""Write docs/results.md and its pictures from the published rows of experiments/results; `make docs` calls it."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import jinja2

from exneat_cli.analysis.captions import SIGNIFICANT
from exneat_cli.analysis.catalogue import Built, FigurePlan, read_catalogue
from exneat_cli.analysis.report_figures import draw_figure
from exneat_cli.analysis.statistics import bootstrap_interval, compare
from exneat_cli.analysis.study import MissingRunsError, Study
from exneat_cli.analysis.tables import build_comparison, build_table
from exneat_cli.commands.command_line import read_command_line
from exneat_cli.commands.jobs import BUDGETS
from exneat_cli.commands.report import study_of
from exneat_cli.commands.shipped import shipped_directory, shipped_files
from exneat_cli.commands.sweep import read_experiment, results_file
from exneat_cli.records import read_published

HERE = Path(__file__).parent
RULE = "linear_fusion"
"""The baseline that a trained variant should beat."""
SHOWN = ("training", "training_runs", "robustness", "cluster")
"""Kinds of figures that can be drawn from rows and are shown on the page."""


def published_studies(nowhere: str) -> dict[str, Study]:
    """Experiments with published rows, each at its largest published budget; runs are looked for in `nowhere`."""
    studies = {}
    for name in shipped_files("experiments"):
        rows = read_published(results_file(name))
        budget = next((budget for budget in BUDGETS if any(row.budget == budget for row in rows)), None)
        if budget is not None:
            line = read_command_line("report", [f"output={nowhere}"])
            command = f"exneat sweep experiment={name} budget={budget} publish=true"
            studies[name] = study_of(read_experiment(name), budget, command, line, rows)
    return {name: study for name, study in studies.items() if study.reached}


def verdicts(study: Study) -> Iterator[str]:
    """What holds, where the opposite holds and what is inconclusive, from champions on test episodes."""
    trained = [name for name in study.trained_variants if study.reference_of(name) != name]
    found: dict[tuple[str, str], list[str]] = {}
    for condition, label in study.conditions.items():
        here = study.results[study.results["condition"] == condition]
        values = {name: here.loc[here["variant"] == name, "test"].tolist() for name in study.variants}
        table = compare(values, study.baselines, study.references)
        for name in trained:
            if not values[name] or not values[study.reference_of(name)]:
                continue
            margin, p, a12 = (float(table.loc[name, each]) for each in ("margin", "p_holm", "a12"))  # type: ignore[arg-type]
            kind = "inconclusive" if not p < SIGNIFICANT else "holds" if margin > 0 else "the opposite holds"
            found.setdefault((name, kind), []).append(f"{label} ({margin:+.3g}, p {p:.2g}, A12 {a12:.2f})")
    for name in trained:
        what = f"{study.variants[name]} beats {study.variants[study.reference_of(name)]}"
        for kind in ("holds", "the opposite holds", "inconclusive"):
            if (name, kind) in found:
                yield f"{what}: **{kind}** in {'; '.join(found[name, kind])}."
    yield from beyond_the_rule(study)
    yield from before_learning(study)


def beyond_the_rule(study: Study) -> Iterator[str]:
    """Where trained variants score above an untrained rule, and where they do not."""
    if RULE not in study.variants:
        return
    for name in study.trained_variants:
        kinds = ("above", "**not clearly above**", "**below**")
        found: dict[str, list[str]] = {kind: [] for kind in kinds}
        for condition, label in study.conditions.items():
            here = study.results[study.results["condition"] == condition]
            rule = here.loc[here["variant"] == RULE, "test"]
            over = here.loc[here["variant"] == name, "test"].to_numpy() - rule.mean()
            if len(over) and len(rule):
                low, high = bootstrap_interval(over)
                said = f"{label} ({over.mean():+.3f}, interval {low:+.3f} to {high:+.3f})"
                found[kinds[0 if low > 0 else 2 if high < 0 else 1]].append(said)
        for words, places in found.items():
            if places:
                yield f"{study.variants[name]}: {words} untrained linear fusion in {'; '.join(places)}."


def before_learning(study: Study) -> Iterator[str]:
    """Training scores of the best team of the random first generation, and of the best team of all generations."""
    best: dict[str, list[tuple[float, float]]] = {}
    for condition in study.conditions:
        if not (study.results["condition"] == condition).any():
            continue
        for name, curves in study.history(condition).groupby("variant"):
            runs = curves.groupby("seed")["best_so_far"]
            best.setdefault(str(name), []).append((runs.first().mean(), runs.last().mean()))
    for name in filter(best.__contains__, study.trained_variants):
        first, last = zip(*best[name], strict=True)
        chance = f"in training, the best team of the random first generation earns {_range(first)}"
        yield f"{study.variants[name]}: {chance}, and the best of all generations {_range(last)}."


def _range(values: Sequence[float]) -> str:
    low, high = (f"{value:.0f}" if abs(value) >= 10 else f"{value:.2f}" for value in (min(values), max(values)))
    return low if low == high else f"{low} to {high}"


def as_markdown(table: Built) -> str:
    """A table with the caption below it."""
    lines = ["| " + " | ".join(cells) + " |" for cells in (table.header, ["---"] * len(table.header), *table.rows)]
    return "\n".join([*lines, "", table.caption])


def write() -> None:
    """Write the page and its pictures; trains nothing."""
    pictures = HERE / "images" / "results"
    catalogue = read_catalogue(shipped_directory("experiments") / "catalogue.yaml")
    with tempfile.TemporaryDirectory() as scratch:
        studies = published_studies(f"{scratch}/none")
        sections: list[dict[str, Any]] = []
        for name, study in studies.items():
            built: list[Built] = []
            for plan in catalogue.values():
                parts = plan.panels if isinstance(plan, FigurePlan) else plan.rows
                if {part.experiment for part in parts} != {name}:
                    continue
                try:
                    if not isinstance(plan, FigurePlan):
                        built.append(build_table(plan, studies, Path(scratch)))
                    elif plan.kind in SHOWN:
                        built.append(draw_figure(plan, studies, pictures))
                except MissingRunsError:
                    continue  # the page shows what is published
            comparison = as_markdown(build_comparison(study, Path(scratch)))
            sections.append({"study": study, "built": built, "comparison": comparison, "verdicts": [*verdicts(study)]})
    loader = jinja2.FileSystemLoader(HERE)
    jinja = jinja2.Environment(loader=loader, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    jinja.filters["markdown"] = as_markdown
    missing = [name for name in shipped_files("experiments") if name not in studies]
    page = jinja.get_template("results.md.j2").render(sections=sections, missing=missing)
    (HERE / "results.md").write_text(page.rstrip() + "\n", encoding="utf-8")


if __name__ == "__main__":
    write()
