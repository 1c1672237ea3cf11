"""`exneat sweep`: runs an experiment: all variants, conditions and seeds that a YAML file describes."""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from omegaconf import OmegaConf
from omegaconf.errors import OmegaConfBaseException

from exneat_cli.commands.command_line import CommandLine, in_words
from exneat_cli.commands.jobs import BUDGETS, Job, check_known, read_job
from exneat_cli.commands.publishing import publish_jobs
from exneat_cli.commands.run_table import print_table
from exneat_cli.commands.series import do_jobs, unfinished
from exneat_cli.commands.setting import as_written, read_setting
from exneat_cli.commands.shipped import chosen_file
from exneat_cli.errors import (
    ConfigError,
    ExneatError,
    check_choice,
    check_flag,
    check_keys,
    check_section,
    check_text,
    check_whole,
)
from exneat_cli.interruption import signal_heard
from exneat_cli.records import DONE, build, dotted
from exneat_cli.tasks.contract import check_worlds

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,39}")
_SET_HERE = {"seed", "name", "output", "resume", "sweep", "sweeps", "budget", "hydra"}
"""What exneat sweep sets itself, so that no variant or condition may."""


@dataclass(frozen=True)
class Variant:
    """One of the variants, compared with the first one or with `against`.

    Without `runs` it has the experiment's number of seeds.
    """

    label: str
    settings: Mapping[str, Any] = field(default_factory=dict)
    runs: int | None = None
    swept: bool = True
    against: str | None = None


@dataclass(frozen=True)
class Condition:
    """One training condition, and the robustness sweeps of its runs, except those of unswept variants."""

    label: str
    settings: Mapping[str, Any] = field(default_factory=dict)
    sweeps: list[str] | None = None


@dataclass(frozen=True, kw_only=True)
class Experiment:
    """The content of experiments/<name>.yaml; the first variant is the one with which the others are compared.

    Settings have dotted names, as on the command line; `runs` is the number of seeds (0, 1, 2, ...) of each budget.
    """

    name: str
    claim: str
    settings: Mapping[str, Any] = field(default_factory=dict)
    variants: Mapping[str, Variant]
    conditions: Mapping[str, Condition]
    runs: Mapping[str, int]


def results_file(name: str) -> Path:
    """Where the published rows of an experiment are: ``results/<name>.csv`` beside its YAML file."""
    path = chosen_file("experiment", name, "experiments")
    return path.parent / "results" / f"{path.stem}.csv"


def read_experiment(name: object) -> Experiment:
    """Read one of exneat's experiments, or a YAML file of the user's own.

    Raises:
        ExneatError: there is no such experiment, or its file is damaged or makes no sense.
    """
    path = chosen_file("experiment", name, "experiments")
    try:
        content: Any = OmegaConf.to_container(OmegaConf.load(path))
    except OSError as error:
        raise ExneatError(f"{path}: could not be read: {error.strerror or error}") from error
    except (ValueError, yaml.YAMLError, OmegaConfBaseException) as error:
        raise ExneatError(in_words(error, [path.parent])) from error
    try:
        return _experiment(path.stem, content)
    except ExneatError as error:
        raise ExneatError(f"{path}: {error}") from error


def _experiment(name: str, content: Any) -> Experiment:
    check_keys("", check_section("the file", content), ("claim", "settings", "variants", "conditions", "runs"))
    experiment = build(Experiment, {**content, "name": name}, "")
    check_text("claim", experiment.claim)
    for part in ("variants", "conditions", "runs"):
        if not check_section(part, content[part]):
            raise ConfigError(part, "at least one entry", content[part])
    for key in (name, *experiment.variants, *experiment.conditions):
        if not isinstance(key, str) or not _NAME.fullmatch(key):
            raise ConfigError("name", "at most 40 letters, digits, '.', '_' and '-'", key)
    for budget, runs in experiment.runs.items():
        check_choice("runs", budget, BUDGETS)
        check_whole(f"runs.{budget}", runs, 1, 10_000)
    for part, entries in (("variants", content["variants"]), ("conditions", content["conditions"])):
        _check_labels(part, entries)
    return replace(
        experiment,
        settings=_settings("settings", experiment.settings),
        variants={key: _variant(f"variants.{key}", entry, content) for key, entry in content["variants"].items()},
        conditions={key: _condition(f"conditions.{key}", entry) for key, entry in content["conditions"].items()},
    )


def _check_labels(part: str, entries: Mapping[str, Any]) -> None:
    """Refuse labels that could not be told apart in a figure."""
    labels: dict[str, str] = {}
    for name, entry in entries.items():
        label = str(check_section(f"{part}.{name}", entry).get("label", "")).strip()
        if "label" in entry and (not label or label in labels):
            expected = f"another label than {part}.{labels[label]} has" if label else "a label that can be seen"
            raise ConfigError(f"{part}.{name}.label", expected, entry["label"])
        labels[label] = name


def _variant(key: str, entry: Any, content: Any) -> Variant:
    variant = build(Variant, entry, f"{key}.")
    check_text(f"{key}.label", variant.label)
    check_flag(f"{key}.swept", variant.swept)
    if variant.against is not None:
        others = [name for name in content["variants"] if f"variants.{name}" != key]
        check_choice(f"{key}.against", variant.against, others)
    if variant.runs is not None:
        check_whole(f"{key}.runs", variant.runs, 1, 10_000)
    return replace(variant, settings=_settings(f"{key}.settings", variant.settings))


