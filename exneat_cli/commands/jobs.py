"""One run as the commands do it: trained, tested under its robustness sweeps, and drawn."""

from __future__ import annotations

import dataclasses
import glob
import shlex
import sys
import threading
from collections.abc import Mapping, Sequence
from typing import Any

from exneat_cli.commands.command_line import CommandLine
from exneat_cli.commands.drawing import film_champion
from exneat_cli.commands.setting import as_written
from exneat_cli.errors import ConfigError, ExneatError, check_choice, check_flag, check_keys, check_path, check_section
from exneat_cli.records import RunDirectory, runs_at
from exneat_cli.rollouts import Executor, Sweep
from exneat_cli.runs import Finished, Progress, RunSettings, check_sweeps, is_finished, run_robustness, tracked, train
from exneat_cli.tasks.user_code import NAMED, code_in

_one_at_a_time = threading.Lock()
"""Runs that train side by side take turns at drawing, whose state is shared by the whole process."""
BUDGETS = ("paper", "quick", "smoke")
"""What ``budget=`` may be, the largest first."""
_SETTINGS = tuple(f.name for f in dataclasses.fields(RunSettings) if f.name != "task_kind")
_SPENT = ("generations", "population", "episodes", "validation_episodes", "test_episodes", "sweep_episodes")
_OF_MODULES = ("linkage", "wiring.central", "wiring.trunk", "wiring.output_width")
"""Settings that a recipe may make impossible."""
_OF_SWEEPS = ("parameter", "label", "levels")


@dataclasses.dataclass(frozen=True)
class Job:
    """One run: what it is called, its settings, sweeps, test episodes per level, and whether it is filmed."""

    name: str
    settings: RunSettings
    sweeps: tuple[Sweep, ...]
    episodes: int
    video: bool = False

    def is_finished(self) -> bool:
        """Whether the run is done and was tested at every level; a damaged one is not."""
        try:
            return is_finished(self.settings, self.sweeps, self.episodes)
        except ExneatError:
            return False

    def do(self, progress: Progress, command: Sequence[str], *, go_on: bool) -> Finished:
        """Train, test and draw whatever is not done yet.

        Raises:
            ExneatError: the run directory is unusable, or holds something else than this run.
        """
        with tracked(self.settings.trackers) as tracking:
            finished = train(self.settings, progress=progress, command=command, go_on=go_on, tracking=tracking)
            with _one_at_a_time:
                self.test(finished.directory, self.settings.executor, progress)
                if self.video and not self.settings.algorithm.rule:
                    self._film(finished.directory)
            tracking.pictures(finished.directory)
        return finished

    def _film(self, directory: RunDirectory) -> None:
        """Film the champion, unless that is done; if something needed is missing, a line says so."""
        try:
            film_champion(directory)
        except ExneatError as error:
            why = str(error).splitlines()
            print(f"exneat: {directory.path.name}: no video: {'; '.join(map(str.strip, why))}", file=sys.stderr)

    def resuming(self, words: Sequence[str]) -> str:
        """The command that resumes the run, ready to paste; a user's own task is named as in the `words` typed."""
        path = str(self.settings.directory.path)
        is_plain = all(character.isalnum() or character in "/._-" for character in path)
        typed = [word for word in words if word.startswith(("task.kind=", "task.env_id=", "sweep=", "sweep.levels="))]
        episodes = [f"sweep.episodes={self.episodes}"] if self.sweeps else []
        return shlex.join(["exneat", "resume", f"run={path if is_plain else as_written(path)}", *typed, *episodes])

    def test(self, directory: RunDirectory, executor: Executor, progress: Progress) -> int:
        """Test the finished run at the missing levels and draw the missing figures; returns how many levels it tested.

        Raises:
            ExneatError: another process holds the directory, it is damaged, or a figure cannot be written.
        """
        done = 0
        if self.sweeps:
            done = run_robustness(directory, self.sweeps, episodes=self.episodes, executor=executor, progress=progress)
        self.draw(directory)
        return done

    def missing_figures(self, directory: RunDirectory) -> list[str]:
        """Names of the figures that have data but no picture or, for robustness, an outdated one."""
        data = {"training": directory.history, "path": directory.trace, "network": directory.champion}
        plots = directory.plots
        missing = [name for name, path in data.items() if path.exists() and not (plots / f"{name}.svg").exists()]
        if self.sweeps and directory.robustness.exists():
            picture = plots / "robustness.svg"
            if not picture.exists() or picture.stat().st_mtime < directory.robustness.stat().st_mtime:  # it may grow
                missing.append("robustness")
        return missing

    def draw(self, directory: RunDirectory) -> None:
        """Draw the figures that are missing.

        Raises:
            ExneatError: another process holds the directory, or a figure cannot be written.
        """
        if not self.missing_figures(directory):
            return
        from exneat_cli.analysis import draw_network, draw_path, draw_robustness, draw_training

        fitness, labels = self.settings.task.fitness_name, {sweep.name: sweep.label for sweep in self.sweeps}
        draw = {
            "training": lambda: draw_training(directory, fitness, directory.read_result().champion.fitness_mean),
            "path": lambda: draw_path(directory),
            "network": lambda: draw_network(directory),
            "robustness": lambda: draw_robustness(directory, labels, fitness, self.trained_levels()),
        }
        with directory.held():  # nobody may change the data between reading and drawing
            for name in self.missing_figures(directory):
                draw[name]()

    def trained_levels(self) -> dict[str, float]:
        """The value that the setting of each sweep had in training, if it is a number."""
        plain, levels = self.settings.to_plain(), {}
        for sweep in self.sweeps:
            section, _, key = sweep.parameter.partition(".")
            if isinstance(value := plain[section].get(key), int | float):
                levels[sweep.name] = float(value)
        return levels


