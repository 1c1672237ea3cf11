"""Champions of a report, side by side: of each variant the one whose run was best on validation."""

from __future__ import annotations

from collections.abc import Mapping

from matplotlib.figure import Figure

from exneat_cli.analysis.catalogue import FigurePlan, Panel
from exneat_cli.analysis.figures import new_figure, style
from exneat_cli.analysis.network_data import ChampionGraph, read_champion_graph
from exneat_cli.analysis.network_graph import draw_champion, legend_entries
from exneat_cli.analysis.network_layout import natural_size
from exneat_cli.analysis.study import PlannedRun, Study

_AROUND = 1.6
"""Inches for titles above and the legend below."""


def draw_champions(plan: FigurePlan, studies: Mapping[str, Study]) -> tuple[Figure, list[str]]:
    """The figure, and sentences that say whose champions these are.

    Raises:
        MissingRunsError: a variant has no finished run.
    """
    runs = [best_run(panel, studies[panel.experiment]) for panel in plan.panels]
    graphs = [read_champion_graph(run.directory) for run in runs]
    sizes = [natural_size(graph) for graph in graphs]
    height = max(tall for _, tall in sizes)
    width = sum(wide for wide, _ in sizes) + 0.3 * (len(sizes) - 1)
    titles = [_title(panel, studies[panel.experiment]) for panel in plan.panels]
    with style():
        figure = new_figure(width, height + _AROUND)
        ratios = [wide for wide, _ in sizes]
        panels = figure.subplots(1, len(graphs), squeeze=False, width_ratios=ratios)[0]
        for axes, graph, wide, title in zip(panels, graphs, ratios, titles, strict=True):
            draw_champion(axes, graph, wide, height)
            axes.set_title(title, fontsize=10)
        figure.suptitle(plan.title, fontsize=12)
        handles = legend_entries(graphs)
        figure.legend(handles=handles, loc="outside lower center", ncols=max(2, int(width // 2.6)), fontsize=8)
    sentences = [_whose(*whose, studies) for whose in zip(plan.panels, runs, graphs, titles, strict=True)]
    return figure, [*sentences, "Disabled connections are left out."]


def best_run(panel: Panel, study: Study) -> PlannedRun:
    """The finished run of the panel's variant that was best on validation, the lowest seed among equals.

    Raises:
        MissingRunsError: the variant has no finished run.
    """
    assert panel.variant is not None
    study.require(panel.condition, [panel.variant])
    validation = study.results(panel.condition, panel.variant)["validation"].fillna(float("-inf"))
    return study.of(panel.condition, panel.variant)[int(validation.to_numpy().argmax())]


def _title(panel: Panel, study: Study) -> str:
    assert panel.variant is not None
    return f"{study.variants[panel.variant]}, {study.conditions[panel.condition]}"


def _whose(panel: Panel, run: PlannedRun, graph: ChampionGraph, title: str, studies: Mapping[str, Study]) -> str:
    study = studies[panel.experiment]
    runs = len(study.of(run.condition, run.variant))
    chosen = f"best on validation of {runs} runs" if runs > 1 else "the only run"
    earned = f"test {study.fitness_name} {graph.test_fitness:.4g}"
    return f"{title}: seed {run.seed}, {chosen}, budget {study.budget}, {earned}."
