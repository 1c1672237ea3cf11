"""One run as the commands do it: trained, tested under its robustness sweeps, and drawn."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from exneat_cli.errors import ConfigError, ExneatError, check_choice, check_keys, check_section
from exneat_cli.records import RunDirectory, build
from exneat_cli.rollouts import Executor, Sweep
from exneat_cli.runs import Finished, Progress, RunSettings, check_sweeps, is_finished, run_robustness, train

BUDGETS = ("paper", "quick", "smoke")
"""What ``budget=`` may be, the largest first."""
_SETTINGS = tuple(f.name for f in dataclasses.fields(RunSettings))
_NO_SETTINGS = ("budget", "budgets", "sweep", "sweeps")
"""What a composed configuration holds besides settings of the run."""
_SPENT = ("generations", "population", "episodes", "validation_episodes", "test_episodes", "sweep_episodes")


class Sweeps(NamedTuple):
    """What is perturbed after training.

    Attributes:
        sweeps: one after another.
        episodes: test episodes per level.
        labels: of the axes, by name.
    """

    sweeps: tuple[Sweep, ...]
    episodes: int
    labels: dict[str, str]


@dataclass(frozen=True)
class Perturbation:
    """What a file in conf/sweep says: the setting that is varied, the label of its axis, and its levels by task."""

    parameter: str
    label: str
    levels: Mapping[str, list[float]]


@dataclass(frozen=True)
class Job:
    """One run: what it is called, its settings, and its robustness sweeps."""

    name: str
    settings: RunSettings
    sweeps: Sweeps

    def is_finished(self) -> bool:
        """Whether the run is done and was tested at every level; a damaged one is not."""
        try:
            return is_finished(self.settings, self.sweeps.sweeps, self.sweeps.episodes)
        except ExneatError:
            return False

    def is_drawn(self) -> bool:
        """Whether all figures of the finished run are there."""
        return not missing_figures(self.settings.directory, swept=bool(self.sweeps.sweeps))

    def do(self, progress: Progress, command: Sequence[str], *, go_on: bool) -> Finished:
        """Train, test and draw, as far as that is not done yet.

        Raises:
            ExneatError: the run directory is unusable, or holds something else.
        """
        finished = train(self.settings, progress=progress, command=command, go_on=go_on)
        run_sweeps(finished.directory, self.settings, self.sweeps, self.settings.executor, progress)
        return finished


def read_job(name: str, plain: Mapping[str, Any], others: Sequence[str] = ()) -> Job:
    """Check a composed configuration, and make dataclasses of it.

    Args:
        name: of the job.
        plain: the configuration.
        others: keys in it that are no settings of the run.

    Raises:
        ExneatError: a key is unknown or missing, a value is of the wrong type or out of range, or a sweep does not fit.
    """
    check_keys("", plain, (*_SETTINGS, *_NO_SETTINGS, *others))
    for budget, spent in check_section("budgets", plain.get("budgets", {})).items():
        check_choice(f"budgets.{budget}", budget, BUDGETS)
        check_keys(f"budgets.{budget}.", check_section(f"budgets.{budget}", spent), _SPENT)
    settings = RunSettings.from_plain({key: plain[key] for key in _SETTINGS if key in plain})
    return Job(name, settings, read_sweeps(plain, settings))


def read_sweeps(plain: Mapping[str, Any], settings: RunSettings) -> Sweeps:
    """The robustness sweeps that a composed configuration asks for.

    Args:
        plain: has ``sweeps``, by name, and ``sweep.levels`` and ``sweep.episodes`` for all of them.
        settings: of the run that is tested.

    Raises:
        ExneatError: a key is unknown or missing, levels are out of range, or a sweep does not fit the task.
    """
    task = settings.task.name
    common = check_section("sweep", plain.get("sweep", {}))
    check_keys("sweep.", common, ("levels", "episodes"))
    sweeps, labels = [], {}
    for name, entry in check_section("sweeps", plain.get("sweeps", {})).items():
        asked = build(Perturbation, entry, f"sweeps.{name}.")
        by_task = check_section(f"sweeps.{name}.levels", asked.levels)
        if common.get("levels") is None and task not in by_task:
            raise ConfigError("sweep", f"a sweep that fits task={task}", name, f"it fits {', '.join(by_task)}")
        levels = by_task[task] if common.get("levels") is None else common["levels"]
        if not isinstance(levels, list):
            raise ConfigError("sweep.levels", "a list of numbers, e.g. [0, 0.1]", levels)
        sweeps.append(Sweep(name, str(asked.parameter), tuple(levels)))
        labels[name] = str(asked.label)
    episodes = common.get("episodes", 1)
    check_sweeps(settings, sweeps, episodes)
    return Sweeps(tuple(sweeps), episodes, labels)


def run_sweeps(
    directory: RunDirectory, settings: RunSettings, sweeps: Sweeps, executor: Executor, progress: Progress
) -> int:
    """Test a finished run at the levels that are missing, and draw the figures that are; returns how many levels.

    Raises:
        ExneatError: another process holds the directory, it is damaged, or a figure cannot be written.
    """
    tested = 0
    if sweeps.sweeps:
        tested = run_robustness(
            directory, sweeps.sweeps, episodes=sweeps.episodes, executor=executor, progress=progress
        )
    draw_what_is_missing(directory, settings.task.fitness_name, sweeps.labels)
    return tested


def missing_figures(directory: RunDirectory, *, swept: bool) -> list[str]:
    """Names of the figures that a finished run has data for, but no picture; of robustness also an older one."""
    data = {"training": directory.history, "path": directory.trace, "network": directory.champion}
    pictures = {name: directory.plots / f"{name}.svg" for name in (*data, "robustness")}
    missing = [name for name, path in data.items() if path.exists() and not pictures[name].exists()]
    if swept and directory.robustness.exists():
        picture, changed = pictures["robustness"], directory.robustness.stat().st_mtime
        if not picture.exists() or picture.stat().st_mtime < changed:  # its data may grow later on
            missing.append("robustness")
    return missing


def draw_what_is_missing(directory: RunDirectory, fitness_name: str, labels: Mapping[str, str]) -> None:
    """Draw training, path, network and robustness, as far as there is data for them.

    Args:
        directory: of a finished run.
        fitness_name: label of the fitness axis.
        labels: of the axes of robustness sweeps, by name.

    Raises:
        ExneatError: another process holds the directory, or a figure cannot be written.
    """
    if not missing_figures(directory, swept=bool(labels)):
        return
    from exneat_cli.analysis import draw_network, draw_path, draw_robustness, draw_training

    draw = {
        "training": lambda: draw_training(directory, fitness_name),
        "path": lambda: draw_path(directory),
        "network": lambda: draw_network(directory),
        "robustness": lambda: draw_robustness(directory, labels, fitness_name),
    }
    with directory.held():  # nobody may change the data between reading and drawing
        for name in missing_figures(directory, swept=bool(labels)):
            draw[name]()