def _condition(key: str, entry: Any) -> Condition:
    condition = build(Condition, entry, f"{key}.")
    check_text(f"{key}.label", condition.label)
    sweeps = condition.sweeps or []
    if not isinstance(sweeps, list) or not all(isinstance(sweep, str) for sweep in sweeps):
        raise ConfigError(f"{key}.sweeps", "a list of sweep names", sweeps)
    return replace(condition, settings=_settings(f"{key}.settings", condition.settings))


def _settings(key: str, values: Any) -> dict[str, Any]:
    """Settings by dotted name, with nested sections flattened."""
    flat = dotted(check_section(key, values))
    for name, value in flat.items():
        if re.split("[./]", name.lstrip("+~"))[0] in _SET_HERE:
            raise ConfigError(f"{key}.{name}", "another setting, since exneat sets this one", value)
    return flat


def plan_jobs(experiment: Experiment, budget: str, line: CommandLine, others: Sequence[str]) -> list[Job]:
    """Plan every run of an experiment: jobs called ``<condition>/<variant>/<seed>``, in this order.

    The user's settings in `line` apply to all runs and take precedence; `others` are not settings of runs.

    Raises:
        ExneatError: settings make no sense, in at least one of the runs.
    """
    if budget not in experiment.runs:
        raise ConfigError("budget", f"one that {experiment.name} has runs for, {', '.join(experiment.runs)}", budget)
    jobs: list[Job] = []
    for (place, condition), (name, variant) in product(experiment.conditions.items(), experiment.variants.items()):
        settings = {
            **experiment.settings,
            **condition.settings,
            **variant.settings,
            "sweep": (condition.sweeps if variant.swept else None) or "none",
            "name": f"{experiment.name}-{place}-{budget}",
        }
        try:
            texts = [read_setting(f"{key}={as_written(value)}", line.directories) for key, value in settings.items()]
            first = read_job("", replace(line, settings=(*texts, *line.settings, f"budget={budget}")), others)
            for k in range(variant.runs or experiment.runs[budget]):
                seeded = replace(first.settings, seed=first.settings.seed + k)
                jobs.append(replace(first, name=f"{place}/{name}/{seeded.seed}", settings=seeded))
        except ExneatError as error:
            raise ExneatError(f"{experiment.name}, {place}, {name}: {error}") from error
    places: dict[Path, Job] = {}
    for job in jobs:
        twin = places.setdefault(job.settings.directory.path, job)
        if twin is not job:
            raise ExneatError(f"{experiment.name}: {twin.name} and {job.name} are the same run; variants must differ")
    return jobs


def run(line: CommandLine) -> int:
    """Do the missing runs of an experiment; returns 0 if all runs are finished at the end, else 1.

    Raises:
        ExneatError: the experiment or a setting makes no sense; nothing is run then.
    """
    asked = line.compose("experiment", "budget", "publish")
    if not asked["experiment"]:
        check_known(line.compose(), ("experiment", "publish"))  # it may be misspelt
        raise ConfigError("experiment", "a name or a YAML file, e.g. experiment=track_maze", asked["experiment"])
    check_flag("publish", asked["publish"])
    experiment = read_experiment(asked["experiment"])
    jobs = plan_jobs(experiment, asked["budget"], line, ("experiment", "publish"))
    publishing = None
    if asked["publish"]:
        file, names = results_file(asked["experiment"]), (tuple(experiment.conditions), tuple(experiment.variants))
        publishing = partial(publish_jobs, file, asked["budget"], *names)
        publishing([job for job in jobs if job.is_finished()])
    pending = unfinished(jobs)
    for job in pending:
        check_worlds(job.settings.task)
    before = len(jobs) - len(pending)
    counted = f"{len(jobs)} runs, {before} of them already finished"
    print(f"{experiment.name}, budget {asked['budget']}: {counted}", flush=True)
    reasons = [""] * len(pending)
    try:
        reasons = do_jobs(jobs, pending, line, publishing)
    except ExneatError as error:
        if signal_heard() is not None or not any(job.is_finished() for job in pending):
            raise
        # A launcher gives up when one of its processes is killed; what was done by then counts.
        print(f"exneat: {error}", file=sys.stderr)
    reasons = [reason or _unfinished_because(job) for job, reason in zip(pending, reasons, strict=True)]
    failed = {job.name: reason for job, reason in zip(pending, reasons, strict=True) if reason}
    done = len(pending) - len(failed)
    _print_means(jobs)
    print(f"\n{experiment.name}: {done} runs done, {before} skipped (already finished), {len(failed)} failed")
    for name, reason in failed.items():
        print(f"  {name}: {reason}", file=sys.stderr)
    if failed:
        print("  run the same command again to do what is missing", file=sys.stderr)
    return 1 if failed else 0


def _print_means(jobs: Sequence[Job]) -> None:
    """Print the test fitness of the variants over their finished runs."""
    reached: dict[str, list[float]] = {}
    for job in jobs:
        if job.is_finished():
            result = job.settings.directory.read_result()
            reached.setdefault(job.name.rpartition("/")[0], []).append(result.champion.fitness_mean)
    if reached:
        print()
        rows = [[name, str(len(runs)), f"{np.mean(runs):.4g}", f"{np.std(runs):.3g}"] for name, runs in reached.items()]
        print_table([["condition/variant", "runs", "test fitness", "sd over runs"], *rows], numbers=(1, 2, 3))


def _unfinished_because(job: Job) -> str:
    """Why a job is not finished, from what it left on disk; empty if it is finished."""
    directory = job.settings.directory
    if job.is_finished():
        return ""
    try:
        manifest = directory.read_manifest()
    except ExneatError as error:
        return str(error) if directory.is_there() else "it was not started"
    if manifest.status == DONE:
        return "it was trained, but not tested at every level"
    return manifest.error or f"it did not finish (status {manifest.status})"
