"""Experiments: arms x conditions x seeds, from a YAML file to the settings of every run."""

from __future__ import annotations

import dataclasses
import json
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml
from omegaconf import DictConfig

import exneat_cli
from exneat_cli.commands.composition import composing, settings_from
from exneat_cli.commands.sweeps import Sweeps, sweeps_from
from exneat_cli.errors import ConfigError, ExneatError, check_choice, check_whole
from exneat_cli.runs import RunSettings, check_sweeps, is_finished

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,39}")
_FORBIDDEN = ("seed", "name", "resume", "sweep", "budget")
_BUDGETS = ("paper", "quick", "smoke")


@dataclass(frozen=True)
class Arm:
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
        arms: by name; the others are compared with the first.
        conditions: by name.
        runs: budget -> number of seeds of each arm, 0, 1, 2, ...
    """

    name: str
    claim: str
    settings: Mapping[str, Any]
    arms: Mapping[str, Arm]
    conditions: Mapping[str, Condition]
    runs: Mapping[str, int]


@dataclass(frozen=True)
class Job:
    """One run of an experiment: where it stands, its settings, and its robustness sweeps."""

    condition: str
    arm: str
    settings: RunSettings
    sweeps: Sweeps

    @property
    def name(self) -> str:
        """The job in one word, e.g. ``noise_0.05/neat/3``."""
        return f"{self.condition}/{self.arm}/{self.settings.seed}"

    def is_finished(self) -> bool:
        """Whether the run is done and was tested at every level."""
        return is_finished(self.settings, self.sweeps.sweeps, self.sweeps.episodes)


def experiments_directory() -> Path:
    """experiments/: the copy inside an installed package, else the one beside it in a checkout."""
    package = Path(exneat_cli.__file__).parent
    packaged = package / "experiments"
    return packaged if packaged.is_dir() else package.parent / "experiments"


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
    if not name.endswith(".yaml"):
        check_choice("experiment", name, experiment_names())
    path = Path(name) if name.endswith(".yaml") else experiments_directory() / f"{name}.yaml"
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ExneatError(f"experiment={name}: {path} could not be read: {error.strerror}") from error
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise ExneatError(f"{path}: expected YAML, got something else: {' '.join(str(error).split())}") from error
    try:
        return _experiment(path.stem, content)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise ExneatError(f"{path}: expected claim, settings, arms, conditions and runs: {error!r}") from error
    except ExneatError as error:
        raise ExneatError(f"{path}: {error}") from error


def _experiment(name: str, content: Mapping[str, Any]) -> Experiment:
    if unknown := set(content) - {f.name for f in dataclasses.fields(Experiment)} | set(content) & {"name"}:
        raise ValueError(f"{sorted(unknown)[0]}: unknown key")
    experiment = Experiment(
        name=name,
        claim=str(content["claim"]),
        settings=_overrides("settings", content["settings"]),
        arms={str(key): Arm(**entry) for key, entry in content["arms"].items()},
        conditions={str(key): Condition(**entry) for key, entry in content["conditions"].items()},
        runs=dict(content["runs"]),
    )
    for key in (name, *experiment.arms, *experiment.conditions):
        if not _NAME.fullmatch(key):
            raise ConfigError(key, "a short name of letters, digits, '.', '_' and '-'", key)
    for part, entries in (("arms", experiment.arms), ("conditions", experiment.conditions)):
        if not entries:
            raise ConfigError(part, "at least one entry", {})
        for key, entry in entries.items():
            _overrides(f"{part}.{key}.settings", entry.settings)
    for budget, runs in experiment.runs.items():
        check_choice("runs", budget, _BUDGETS)
        check_whole(f"runs.{budget}", runs, 1, 10_000)
    for key, arm in experiment.arms.items():
        if arm.runs is not None:
            check_whole(f"arms.{key}.runs", arm.runs, 1, 10_000)
    return experiment


def _overrides(key: str, values: object) -> Mapping[str, Any]:
    if not isinstance(values, Mapping):
        raise ConfigError(key, "settings by name, as on the command line, or {}", values)
    for name in values:
        if name in _FORBIDDEN:
            raise ConfigError(f"{key}.{name}", "another setting, since exneat sets this one", values[name])
    return values


def plan_jobs(experiment: Experiment, budget: str, overrides: Sequence[str] = ()) -> list[Job]:
    """Every run of an experiment, condition by condition and arm by arm.

    Args:
        experiment: what is compared.
        budget: ``paper``, ``quick`` or ``smoke``.
        overrides: the user's own, for all runs; they win.

    Raises:
        ExneatError: settings make no sense, in at least one of the runs.
    """
    check_choice("budget", budget, tuple(experiment.runs))
    jobs: list[Job] = []
    with composing() as compose:
        for condition in experiment.conditions:
            for arm in experiment.arms:
                jobs += _jobs(experiment, condition, arm, budget, overrides, compose)
    return jobs


def _jobs(
    experiment: Experiment,
    condition: str,
    arm: str,
    budget: str,
    overrides: Sequence[str],
    compose: Callable[[Sequence[str]], DictConfig],
) -> Iterable[Job]:
    chosen, where = experiment.arms[arm], experiment.conditions[condition]
    sweeps = f"[{','.join(where.sweeps)}]" if where.sweeps and chosen.swept else "none"
    settings = {**experiment.settings, **where.settings, **chosen.settings}
    config = compose(
        [
            *(f"{key}={value if isinstance(value, str) else json.dumps(value)}" for key, value in settings.items()),
            f"budget={budget}",
            f"sweep={sweeps}",
            f"name={experiment.name}-{condition}-{budget}",
            "resume=true",
            *overrides,
        ]
    )
    first = settings_from(config)
    asked = sweeps_from(config, first.task.name)
    check_sweeps(first, asked.sweeps, asked.episodes)
    seeds = range(chosen.runs or experiment.runs[budget])
    return [Job(condition, arm, dataclasses.replace(first, seed=first.seed + k), asked) for k in seeds]


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
