"""The figures of a report: from an entry of the catalogue and the studies it names to files and a caption."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from exneat_cli.analysis.artefacts import Built
from exneat_cli.analysis.budgets import budget_sentence, spent_in
from exneat_cli.analysis.captions import few_runs_sentence
from exneat_cli.analysis.catalogue import FigurePlan, Panel
from exneat_cli.analysis.figures import new_figure, save_figure, style
from exneat_cli.analysis.network_figures import draw_champions
from exneat_cli.analysis.quantities import BEST
from exneat_cli.analysis.robustness_panels import draw_clusters, draw_levels
from exneat_cli.analysis.study import MissingRunsError, Study
from exneat_cli.analysis.training_panels import AXIS_LABELS, draw_areas, draw_each_run, draw_means
from exneat_cli.errors import ExneatError, check_choice

AXES = tuple(AXIS_LABELS)
"""What the horizontal axis of a training curve can be."""
_TRAINING: dict[str, Callable[[Axes, Panel, Study, str], dict[str, int]]] = {
    "training": draw_means,
    "training_runs": draw_each_run,
    "area": draw_areas,
}
_SWEPT: dict[str, Callable[[Axes, Panel, Study], dict[str, int]]] = {
    "robustness": draw_levels,
    "cluster": draw_clusters,
}
_WHAT_IS_SHOWN = {
    "training": "Lines: best fitness so far, mean over runs; bands: 95% bootstrap interval over runs.",
    "training_runs": "Thin lines: best fitness so far of each run; thick lines: mean over runs.",
    "area": "One point per run: its best fitness so far, averaged over generations; bars: mean over runs.",
    "robustness": "Lines with markers: mean over all runs; bands: 95% bootstrap interval over runs.",
    "cluster": "One point per run: the mean over its test episodes at that level; bars: mean over runs.",
}
_WITH_INTERVALS = ("training", "robustness")
_SIZES = {1: (7.0, 4.8), 2: (10.4, 4.8)}
_CLUSTER_SIZES = {1: (10.4, 5.2), 2: (16.0, 5.2)}
"""Inches, by number of panels; clusters need room for every variant at every level."""
_MORE_PANELS = 4.8
_KEY_WIDTH, _LETTER_WIDTH = 0.6, 0.075
"""Inches that an entry of the legend takes, at least roughly."""


def draw_figure(plan: FigurePlan, studies: Mapping[str, Study], directory: Path, axis: str = "generation") -> Built:
    """Draw one figure of the catalogue as PNG and SVG.

    Args:
        plan: what to draw.
        studies: by name of experiment; must hold those of all panels.
        directory: where ``<name>.png`` and ``<name>.svg`` go.
        axis: horizontal axis of training curves: ``generation``, ``episodes`` or ``env_steps``.

    Raises:
        MissingRunsError: it needs runs that are not there.
        ExneatError: a panel names something that its experiment lacks, or a file cannot be read or written.
    """
    check_choice("axis", axis, AXES)
    for panel in plan.panels:
        _check_panel(plan, panel, studies)
    if plan.variants:
        studies = {name: study.only(plan.variants) for name, study in studies.items()}
    if plan.kind == "network":
        figure, sentences = draw_champions(plan, studies)
    else:
        figure, sentences = _draw_panels(plan, studies, axis)
    paths = save_figure(figure, directory / plan.name)
    return Built(plan.name, plan.title, " ".join([f"{plan.title}.", *sentences]), tuple(paths))


def _check_panel(plan: FigurePlan, panel: Panel, studies: Mapping[str, Study]) -> None:
    check_choice(f"{plan.name}: experiment", panel.experiment, tuple(studies))
    study = studies[panel.experiment]
    whose = f"of {panel.experiment}"
    check_choice(f"{plan.name}: condition {whose}", panel.condition, tuple(study.conditions))
    if panel.sweep is not None:
        check_choice(f"{plan.name}: sweep {whose}", panel.sweep, tuple(study.sweeps))
    if panel.variant is not None:
        check_choice(f"{plan.name}: trained variant {whose}", panel.variant, study.trained_variants)
    for variant in plan.variants:
        check_choice(f"{plan.name}: trained variant {whose}", variant, study.trained_variants)
    if panel.value == "full_reward" and not study.has_full_reward:
        raise ExneatError(f"{plan.name}: the task {whose} has no full reward; use value: fitness")
    if not study.trained_variants:
        raise MissingRunsError(f"{plan.name}: no variant {whose} is trained, so there are no runs to show")


def _draw_panels(plan: FigurePlan, studies: Mapping[str, Study], axis: str) -> tuple[Figure, list[str]]:
    sizes = _CLUSTER_SIZES if plan.kind == "cluster" else _SIZES
    width, height = sizes.get(len(plan.panels), (_MORE_PANELS * len(plan.panels), _MORE_PANELS))
    counts = []
    with style():
        figure = new_figure(width, height)
        for axes, panel in zip(figure.subplots(1, len(plan.panels), squeeze=False)[0], plan.panels, strict=True):
            study = studies[panel.experiment]
            if plan.kind in _TRAINING:
                counts.append(_TRAINING[plan.kind](axes, panel, study, axis))
            else:
                counts.append(_SWEPT[plan.kind](axes, panel, study))
            axes.set_title(study.conditions[panel.condition], fontsize=10)
        figure.suptitle(plan.title, fontsize=12)
        _add_legend(figure, width)
    return figure, _sentences(plan, studies, counts, axis)


def _add_legend(figure: Figure, width: float) -> None:
    """One legend for all panels, below them, so that it covers no data."""
    entries: dict[str, Artist] = {}
    for axes in figure.axes:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            entries.setdefault(str(label), handle)
    longest = max(len(label) for label in entries)
    columns = max(1, min(len(entries), int(width / (_KEY_WIDTH + _LETTER_WIDTH * longest))))
    figure.legend(list(entries.values()), list(entries), loc="outside lower center", ncols=columns, fontsize=9)


def _sentences(plan: FigurePlan, studies: Mapping[str, Study], counts: list[dict[str, int]], axis: str) -> list[str]:
    panels, trained, spent = [], [], []
    for number, (panel, runs) in enumerate(zip(plan.panels, counts, strict=True), start=1):
        study = studies[panel.experiment]
        place = f"Panel {number}, " if len(plan.panels) > 1 else ""
        listed = "; ".join(f"{study.variants[variant]} {count}" for variant, count in runs.items())
        panels.append(f"{place}{study.conditions[panel.condition]}, number of runs: {listed}.")
        learning = [variant for variant in runs if variant in study.trained_variants]
        trained += [runs[variant] for variant in learning]
        spent.append(spent_in(study, panel.condition, learning))
    panels[0] = panels[0][0].upper() + panels[0][1:]
    particulars = _particulars(plan.kind, axis, trained)
    sentences = [*panels, _WHAT_IS_SHOWN[plan.kind], *particulars, _budgets(plan, studies), budget_sentence(spent)]
    return [sentence for sentence in sentences if sentence]


def _budgets(plan: FigurePlan, studies: Mapping[str, Study]) -> str:
    names = dict.fromkeys(studies[panel.experiment].budget for panel in plan.panels)
    return f"Budget: {', '.join(names)}."


def _particulars(kind: str, axis: str, trained: list[int]) -> list[str]:
    sentences = []
    if kind in ("training", "training_runs") and axis != "generation":
        sentences.append(
            "Between generations a run counts with its latest value, and a mean ends where the first of its runs does."
        )
    if kind == "robustness" and max(trained) > BEST:
        sentences.append(f"Dashed lines: mean of the {BEST} runs of a variant that were best on validation.")
    if kind in _WITH_INTERVALS:
        sentences.append(few_runs_sentence(min(trained)))
    return sentences
