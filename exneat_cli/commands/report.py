"""`exneat report`: tables, figures and a page of them, from whatever runs there are; trains nothing."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from exneat_cli.analysis.catalogue import Built, FigurePlan, Panel, TablePlan, read_catalogue
from exneat_cli.analysis.index_page import write_index
from exneat_cli.analysis.report_figures import AXES, draw_figure
from exneat_cli.analysis.study import MissingRunsError, PlannedRun, Study
from exneat_cli.analysis.tables import build_comparison, build_table
from exneat_cli.commands.composition import BUDGETS
from exneat_cli.commands.experiments import (
    Experiment,
    Job,
    experiment_names,
    experiments_directory,
    plan_jobs,
    read_experiment,
)
from exneat_cli.errors import ExneatError, check_choice
from exneat_cli.records import RunDirectory
from exneat_cli.tasks import HasFullReward


@dataclass(frozen=True)
class Request:
    """What the command line asks for.

    Attributes:
        experiment: a name or a YAML file; None takes all that come with exneat.
        budget: whose runs; None takes, for each experiment, the largest of which there is any run.
        only: one figure or table; None takes all.
        axis: horizontal axis of training curves.
        output: root of all run directories.
        overrides: settings that all runs were given on the command line.
    """

    experiment: str | None = None
    budget: str | None = None
    only: str | None = None
    axis: str = "generation"
    output: str = "outputs"
    overrides: tuple[str, ...] = ()

    @property
    def directory(self) -> Path:
        """Where tables, figures and the page go; those of a single experiment have a folder of their own."""
        report = Path(self.output) / "report"
        return report if self.experiment is None else report / Path(self.experiment).stem


def run(arguments: Sequence[str]) -> int:
    """Build what can be built, and say what is missing; returns the exit code.

    Raises:
        ExneatError: an argument makes no sense, there are no runs, or the one thing asked for lacks runs.
    """
    request = _request(arguments)
    artefacts = _artefacts(request)
    names = sorted({e for artefact in artefacts.values() for e in _experiments_of(artefact)})
    experiments = {name: read_experiment(name) for name in names if name in experiment_names()}
    if request.experiment is not None:
        own = read_experiment(request.experiment)
        experiments[own.name] = own
    studies = {name: _study(experiments[name], request) for name in names}
    if not any(study.finished for study in studies.values()):
        where = f"output={request.output}: no finished run of {', '.join(names)}"
        raise ExneatError(f"{where}\n  {next(iter(studies.values())).command}")
    built, missing = _build(request, artefacts, studies)
    if request.only is None:
        built += [build_comparison(study, request.directory) for study in studies.values() if study.finished]
        page = write_index(request.directory, studies, built, missing)
        print(f"\n{len(built)} tables and figures built, {len(missing)} lack runs")
        print(page)
    return 0


def _request(arguments: Sequence[str]) -> Request:
    known = ("experiment", "budget", "only", "axis", "output")
    values: dict[str, str] = {}
    overrides = []
    for argument in arguments:
        key, separator, value = argument.partition("=")
        if argument.startswith("-") or not separator or not value:
            raise ExneatError(f"{argument}: expected key=value; keys are {', '.join(known)} and settings of the runs")
        if key in known:
            values[key] = value
        else:
            overrides.append(argument)
    request = Request(**values, overrides=tuple(overrides))
    check_choice("axis", request.axis, AXES)
    if request.budget is not None:
        check_choice("budget", request.budget, BUDGETS)
    return request


def _artefacts(request: Request) -> dict[str, FigurePlan | TablePlan]:
    """What is to be built: from the catalogue, or, for an experiment that is not in it, one figure for each thing."""
    catalogue = read_catalogue(experiments_directory() / "catalogue.yaml")
    if request.experiment is not None:
        experiment = read_experiment(request.experiment)
        chosen = {name: each for name, each in catalogue.items() if experiment.name in _experiments_of(each)}
        catalogue = chosen if request.experiment in experiment_names() else _figures_for(experiment)
    if request.only is None:
        return catalogue
    check_choice("only", request.only, list(catalogue))
    return {request.only: catalogue[request.only]}


def _figures_for(experiment: Experiment) -> dict[str, FigurePlan | TablePlan]:
    plans: dict[str, FigurePlan | TablePlan] = {}
    for name, condition in experiment.conditions.items():
        training = f"training-{name}"
        plans[training] = FigurePlan(
            training, "training", f"{condition.label}: training", (Panel(experiment.name, name),)
        )
        for sweep in condition.sweeps:
            swept = f"robustness-{name}-{sweep}"
            panel = Panel(experiment.name, name, sweep=sweep)
            plans[swept] = FigurePlan(swept, "robustness", f"{condition.label}: {sweep}", (panel,))
    return plans


def _experiments_of(artefact: FigurePlan | TablePlan) -> list[str]:
    parts: Iterable[object] = artefact.panels if isinstance(artefact, FigurePlan) else artefact.rows
    return [part.experiment for part in parts]  # type: ignore[attr-defined]


def _planned(job: Job) -> PlannedRun:
    settings = job.settings
    return PlannedRun(job.condition, job.variant, settings.seed, settings.directory, settings.trained_generations)


def _study(experiment: Experiment, request: Request) -> Study:
    budget = request.budget or _largest_budget(experiment, request.output)
    jobs = plan_jobs(experiment, budget, [f"output={request.output}", *request.overrides])
    task = jobs[0].settings.task
    labels: dict[str, str] = {}
    levels: dict[str, tuple[float, ...]] = {}
    for job in jobs:
        labels.update(job.sweeps.labels)
        levels.update({sweep.name: sweep.levels for sweep in job.sweeps.sweeps})
    of_their_own = request.experiment is not None and Path(request.experiment).stem == experiment.name
    name = request.experiment if of_their_own else experiment.name
    extra = [f"output={request.output}"] if request.output != "outputs" else []
    return Study(
        experiment=experiment.name,
        budget=budget,
        claim=experiment.claim,
        command=" ".join(["exneat sweep", f"experiment={name}", f"budget={budget}", *extra, *request.overrides]),
        fitness_name=task.fitness_name,
        has_full_reward=isinstance(task, HasFullReward),
        variants={name: variant.label for name, variant in experiment.variants.items()},
        baselines=tuple(dict.fromkeys(job.variant for job in jobs if job.settings.algorithm.rule)),
        conditions={name: condition.label for name, condition in experiment.conditions.items()},
        sweeps=labels,
        runs=tuple(_planned(job) for job in jobs),
        levels=levels,
        sweep_episodes=next((job.sweeps.episodes for job in jobs if job.sweeps.sweeps), None),
    )


def _largest_budget(experiment: Experiment, output: str) -> str:
    for budget in BUDGETS:
        for condition in experiment.conditions:
            folder = Path(output) / f"{experiment.name}-{condition}-{budget}"
            runs = (RunDirectory(path.parent) for path in folder.glob("*/manifest.json"))
            if any(run.is_finished() for run in runs):
                return budget
    return next(budget for budget in ("quick", *BUDGETS) if budget in experiment.runs)


def _build(
    request: Request, artefacts: Mapping[str, FigurePlan | TablePlan], studies: Mapping[str, Study]
) -> tuple[list[Built], dict[str, str]]:
    """What was built, and what was not: its name and why."""
    built: list[Built] = []
    missing: dict[str, str] = {}
    for name, artefact in artefacts.items():
        try:
            if isinstance(artefact, FigurePlan):
                built.append(draw_figure(artefact, studies, request.directory, request.axis))
            else:
                built.append(build_table(artefact, studies, request.directory))
        except MissingRunsError as error:
            if request.only is not None:
                raise ExneatError(f"{name}: {error}") from error
            missing[name] = str(error)
            print(f"{name}: {error}", file=sys.stderr)
        else:
            print("\n".join(str(path) for path in built[-1].paths), flush=True)
    return built, missing
