"""The figures of a report: from an entry of the catalogue and the studies it names to files and a caption."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from matplotlib.artist import Artist
from matplotlib.figure import Figure

from exneat_cli.analysis.captions import budget_sentence, few_runs_sentence, spent_in
from exneat_cli.analysis.catalogue import Built, FigurePlan, Panel
from exneat_cli.analysis.network_graph import champion_of, champions_figure
from exneat_cli.analysis.panels import AXIS_LABELS, draw_panel
from exneat_cli.analysis.study import BEST, MissingRunsError, Study
from exneat_cli.analysis.styles import save_figure, style
from exneat_cli.errors import ExneatError, check_choice

AXES = tuple(AXIS_LABELS)
"""What the horizontal axis of a training curve can be."""
_WHAT_IS_SHOWN = {
    "training": "Lines: best fitness so far, mean over runs; bands: 95% bootstrap interval over runs.",
    "training_runs": "Thin lines: best fitness so far of each run; thick lines: mean over runs.",
    "area": "One point per run: its best fitness so far, averaged over generations; bars: mean over runs.",
    "robustness": "Lines with markers: mean over all runs; bands: 95% bootstrap interval over runs.",
    "cluster": "One point per run: the mean over its test episodes at that level; bars: mean over runs.",
}
_KEY_WIDTH, _LETTER_WIDTH = 0.6, 0.075
"""Inches that an entry of the legend takes, at least roughly."""


def draw_figure(plan: FigurePlan, studies: Mapping[str, Study], directory: Path, axis: str = "generation") -> Built:
    """Draw one figure of the catalogue as ``<name>.png`` and ``<name>.svg`` in `directory`.

    `studies` are by the name of their experiment; training curves run over `axis`, one of `AXES`.

    Raises:
        MissingRunsError: it needs runs that are not there.
        ExneatError: a panel names something that its experiment lacks, or a file cannot be read or written.
    """
    check_choice("axis", axis, AXES)
    for panel in plan.panels:
        _check_panel(plan, panel, studies)
    if plan.variants:
        studies = {name: study.only(plan.variants) for name, study in studies.items()}
    figure, sentences = _draw_champions(plan, studies) if plan.kind == "network" else _draw_panels(plan, studies, axis)
    paths = save_figure(figure, directory / plan.name)
    return Built(plan.name, plan.title, " ".join(filter(None, [f"{plan.title}.", *sentences])), tuple(paths))


def _check_panel(plan: FigurePlan, panel: Panel, studies: Mapping[str, Study]) -> None:
    check_choice(f"{plan.name}: experiment", panel.experiment, tuple(studies))
    study = studies[panel.experiment]
    whose = f"of {panel.experiment}"
    check_choice(f"{plan.name}: condition {whose}", panel.condition, tuple(study.conditions))
    if panel.sweep is not None:
        check_choice(f"{plan.name}: sweep {whose}", panel.sweep, tuple(study.sweeps))
    for variant in filter(None, (panel.variant, *plan.variants)):
        check_choice(f"{plan.name}: trained variant {whose}", variant, study.trained_variants)
    if panel.value == "full_reward" and not study.has_full_reward:
        raise ExneatError(f"{plan.name}: the task {whose} has no full reward; use value: fitness")
    if not study.trained_variants:
        raise MissingRunsError(f"{plan.name}: no variant {whose} is trained, so there are no runs to show")


def _draw_champions(plan: FigurePlan, studies: Mapping[str, Study]) -> tuple[Figure, list[str]]:
    """Of each panel's variant the champion of the run that was best on validation, side by side."""
    champions, titles, sentences = [], [], []
    for panel in plan.panels:
        study, variant = studies[panel.experiment], str(panel.variant)
        study.require(panel.condition, [variant])
        ranked = study.best_first(panel.condition, variant)
        champions.append(champion_of(ranked[0].directory))
        titles.append(f"{study.variants[variant]}, {study.conditions[panel.condition]}")
        chosen = f"best on validation of {len(ranked)} runs" if len(ranked) > 1 else "the only run"
        score = f"test {study.fitness_name} {champions[-1].scores.test.fitness_mean:.4g}"
        sentences.append(f"{titles[-1]}: seed {ranked[0].seed}, {chosen}, budget {study.budget}, {score}.")
    return champions_figure(plan.title, champions, titles), [*sentences, "Disabled connections are left out."]


def _draw_panels(plan: FigurePlan, studies: Mapping[str, Study], axis: str) -> tuple[Figure, list[str]]:
    # Clusters need room for every variant at every level.
    sizes = {1: (10.4, 5.2), 2: (16.0, 5.2)} if plan.kind == "cluster" else {1: (7.0, 4.8), 2: (10.4, 4.8)}
    width, height = sizes.get(len(plan.panels), (4.8 * len(plan.panels), 4.8))
    counts = []
    with style():
        figure = Figure(figsize=(width, height), layout="constrained")
        for axes, panel in zip(figure.subplots(1, len(plan.panels), squeeze=False)[0], plan.panels, strict=True):
            study = studies[panel.experiment]
            counts.append(draw_panel(plan.kind, axes, panel, study, axis))
            axes.set_title(study.conditions[panel.condition], fontsize=10)
        figure.suptitle(plan.title, fontsize=12)
        _add_legend(figure, width)
    return figure, list(_sentences(plan, studies, counts, axis))


def _add_legend(figure: Figure, width: float) -> None:
    """Add one legend for all panels, below them, so that it covers no data."""
    entries: dict[str, Artist] = {}
    for axes in figure.axes:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            entries.setdefault(str(label), handle)
    longest = max(len(label) for label in entries)
    columns = max(1, min(len(entries), int(width / (_KEY_WIDTH + _LETTER_WIDTH * longest))))
    figure.legend(list(entries.values()), list(entries), loc="outside lower center", ncols=columns, fontsize=9)


def _sentences(
    plan: FigurePlan, studies: Mapping[str, Study], counts: Sequence[Mapping[str, int]], axis: str
) -> Iterator[str]:
    trained, spent = [], []
    for number, (panel, runs) in enumerate(zip(plan.panels, counts, strict=True), start=1):
        study = studies[panel.experiment]
        label = study.conditions[panel.condition]
        place = f"Panel {number}, {label}" if len(plan.panels) > 1 else label[:1].upper() + label[1:]
        listed = "; ".join(f"{study.variants[variant]} {count}" for variant, count in runs.items())
        yield f"{place}, number of runs: {listed}."
        learning = [variant for variant in runs if variant in study.trained_variants]
        trained += [runs[variant] for variant in learning]
        spent.append(spent_in(study, panel.condition, learning))
    yield _WHAT_IS_SHOWN[plan.kind]
    if plan.kind in ("training", "training_runs") and axis != "generation":
        yield "Between generations a run counts with its latest value."
        yield "A mean ends where the first of its runs does."
    if plan.kind == "robustness" and max(trained) > BEST:
        yield f"Dashed lines: mean of the {BEST} runs of a variant that were best on validation."
    if plan.kind in ("training", "robustness"):
        yield few_runs_sentence(trained)
    yield f"Budget: {', '.join(dict.fromkeys(studies[panel.experiment].budget for panel in plan.panels))}."
    yield budget_sentence(spent)
