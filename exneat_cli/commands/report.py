"""`exneat report`: tables, figures and a page of them, from whatever runs there are; trains nothing."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from exneat_cli.analysis.catalogue import Built, FigurePlan, Panel, TablePlan, read_catalogue
from exneat_cli.analysis.index_page import write_index
from exneat_cli.analysis.report_figures import AXES, draw_figure
from exneat_cli.analysis.study import MissingRunsError, PlannedRun, Study
from exneat_cli.analysis.tables import build_comparison, build_table
from exneat_cli.commands.command_line import CommandLine, shipped_directory
from exneat_cli.commands.experiments import Experiment, experiment_names, plan_jobs, read_experiment
from exneat_cli.commands.jobs import BUDGETS, Job
from exneat_cli.errors import ExneatError, check_choice, check_text
from exneat_cli.records import RunDirectory, build
from exneat_cli.tasks import HasFullReward

_OWN = ("experiment", "only", "axis")
"""Settings of the report that are none of its runs."""


@dataclass(frozen=True)
class Request:
    """What conf/report.yaml says, and the command line.

    Attributes:
        experiment: a name or a YAML file; None takes all that come with exneat.
        budget: whose runs; None takes, for each experiment, the largest of which there is any run.
        only: one figure or table; None takes all.
        axis: horizontal axis of training curves.
        output: root of all run directories.
    """

    experiment: str | None
    budget: str | None
    only: str | None
    axis: str
    output: str

    def __post_init__(self) -> None:
        check_choice("axis", self.axis, AXES)
        check_text("output", self.output, "a directory")

    @property
    def directory(self) -> Path:
        """Where tables, figures and the page go; those of a single experiment have a folder of their own."""
        report = Path(self.output) / "report"
        return report if self.experiment is None else report / Path(self.experiment).stem


def run(line: CommandLine) -> int:
    """Build what can be built, and say what is missing; returns the exit code.

    Raises:
        ExneatError: an argument makes no sense, there are no runs, or the one thing asked for lacks runs.
    """
    request = build(Request, line.compose("budget", "output", *_OWN), "")
    experiment = None if request.experiment is None else read_experiment(request.experiment)
    artefacts = _artefacts(request, experiment)
    names = sorted({name for artefact in artefacts.values() for name in _experiments_of(artefact)})
    experiments = {name: read_experiment(name) for name in names if experiment is None or name != experiment.name}
    if experiment is not None:
        experiments[experiment.name] = experiment
    studies = {name: _study(experiments[name], request, line) for name in names}
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


def _artefacts(request: Request, experiment: Experiment | None) -> dict[str, FigurePlan | TablePlan]:
    """What is to be built: from the catalogue, or, for an experiment that is not in it, one figure for each thing."""
    catalogue = read_catalogue(shipped_directory("experiments") / "catalogue.yaml")
    if experiment is not None and request.experiment in experiment_names():
        catalogue = {name: each for name, each in catalogue.items() if experiment.name in _experiments_of(each)}
    elif experiment is not None:
        catalogue = _figures_for(experiment)
    if request.only is None:
        return catalogue
    check_choice("only", request.only, list(catalogue))
    return {request.only: catalogue[request.only]}


def _figures_for(experiment: Experiment) -> dict[str, FigurePlan | TablePlan]:
    plans: list[FigurePlan] = []
    for name, condition in experiment.conditions.items():
        panel = Panel(experiment.name, name)
        plans.append(FigurePlan(f"training-{name}", "training", f"{condition.label}: training", (panel,)))
        for sweep in condition.sweeps or ():
            panel = Panel(experiment.name, name, sweep=sweep)
            title = f"{condition.label}: {sweep}"
            plans.append(FigurePlan(f"robustness-{name}-{sweep}", "robustness", title, (panel,)))
    return {plan.name: plan for plan in plans}


def _experiments_of(artefact: FigurePlan | TablePlan) -> list[str]:
    parts: Iterable[object] = artefact.panels if isinstance(artefact, FigurePlan) else artefact.rows
    return [part.experiment for part in parts]  # type: ignore[attr-defined]


def _study(experiment: Experiment, request: Request, line: CommandLine) -> Study:
    budget = request.budget or _largest_budget(experiment, request.output)
    jobs = plan_jobs(experiment, budget, line, _OWN)
    task = jobs[0].settings.task
    swept = [job for job in jobs if job.sweeps.sweeps]
    return Study(
        experiment=experiment.name,
        budget=budget,
        claim=experiment.claim,
        command=_sweep_command(experiment, request, line, budget),
        fitness_name=task.fitness_name,
        has_full_reward=isinstance(task, HasFullReward),
        variants={name: variant.label for name, variant in experiment.variants.items()},
        baselines=tuple(dict.fromkeys(_place(job)[1] for job in jobs if job.settings.algorithm.rule)),
        conditions={name: condition.label for name, condition in experiment.conditions.items()},
        sweeps={name: label for job in swept for name, label in job.sweeps.labels.items()},
        runs=tuple(_planned(job) for job in jobs),
        levels={sweep.name: sweep.levels for job in swept for sweep in job.sweeps.sweeps},
        sweep_episodes=swept[0].sweeps.episodes if swept else None,
    )


def _place(job: Job) -> tuple[str, str]:
    """Condition and variant."""
    condition, variant, _ = job.name.split("/")
    return condition, variant


def _planned(job: Job) -> PlannedRun:
    settings = job.settings
    return PlannedRun(*_place(job), settings.seed, settings.directory, settings.trained_generations)


def _sweep_command(experiment: Experiment, request: Request, line: CommandLine, budget: str) -> str:
    """The command line that does what is missing."""
    is_own = request.experiment is not None and Path(request.experiment).stem == experiment.name
    name = request.experiment if is_own else experiment.name
    places = [] if request.output == "outputs" else [f"output={request.output}"]
    others = [word for word in line.words[2:] if word.partition("=")[0] not in ("budget", "output", *_OWN)]
    return shlex.join(["exneat", "sweep", f"experiment={name}", f"budget={budget}", *places, *others])


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