def name_code(line: CommandLine, plain: Mapping[str, Any]) -> None:
    """Allow the import of the code that a task's settings refer to, as far as the user named it."""
    code = code_in(check_section("task", plain.get("task", {})))
    NAMED.update(reference for key, reference in code.items() if line.names(key))


def name_code_of_runs(line: CommandLine, plain: Mapping[str, Any]) -> None:
    """See `name_code`, for a command that takes the rest of a task from the runs themselves."""
    check_keys("task.", check_section("task", plain["task"]), ("kind", "env_id"))
    name_code(line, plain)


def finished_runs(pattern: object) -> list[RunDirectory]:
    """The run directories that ``run=`` names.

    Raises:
        ExneatError: it is not text, or a pattern that matches no run.
    """
    path = check_path("run", pattern, "a run directory, or a pattern such as 'outputs/ant/*'")
    if found := runs_at(path):
        return found
    if not glob.has_magic(str(path)):
        return [RunDirectory(path)]  # its reader says that it does not exist
    raise ConfigError("run", "a run directory, or a pattern that matches some", pattern, "exneat inspect lists runs")


def check_known(plain: Mapping[str, Any], others: Sequence[str] = ()) -> None:
    """Refuse keys that are neither a run's nor among `others` with an `ExneatError`."""
    check_keys("", plain, (*_SETTINGS, "recipe", "budget", "budgets", "sweep", "sweeps", "video", *others))


def read_job(name: str, line: CommandLine, others: Sequence[str] = ()) -> Job:
    """Compose and check the settings of a run, besides which `others` may be set, and make a job of them.

    Raises:
        ExneatError: a key is unknown or missing, a value is of the wrong type or out of range, or a sweep does not fit.
    """
    plain = line.compose()
    name_code(line, plain)
    check_known(plain, others)
    check_flag("video", plain.get("video", False))
    for budget, spent in check_section("budgets", plain.get("budgets", {})).items():
        check_choice(f"budgets.{budget}", budget, BUDGETS)
        check_keys(f"budgets.{budget}.", check_section(f"budgets.{budget}", spent), _SPENT)
    try:
        settings = RunSettings.from_plain({key: plain[key] for key in _SETTINGS if key in plain})
    except ConfigError as error:
        key, expected, came, fix = error.args
        if plain.get("recipe") == "walking" and key in _OF_MODULES:
            fix = "; ".join(filter(None, [fix, "recipe=thesis has hidden nodes and a central module"]))
        raise ConfigError(key, expected, came, fix) from error
    return dataclasses.replace(with_sweeps(name, settings, plain), video=plain.get("video", False))


def with_sweeps(name: str, settings: RunSettings, plain: Mapping[str, Any]) -> Job:
    """The job of a run with these settings and a configuration's ``sweeps``, to all of which ``sweep`` applies.

    Raises:
        ExneatError: a key is unknown or missing, levels are out of range, or a sweep does not fit the task.
    """
    task, sweeps = settings.task.name, []
    common = check_section("sweep", plain.get("sweep", {}))
    check_keys("sweep.", common, ("levels", "episodes"))
    for sweep, entry in check_section("sweeps", plain.get("sweeps", {})).items():
        key = f"sweeps.{sweep}"
        check_keys(f"{key}.", check_section(key, entry), _OF_SWEEPS)
        for part in _OF_SWEEPS:
            if part not in entry:
                raise ExneatError(f"{key}.{part}: is missing")
        by_task, levels = check_section(f"{key}.levels", entry["levels"]), common.get("levels")
        if levels is None:
            levels = by_task.get(task, by_task.get("other"))
            if levels is None:
                raise ConfigError("sweep", f"a sweep that fits task={task}", sweep, f"it fits {', '.join(by_task)}")
        if not isinstance(levels, list):
            raise ConfigError("sweep.levels", "a list of numbers, e.g. [0, 0.1]", levels)
        sweeps.append(Sweep(sweep, str(entry["parameter"]), tuple(levels), str(entry["label"])))
    episodes = common.get("episodes", 1)
    check_sweeps(settings, sweeps, episodes)
    return Job(name, settings, tuple(sweeps), episodes)
