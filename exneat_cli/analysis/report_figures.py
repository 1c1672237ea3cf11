"""The figures of a report: from an entry of the catalogue and the studies it names to files and a caption."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from matplotlib import rcParams
from matplotlib.artist import Artist
from matplotlib.figure import Figure

from exneat_cli.analysis.catalogue import Built, FigurePlan, Panel
from exneat_cli.analysis.curve_values import value_strips
from exneat_cli.analysis.network_graph import champion_of, champions_figure
from exneat_cli.analysis.report_panels import AXES, OF_VARIANT, draw_panel
from exneat_cli.analysis.study import BEST, MissingRunsError, Study, budget_sentence, few_runs_sentence
from exneat_cli.analysis.styles import SCREEN, Paper, save_figure, variant_styles
from exneat_cli.errors import ExneatError, check_choice

_WHAT_IS_SHOWN = {
    "training": "Lines: best fitness so far, mean over runs; bands: 95% bootstrap interval over runs.",
    "training_runs": "Thin lines: best fitness so far of each run; thick lines: mean over runs.",
    "area": "One point per run: its best fitness so far, averaged over generations; bars: mean over runs.",
    "robustness": "Lines with markers: mean over all runs; bands: 95% bootstrap interval over runs.",
    "cluster": "One point per run: the mean over its test episodes at that level; bars: mean over runs.",
}


def draw_figure(
    plan: FigurePlan, studies: Mapping[str, Study], directory: Path, axis: str = "generation", paper: Paper = SCREEN
) -> Built:
    """Draw one figure of the catalogue as ``<name>.png``, ``<name>.svg`` and ``<name>.pdf`` in `directory`.

    `studies` are by the name of their experiment; training curves run over `axis`, one of `AXES`.

    Raises:
        MissingRunsError: runs that it needs are missing.
        ExneatError: a panel names something that its experiment lacks, or a file cannot be read or written.
    """
    check_choice("axis", axis, AXES)
    for panel in plan.panels:
        _check_panel(plan, panel, studies)
    if plan.variants:
        studies = {name: study.only(plan.variants) for name, study in studies.items()}
    if plan.kind == "network" or axis != "generation":
        studies = {name: study.on_disk() for name, study in studies.items()}
    if plan.kind == "network":
        figure, sentences = _draw_champions(plan, studies, paper)
    else:
        figure, sentences = _draw_panels(plan, studies, axis, paper)
    paths = save_figure(figure, directory / plan.name, paper, ("png", "svg", "pdf"))
    text = " ".join(filter(None, [f"{plan.title}.", *sentences]))
    # If a style sheet crops the margins, places on the picture are unknown.
    strips = () if paper.sheet.get("savefig.bbox") else value_strips(figure, OF_VARIANT)
    return Built(plan.name, plan.title, text, tuple(paths), strips=strips)


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


def _draw_champions(plan: FigurePlan, studies: Mapping[str, Study], paper: Paper) -> tuple[Figure, list[str]]:
    """For each panel's variant, the champion of the run that was best on validation, side by side."""
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
    return champions_figure(plan.title, champions, titles, paper), [*sentences, "Disabled connections are left out."]


def _draw_panels(plan: FigurePlan, studies: Mapping[str, Study], axis: str, paper: Paper) -> tuple[Figure, list[str]]:
    rows, beside, width, height = _room(plan, paper)
    counts = []
    with paper.style():
        figure = Figure(figsize=(width, height), layout="constrained")
        places = figure.subplots(rows, beside, squeeze=False).ravel()
        for axes, panel in zip(places, plan.panels, strict=False):
            study = studies[panel.experiment]
            looks = variant_styles(study.variants, study.baselines, paper.sheet.get("axes.prop_cycle", ()))
            counts.append(draw_panel(plan.kind, axes, panel, study, looks, axis))
            axes.set_title(study.conditions[panel.condition])
        for axes in places[len(plan.panels) :]:
            axes.remove()
        if paper.columns is None:  # in a paper, it is in the caption
            figure.suptitle(plan.title)
        lines = _add_legend(figure, width)
        if paper.columns:
            figure.set_figheight(height + 0.16 * lines)
    return figure, list(_sentences(plan, studies, counts, axis))


def _room(plan: FigurePlan, paper: Paper) -> tuple[int, int, float, float]:
    """Rows and columns of panels, width and height (inches) of their figure."""
    panels = len(plan.panels)
    if paper.columns:
        return paper.grid(panels)
    # Clusters need room for every variant at every level.
    sizes = {1: (10.4, 5.2), 2: (16.0, 5.2)} if plan.kind == "cluster" else {1: (7.0, 4.8), 2: (10.4, 4.8)}
    return 1, panels, *sizes.get(panels, (4.8 * panels, 4.8))


def _add_legend(figure: Figure, width: float) -> int:
    """Add one legend for all panels, below them, so that it covers no data; returns how many lines it has."""
    entries: dict[str, Artist] = {}
    for axes in figure.axes:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            entries.setdefault(str(label).removeprefix(OF_VARIANT), handle)
    letter = rcParams["font.size"] / 133  # inches, approximately
    inches = 8 * letter + letter * max(len(label) for label in entries)  # an entry's: its key and its letters
    columns = max(1, min(len(entries), int(width / inches)))
    figure.legend(list(entries.values()), list(entries), loc="outside lower center", ncols=columns)
    return -(-len(entries) // columns)


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
        spent.append(study.spent_in(panel.condition, learning))
    yield _WHAT_IS_SHOWN[plan.kind]
    if plan.kind in ("training", "training_runs") and axis != "generation":
        yield "Between generations, a run keeps its latest value."
        yield "A mean ends where its first run ends."
    if plan.kind == "robustness" and max(trained) > BEST:
        yield f"Dashed lines: mean of the {BEST} runs of a variant that were best on validation."
    if plan.kind in ("training", "robustness"):
        yield few_runs_sentence(trained)
    yield f"Budget: {', '.join(dict.fromkeys(studies[panel.experiment].budget for panel in plan.panels))}."
    yield budget_sentence(spent)
