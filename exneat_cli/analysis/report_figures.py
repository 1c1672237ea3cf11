"""The figures of a report: from an entry of the catalogue and the studies it names to files and a caption."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib import rcParams
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import EngFormatter, MaxNLocator
from numpy.typing import NDArray

from exneat_cli.analysis.catalogue import Built, FigurePlan, Panel
from exneat_cli.analysis.curve_values import value_strips
from exneat_cli.analysis.network_graph import champion_of, champions_figure
from exneat_cli.analysis.statistics import bootstrap_interval
from exneat_cli.analysis.study import BEST, MissingRunsError, Study, budget_sentence, few_runs_sentence
from exneat_cli.analysis.styles import AS_TRAINED, GREY, SCREEN, Look, Paper, save_figure, tick_levels, variant_styles
from exneat_cli.errors import ExneatError, check_choice

Tables = dict[str, pd.DataFrame]
"""Variant -> what its runs reached: a row per place on the horizontal axis, a column per seed."""
Looks = Mapping[str, Look]
_AXIS_LABELS = {
    "generation": "generation",
    "episodes": "training episodes",
    "env_steps": "environment steps (control steps)",
}
"""Column of history.csv -> label of the horizontal axis."""
AXES = tuple(_AXIS_LABELS)
"""What the horizontal axis of a training curve can be."""
MOST_POINTS = 100
"""Points of a curve beyond these could not be told apart, but each would cost a bootstrap."""
MARKERS_PER_CURVE = 8
_KEPT = "\u200b"
_DASHED: Look = {"linestyle": "--", "linewidth": 1.2}
_BAR: Look = {"color": GREY, "linewidth": 2.4}
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
        MissingRunsError: it needs runs that are not there.
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
    # Where a style sheet cuts the margins off, places on the picture are no longer known.
    strips = () if paper.sheet.get("savefig.bbox") else value_strips(figure, _KEPT)
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
        if paper.columns is None:  # a paper has it in its caption
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


def _kept(label: str) -> str:
    """A label that stays in legends: matplotlib leaves out those that begin with an underscore."""
    return f"{_KEPT}{label}"


def _add_legend(figure: Figure, width: float) -> int:
    """Add one legend for all panels, below them, so that it covers no data; returns how many lines it has."""
    entries: dict[str, Artist] = {}
    for axes in figure.axes:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            entries.setdefault(str(label).removeprefix(_KEPT), handle)
    letter = rcParams["font.size"] / 133  # inches, roughly
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
        yield "Between generations a run counts with its latest value."
        yield "A mean ends where the first of its runs does."
    if plan.kind == "robustness" and max(trained) > BEST:
        yield f"Dashed lines: mean of the {BEST} runs of a variant that were best on validation."
    if plan.kind in ("training", "robustness"):
        yield few_runs_sentence(trained)
    yield f"Budget: {', '.join(dict.fromkeys(studies[panel.experiment].budget for panel in plan.panels))}."
    yield budget_sentence(spent)


def draw_panel(kind: str, axes: Axes, panel: Panel, study: Study, looks: Looks, axis: str) -> dict[str, int]:
    """Draw one panel of a figure on empty axes; returns the number of runs of each variant that it shows.

    Kinds are ``training`` (means of runs with 95% bands), ``training_runs`` (each run thin, means thick), ``area`` (one
    point per run, its mean over generations), ``robustness`` (means of runs with 95% bands; where a variant has more
    than `BEST` runs, dashed the mean of those best on validation) and ``cluster`` (one point per run at each level).
    Training curves run over `axis`, one of `AXES`. `looks` are those of all variants.

    Raises:
        MissingRunsError: a variant has no finished run, or none has a finished sweep.
    """
    if kind in ("robustness", "cluster"):
        tables = _swept(panel, study)
        (_draw_levels if kind == "robustness" else _draw_clusters)(axes, panel, study, tables, looks)
        score = "full reward" if panel.value == "full_reward" else study.fitness_name
        axes.set(xlabel=study.sweeps[str(panel.sweep)], ylabel=score)
    else:
        study.require(panel.condition, study.trained_variants)
        tables = _tables(study.history(panel.condition), study.trained_variants, axis, "best_so_far")
        if kind == "area":
            _draw_areas(axes, study, tables, looks)
        else:
            _draw_curves(axes, study, tables, looks, axis, each_run=kind == "training_runs")
    return {variant: table.shape[1] for variant, table in tables.items()}


def _tables(rows: pd.DataFrame, variants: Iterable[str], place: str, score: str) -> Tables:
    found = {variant: rows[rows["variant"] == variant] for variant in variants}
    return {v: own.pivot_table(index=place, columns="seed", values=score) for v, own in found.items() if len(own)}


def common_curves(curves: pd.DataFrame) -> pd.DataFrame:
    """Bring the runs of one variant to common places on an axis: all that every run has reached and none has passed.

    Runs spend different numbers of control steps per generation. Between two generations a run keeps the value of the
    earlier one, which is what it had then. At most `MOST_POINTS` places are left.
    """
    shortest = min(curves[seed].dropna().index.max() for seed in curves)
    common: pd.DataFrame = curves.ffill().dropna()
    common = common[common.index <= max(shortest, common.index[0])]
    return common.iloc[np.unique(np.linspace(0, len(common) - 1, MOST_POINTS).round().astype(int))]


def _draw_curves(axes: Axes, study: Study, tables: Tables, looks: Looks, axis: str, *, each_run: bool) -> None:
    for variant in study.trained_variants:
        look = looks[variant]
        curves = common_curves(tables[variant])
        if each_run:
            for seed in tables[variant]:
                axes.plot(tables[variant][seed].dropna(), color=look["color"], linewidth=0.6, alpha=0.55, zorder=1)
        else:
            _draw_band(axes, curves, look)
        thickness = (1.7 if each_run else 1.2) * rcParams["lines.linewidth"]
        marks: Look = {"markevery": max(1, len(curves) // MARKERS_PER_CURVE), "linewidth": thickness}
        axes.plot(curves.index, curves.mean(axis=1), label=_kept(study.variants[variant]), **look, **marks)
    axes.set(xlabel=_AXIS_LABELS[axis], ylabel=f"best {study.fitness_name} so far")
    if axis == "generation":
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    else:
        axes.xaxis.set_major_formatter(EngFormatter(sep=""))


def _draw_areas(axes: Axes, study: Study, tables: Tables, looks: Looks) -> None:
    for place, variant in enumerate(study.trained_variants):
        areas = tables[variant].mean().to_frame().T
        _draw_points(axes, np.array([place]), areas, looks[variant], _kept(study.variants[variant]), room=0.7, size=40)
    axes.plot([], [], label="bar: mean over runs", **_BAR)
    axes.set(xticks=[], xlabel="variant", ylabel=f"best {study.fitness_name} so far,\nmean over generations")
    axes.margins(x=0.08)


def _swept(panel: Panel, study: Study) -> Tables:
    """What the runs of each variant reached at each level; variants that were not swept are left out."""
    rows = study.robustness(panel.condition)
    rows = rows[rows["parameter"] == panel.sweep]
    if panel.highest is not None:
        rows = rows[rows["level"] <= panel.highest + 1e-9]
    tables = _tables(rows, study.variants, "level", f"{panel.value}_mean")
    if not set(tables) & set(study.trained_variants):
        raise study.lacking(panel.condition, f"no finished sweep of {panel.sweep}")
    return tables


def _draw_levels(axes: Axes, panel: Panel, study: Study, tables: Tables, looks: Looks) -> None:
    for variant, table in tables.items():
        axes.plot(table.index, table.mean(axis=1), label=_kept(study.variants[variant]), **looks[variant])
        if variant in study.baselines:
            continue
        _draw_band(axes, table, looks[variant])
        if table.shape[1] > BEST:
            best = table[study.best_seeds(panel.condition, variant, table.columns)]
            axes.plot(table.index, best.mean(axis=1), color=looks[variant]["color"], zorder=2, **_DASHED)
    if any(table.shape[1] > BEST for table in tables.values()):
        axes.plot([], [], color=GREY, label=f"mean of the {BEST} runs best on validation", **_DASHED)
    _mark_training(axes, panel, study)
    tick_levels(axes, (level for table in tables.values() for level in table.index))


def _mark_training(axes: Axes, panel: Panel, study: Study, levels: Sequence[float] = ()) -> None:
    """Draw a line at the level at which runs were trained; `levels` that stand side by side have places from 0 on."""
    trained = study.trained.get(panel.condition, {}).get(str(panel.sweep))
    if trained is None:
        return
    place = np.interp(trained, levels, range(len(levels)), np.nan, np.nan) if levels else trained
    if np.isfinite(place):  # else beside all levels that were tested
        axes.axvline(float(place), **AS_TRAINED)


def _draw_clusters(axes: Axes, panel: Panel, study: Study, tables: Tables, looks: Looks) -> None:
    """Draw the variants side by side at each level."""
    levels = sorted({level for table in tables.values() for level in table.index})
    trained = [variant for variant in tables if variant not in study.baselines]
    room = 0.8 / len(trained)
    for variant, table in tables.items():
        look, label = looks[variant], _kept(study.variants[variant])
        places = np.array([levels.index(level) for level in table.index], dtype=np.float64)
        if variant in study.baselines:
            line = {"color": look["color"], "linestyle": look["linestyle"]}
            axes.hlines(table.mean(axis=1), places - 0.45, places + 0.45, **line)
            axes.plot([], [], label=label, **line)
        else:
            aside = (trained.index(variant) - (len(trained) - 1) / 2) * room
            _draw_points(axes, places + aside, table, look, label, room, size=12)
    axes.plot([], [], label="bar: mean over runs", **_BAR)
    _mark_training(axes, panel, study, levels)
    axes.set_xticks(range(len(levels)), [f"{level:g}" for level in levels])
    axes.set_xlim(-0.6, len(levels) - 0.4)
    axes.grid(visible=False, axis="x")


def _draw_band(axes: Axes, table: pd.DataFrame, look: Look) -> None:
    band = np.array([bootstrap_interval(runs[~np.isnan(runs)]) for runs in table.to_numpy()])
    if not np.isnan(band).all():
        axes.fill_between(table.index, band[:, 0], band[:, 1], color=look["color"], alpha=0.18, linewidth=0.0)


def _draw_points(
    axes: Axes, places: NDArray[np.float64], table: pd.DataFrame, look: Look, label: str, room: float, size: float
) -> None:
    """Draw a point per run within `room` of each place, from left to right by seed, and a bar for their mean."""
    count = table.shape[1]
    aside = np.linspace(-0.3, 0.3, count) * room if count > 1 else np.zeros(1)
    dots = {"color": look["color"], "marker": look["marker"], "label": label}
    axes.scatter((places[:, None] + aside).ravel(), table.to_numpy().ravel(), s=size, alpha=0.7, linewidths=0.0, **dots)
    axes.hlines(table.mean(axis=1), places - 0.42 * room, places + 0.42 * room, color=look["color"], linewidth=2.0)
