"""`exneat report`: tables, figures and a page from the existing runs; trains nothing."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from exneat_cli.analysis.catalogue import Built, FigurePlan, Panel, TablePlan, read_catalogue
from exneat_cli.analysis.index_page import write_index
from exneat_cli.analysis.report_figures import draw_figure
from exneat_cli.analysis.report_panels import AXES
from exneat_cli.analysis.study import MissingRunsError, PlannedRun, Study
from exneat_cli.analysis.styles import Paper, read_style_sheet
from exneat_cli.analysis.tables import build_comparison, build_table
from exneat_cli.commands.command_line import CommandLine
from exneat_cli.commands.inspect import tell_unreadable
from exneat_cli.commands.jobs import BUDGETS, Job
from exneat_cli.commands.shipped import shipped_directory, shipped_files
from exneat_cli.commands.sweep import Experiment, plan_jobs, read_experiment, results_file
from exneat_cli.errors import ConfigError, ExneatError, check_choice, check_path
from exneat_cli.records import PublishedRun, find_runs, read_published, runs_at
from exneat_cli.tasks import HasFullReward

_OWN = ("experiment", "only", "axis", "columns", "style")
"""Settings of the report itself, not of its runs; conf/report.yaml explains them."""


def run(line: CommandLine) -> int:
    """Build what can be built, and say what is missing; returns the exit code.

    Raises:
        ExneatError: an argument makes no sense, there are no runs, or the requested figure or table lacks runs.
    """
    asked = line.compose("budget", "output", *_OWN)
    check_choice("axis", asked["axis"], AXES)
    paper = _paper(asked)
    asked["output"] = str(check_path("output", asked["output"]))
    own = None if asked["experiment"] is None else read_experiment(asked["experiment"])
    artefacts = _artefacts(asked, own)
    names = sorted({name for artefact in artefacts.values() for name in _experiments_of(artefact)})
    sources = {name: asked["experiment"] if own and own.name == name else name for name in names}
    experiments = {name: read_experiment(source) for name, source in sources.items()}
    rows: dict[str, list[PublishedRun]] = {name: [] for name in names}
    if own or any(_has_any(each, budget, asked["output"], ()) for each in experiments.values() for budget in BUDGETS):
        # Published runs stand in for missing ones; without any run here, a mistyped output= must be reported.
        rows = {name: list(read_published(results_file(sources[name]))) for name in names}
    budgets = {
        name: asked["budget"] or _largest_budget(experiments[name], asked["output"], rows[name]) for name in names
    }
    commands = {name: _command(sources[name], budgets[name], asked, line) for name in names}
    if not any(_has_any(experiments[name], budgets[name], asked["output"], rows[name]) for name in names):
        first = experiments[names[0]]  # planning all of them takes ten seconds
        one = replace(
            first, conditions=dict([*first.conditions.items()][:1]), variants=dict([*first.variants.items()][:1])
        )
        plan_jobs(one, budgets[names[0]], line, _OWN)  # refuses settings that make no sense
        raise _nothing_to_report(asked, sources, commands)
    studies = {name: study_of(experiments[name], budgets[name], commands[name], line, rows[name]) for name in names}
    if not any(study.reached for study in studies.values()):
        raise _nothing_to_report(asked, sources, commands)
    directory = Path(asked["output"]) / "report" / (own.name if own else "")
    built, missing = _build(artefacts, studies, directory, asked, paper)
    if asked["only"] is None:
        built += [build_comparison(study, directory) for study in studies.values() if study.reached]
        page = write_index(directory, studies, built, missing)
        print(f"\n{len(built)} tables and figures built, {len(missing)} not built for lack of runs\n{page}")
    return 0


def _build(
    artefacts: Mapping[str, FigurePlan | TablePlan],
    studies: Mapping[str, Study],
    directory: Path,
    asked: Mapping[str, Any],
    paper: Paper,
) -> tuple[list[Built], dict[str, str]]:
    """Build whatever has its runs; returns what was built, and by name why the others could not be built."""
    built: list[Built] = []
    missing: dict[str, str] = {}
    for name, artefact in artefacts.items():
        try:
            if isinstance(artefact, FigurePlan):
                built.append(draw_figure(artefact, studies, directory, asked["axis"], paper))
            else:
                built.append(build_table(artefact, studies, directory))
        except MissingRunsError as error:
            if asked["only"] is not None:
                raise ExneatError(f"{name}: {error}") from error
            missing[name] = str(error)
            print(f"{name}: {error}", file=sys.stderr)
        else:
            print("\n".join(map(str, built[-1].paths)), flush=True)
    return built, missing


def _paper(asked: Mapping[str, Any]) -> Paper:
    if asked["columns"] not in (None, 1, 2):
        raise ConfigError("columns", "1 or 2, or null for figures to be read on a screen", asked["columns"])
    sheet = asked["style"]
    own = {} if sheet is None else read_style_sheet(check_path("style", sheet, "a matplotlib style sheet"))
    return Paper(asked["columns"], own)


def _artefacts(asked: Mapping[str, Any], own: Experiment | None) -> dict[str, FigurePlan | TablePlan]:
    """What to build: entries of the catalogue or, for an experiment not in it, figures of each condition and sweep."""
    catalogue = read_catalogue(shipped_directory("experiments") / "catalogue.yaml")
    if own:
        shipped = asked["experiment"] in shipped_files("experiments")
        known = {name: each for name, each in catalogue.items() if shipped and own.name in _experiments_of(each)}
        catalogue = known or _figures_for(own)
    if asked["only"] is None:
        return catalogue
    check_choice("only", asked["only"], list(catalogue))
    return {asked["only"]: catalogue[asked["only"]]}


def _figures_for(experiment: Experiment) -> dict[str, FigurePlan | TablePlan]:
    plans: list[FigurePlan] = []
    for name, condition in experiment.conditions.items():
        panel = Panel(experiment.name, name)
        plans.append(FigurePlan(f"training-{name}", "training", f"{condition.label}: training", (panel,)))
        for sweep in condition.sweeps or ():
            panel, title = Panel(experiment.name, name, sweep=sweep), f"{condition.label}: {sweep}"
            plans.append(FigurePlan(f"robustness-{name}-{sweep}", "robustness", title, (panel,)))
    return {plan.name: plan for plan in plans}


def _experiments_of(artefact: FigurePlan | TablePlan) -> list[str]:
    return [part.experiment for part in (artefact.panels if isinstance(artefact, FigurePlan) else artefact.rows)]


def _command(source: str, budget: str, asked: Mapping[str, Any], line: CommandLine) -> str:
    """The command that makes the missing runs of an experiment, given as a name or a YAML file."""
    others = [word for word in line.words[2:] if word.partition("=")[0] not in ("budget", "output", *_OWN)]
    return shlex.join(["exneat", "sweep", f"experiment={source}", f"budget={budget}", *_place(asked), *others])


def _place(asked: Mapping[str, Any]) -> list[str]:
    """The setting that says where runs are, unless that is the default place."""
    return [] if asked["output"] == "outputs" else [f"output={asked['output']}"]


def study_of(
    experiment: Experiment, budget: str, command: str, line: CommandLine, rows: Sequence[PublishedRun]
) -> Study:
    """The runs of an experiment; `rows` are its published ones."""
    jobs = plan_jobs(experiment, budget, line, _OWN)
    task = jobs[0].settings.task
    runs = {}
    for job in jobs:
        (condition, variant, _), settings = job.name.split("/"), job.settings
        length, identity = settings.trained_generations, settings.full_hash
        runs[PlannedRun(condition, variant, settings.seed, settings.directory, length, identity)] = job
    swept = [job for job in jobs if job.sweeps]
    sweeps = {sweep.name: sweep for job in swept for sweep in job.sweeps}
    return Study(
        experiment=experiment.name,
        budget=budget,
        claim=experiment.claim,
        command=command,
        fitness_name=task.fitness_name,
        has_full_reward=isinstance(task, HasFullReward),
        variants={name: variant.label for name, variant in experiment.variants.items()},
        baselines=tuple(dict.fromkeys(run.variant for run, job in runs.items() if job.settings.algorithm.rule)),
        conditions={name: condition.label for name, condition in experiment.conditions.items()},
        sweeps={name: sweep.label for name, sweep in sweeps.items()},
        runs=tuple(runs),
        references={name: variant.against for name, variant in experiment.variants.items() if variant.against},
        levels={name: sweep.levels for name, sweep in sweeps.items()},
        sweep_episodes=swept[0].episodes if swept else None,
        rows=tuple(rows),
        trained={condition: _trained_levels(swept, condition) for condition in experiment.conditions},
    )


def _trained_levels(jobs: Sequence[Job], condition: str) -> dict[str, float]:
    """For each sweep, the level at which all runs of a condition were trained, if there is one such level."""
    levels: dict[str, set[float]] = {}
    for job in jobs:
        if job.name.partition("/")[0] == condition:
            for sweep, level in job.trained_levels().items():
                levels.setdefault(sweep, set()).add(level)
    return {sweep: min(found) for sweep, found in levels.items() if len(found) == 1}


def _nothing_to_report(
    asked: Mapping[str, Any], sources: Mapping[str, Any], commands: Mapping[str, str]
) -> ExneatError:
    """The error for when there is nothing to report; it names what exists instead, and commands for it."""
    found: dict[str, None] = {}
    alone = 0
    for run in find_runs(Path(asked["output"]), tell_unreadable):
        try:
            words = run.read_manifest().command
        except ExneatError:
            continue
        of = [word for word in words if word.startswith("experiment=")]
        found |= dict.fromkeys(of)
        alone += not of
    nothing = f"output={asked['output']}: no finished run of {', '.join(commands)}\n"
    others = [word for word in found if word.partition("=")[2] not in map(str, sources.values())]
    if others:
        reports = " or ".join(shlex.join(["exneat", "report", word, *_place(asked)]) for word in others[:3])
        return ExneatError(f"{nothing}  there are runs of another experiment: {reports}")
    listing = shlex.join(["exneat", "inspect", *_place(asked)])
    compared = f"  there are runs outside of experiments, which {listing} compares; to run an experiment:\n"
    return ExneatError(f"{nothing}{compared if alone else ''}  {next(iter(commands.values()))}")


def _largest_budget(experiment: Experiment, output: str, rows: Sequence[PublishedRun]) -> str:
    """The largest budget with a finished run here, else with a published one, else the one to begin with."""
    finished = [budget for budget in BUDGETS if _has_any(experiment, budget, output, ())]
    published = [budget for budget in BUDGETS if _has_any(experiment, budget, output, rows)]
    planned = [budget for budget in ("quick", *BUDGETS) if budget in experiment.runs]
    return [*finished, *published, *planned][0]


def _has_any(experiment: Experiment, budget: str, output: str, rows: Sequence[PublishedRun]) -> bool:
    """Whether a run of that budget is finished or published."""
    if any(row.budget == budget for row in rows):
        return True
    folders = [Path(output) / f"{experiment.name}-{condition}-{budget}" for condition in experiment.conditions]
    return any(run.is_finished() for folder in folders for run in runs_at(folder / "*"))
