"""Experiments: variants x conditions x seeds, from a YAML file to the settings of every run."""

from __future__ import annotations

import dataclasses
import json
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from omegaconf import DictConfig

from exneat_cli.commands.composition import BUDGETS, composing, settings_from, shipped_directory
from exneat_cli.commands.drawing import missing_figures
from exneat_cli.commands.sweeps import Sweeps, sweeps_from
from exneat_cli.errors import ConfigError, ExneatError, check_choice, check_whole
from exneat_cli.records import read_yaml
from exneat_cli.runs import RunSettings, check_sweeps, is_finished

_FIELDS = {
    "claim": (str,),
    "settings": (Mapping,),
    "variants": (Mapping,),
    "conditions": (Mapping,),
    "runs": (Mapping,),
}
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,39}")
_SET_HERE = {"seed", "name", "output", "resume", "sweep", "sweeps", "budget", "hydra"}
"""What the launcher sets itself, so that no variant or condition may."""


@dataclass(frozen=True)
class Variant:
    """One of the things compared.

    Attributes:
        label: for legends and tables.
        settings: overrides, as on the command line.
        runs: number of seeds; None takes the experiment's.
        swept: whether its runs are tested for robustness.
    """

    label: str
    settings: Mapping[str, Any]
    runs: int | None = None
    swept: bool = True


@dataclass(frozen=True)
class Condition:
    """One training condition: its label, overrides, and the robustness sweeps that its runs go through."""

    label: str
    settings: Mapping[str, Any]
    sweeps: tuple[str, ...] = ()


@dataclass(frozen=True)
class Experiment:
    """What experiments/<name>.yaml says.

    Attributes:
        name: of the file.
        claim: what it is to show.
        settings: overrides for all of its runs.
        variants: by name; the others are compared with the first.
        conditions: by name.
        runs: budget -> number of seeds of each variant, 0, 1, 2, ...
    """

    name: str
    claim: str
    settings: Mapping[str, Any]
    variants: Mapping[str, Variant]
    conditions: Mapping[str, Condition]
    runs: Mapping[str, int]


@dataclass(frozen=True)
class Job:
    """One run of an experiment: where it stands, its settings, and its robustness sweeps."""

    condition: str
    variant: str
    settings: RunSettings
    sweeps: Sweeps

    @property
    def name(self) -> str:
        """The job in one word, e.g. ``noise_0.05/neat/3``."""
        return f"{self.condition}/{self.variant}/{self.settings.seed}"

    def is_finished(self) -> bool:
        """Whether the run is done and was tested at every level; a damaged one is not."""
        try:
            return is_finished(self.settings, self.sweeps.sweeps, self.sweeps.episodes)
        except ExneatError:
            return False

    def is_drawn(self) -> bool:
        """Whether all figures of the finished run are there."""
        return not missing_figures(self.settings.directory, swept=bool(self.sweeps.sweeps))


def experiments_directory() -> Path:
    """experiments/, see `shipped_directory`."""
    return shipped_directory("experiments")


def experiment_names() -> list[str]:
    """Names of the experiments that come with exneat."""
    return sorted(path.stem for path in experiments_directory().glob("*.yaml") if path.stem != "catalogue")


def read_experiment(name: str) -> Experiment:
    """The experiment of that name, or the one in a YAML file of the user's own.

    Args:
        name: one of `experiment_names`, or a path that ends in ``.yaml``.

    Raises:
        ExneatError: there is no such experiment, or its file is damaged or makes no sense.
    """
    own = name.endswith((".yaml", ".yml"))
    if not own and name not in experiment_names():
        raise ConfigError("experiment", f"one of {', '.join(experiment_names())}, or a .yaml file", name)
    path = Path(name) if own else experiments_directory() / f"{name}.yaml"
    content = read_yaml(path)
    try:
        return _experiment(path.stem, _known("the file", content, _FIELDS))
    except ExneatError as error:
        raise ExneatError(f"{path}: {error}") from error


def _known(key: str, values: object, fields: Mapping[str, tuple[type, ...]]) -> Mapping[str, Any]:
    """Check a section's keys and the types of its values; those marked with None may be left out."""
    if not isinstance(values, Mapping):
        raise ConfigError(key, f"keys with values: {', '.join(fields)}", values)
    for name in values:
        if name not in fields:
            raise ExneatError(f"{key}: {name}: unknown key; known here: {', '.join(fields)}")
    for name, types in fields.items():
        if name not in values and type(None) not in types:
            raise ExneatError(f"{key}: {name} is missing")
        if not isinstance(values.get(name), types):
            expected = " or ".join(each.__name__ for each in types if each is not type(None))
            raise ConfigError(f"{key}: {name}", f"a value of type {expected}", values[name])
    return values


def _experiment(name: str, content: Mapping[str, Any]) -> Experiment:
    variants, conditions = content["variants"], content["conditions"]
    for part, entries in (("variants", variants), ("conditions", conditions)):
        if not entries:
            raise ConfigError(part, "at least one entry", entries)
    for key in (name, *variants, *conditions):
        if not isinstance(key, str) or not _NAME.fullmatch(key):
            raise ConfigError("name", "at most 40 letters, digits, '.', '_' and '-'", key)
    if not content["runs"]:
        raise ConfigError("runs", f"a number of runs for one of {', '.join(BUDGETS)}", content["runs"])
    for budget, runs in content["runs"].items():
        check_choice("runs", budget, BUDGETS)
        check_whole(f"runs.{budget}", runs, 1, 10_000)
    return Experiment(
        name=name,
        claim=content["claim"],
        settings=_overrides("settings", content["settings"]),
        variants={key: _variant(f"variants.{key}", entry) for key, entry in variants.items()},
        conditions={key: _condition(f"conditions.{key}", entry) for key, entry in conditions.items()},
        runs=dict(content["runs"]),
    )


def _variant(key: str, entry: object) -> Variant:
    fields = {"label": (str,), "settings": (Mapping,), "runs": (int, type(None)), "swept": (bool, type(None))}
    values = _known(key, entry, fields)
    if values.get("runs") is not None:
        check_whole(f"{key}.runs", values["runs"], 1, 10_000)
    return Variant(**{**values, "settings": _overrides(f"{key}.settings", values["settings"])})


def _condition(key: str, entry: object) -> Condition:
    values = _known(key, entry, {"label": (str,), "settings": (Mapping,), "sweeps": (list, type(None))})
    sweeps = values.get("sweeps") or []
    for sweep in sweeps:
        if not isinstance(sweep, str):
            raise ConfigError(f"{key}.sweeps", "names of sweeps", sweep)
    return Condition(values["label"], _overrides(f"{key}.settings", values["settings"]), tuple(sweeps))


def _overrides(key: str, values: Mapping[str, Any]) -> Mapping[str, Any]:
    """Settings by dotted name; sections within sections are spelled out."""
    flat: dict[str, Any] = {}
    for name, value in values.items():
        section = str(name).lstrip("+~").partition(".")[0].partition("/")[0]
        if section in _SET_HERE:
            raise ConfigError(f"{key}.{name}", "another setting, since exneat sets this one", value)
        if isinstance(value, Mapping):
            flat.update({f"{name}.{inner}": each for inner, each in _overrides(f"{key}.{name}", value).items()})
        elif value is None or isinstance(value, str | int | float | list):
            flat[str(name)] = value
        else:
            raise ConfigError(f"{key}.{name}", "a word, a number, true, false, null or a list", value)
    return flat


def plan_jobs(experiment: Experiment, budget: str, overrides: Sequence[str] = ()) -> list[Job]:
    """Every run of an experiment, condition by condition and variant by variant.

    Args:
        experiment: what is compared.
        budget: ``paper``, ``quick`` or ``smoke``.
        overrides: the user's own, for all runs; they win.

    Raises:
        ExneatError: settings make no sense, in at least one of the runs.
    """
    if budget not in experiment.runs:
        raise ConfigError("budget", f"one that {experiment.name} has runs for, {', '.join(experiment.runs)}", budget)
    jobs: list[Job] = []
    with composing() as compose:
        for condition in experiment.conditions:
            for variant in experiment.variants:
                try:
                    jobs += _jobs(experiment, condition, variant, budget, overrides, compose)
                except ExneatError as error:
                    raise ExneatError(f"{experiment.name}, {condition}, {variant}: {error}") from error
    places: dict[Path, Job] = {}
    for job in jobs:
        twin = places.setdefault(job.settings.directory.path, job)
        if twin is not job:
            raise ExneatError(f"{experiment.name}: {twin.name} and {job.name} are the same run; variants must differ")
    return jobs


def _jobs(
    experiment: Experiment,
    condition: str,
    variant: str,
    budget: str,
    overrides: Sequence[str],
    compose: Callable[[Sequence[str]], DictConfig],
) -> Iterable[Job]:
    chosen, where = experiment.variants[variant], experiment.conditions[condition]
    sweeps = f"[{','.join(where.sweeps)}]" if where.sweeps and chosen.swept else "none"
    settings = {**experiment.settings, **where.settings, **chosen.settings}
    config = compose(
        [
            *(f"{key}={value if isinstance(value, str) else json.dumps(value)}" for key, value in settings.items()),
            f"budget={budget}",
            f"sweep={sweeps}",
            f"name={experiment.name}-{condition}-{budget}",
            *overrides,
        ]
    )
    first = settings_from(config)
    asked = sweeps_from(config, first.task.name)
    check_sweeps(first, asked.sweeps, asked.episodes)
    seeds = range(chosen.runs or experiment.runs[budget])
    return [Job(condition, variant, dataclasses.replace(first, seed=first.seed + k), asked) for k in seeds]


def budget_of(overrides: Sequence[str]) -> tuple[str | None, list[str]]:
    """The ``budget=`` among overrides, and the others."""
    chosen, rest = None, []
    for override in overrides:
        key, _, value = override.partition("=")
        if key == "budget":
            chosen = value
        else:
            rest.append(override)
    return chosen, rest
