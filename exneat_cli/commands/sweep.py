"""`exneat sweep`: all runs of an experiment, through Hydra's multirun."""

from __future__ import annotations

import sys
import time
import traceback
from collections.abc import Sequence

from hydra.core.hydra_config import HydraConfig
from omegaconf import DictConfig

from exneat_cli.commands.composition import run_composed
from exneat_cli.commands.drawing import draw_what_is_missing
from exneat_cli.commands.experiments import Experiment, Job, budget_of, plan_jobs, read_experiment
from exneat_cli.errors import ExneatError
from exneat_cli.records import DONE
from exneat_cli.runs import Silence, progress_for_terminal, run_robustness, train

_BASIC_LAUNCHER = "hydra._internal.core_plugins.basic_launcher.BasicLauncher"


def run(arguments: Sequence[str]) -> int:
    """Do what is missing of an experiment; returns 0 if all of it is there at the end, else 1.

    Raises:
        ExneatError: the experiment or a setting makes no sense; nothing was run then.
    """
    name, for_hydra, overrides = _sorted_arguments(arguments)
    experiment = read_experiment(name)
    chosen, overrides = budget_of(overrides)
    budget = chosen or "quick"
    jobs = plan_jobs(experiment, budget, overrides)
    pending = [job for job in jobs if not job.is_finished()]
    done_before = len(jobs) - len(pending)
    print(f"{experiment.name}, budget {budget}: {len(jobs)} runs, {done_before} of them finished before", flush=True)
    launch = Launch(jobs, pending, ["exneat", "sweep", *arguments], time.time())
    if pending:
        names = ",".join(f"'{job.name}'" for job in pending)
        run_composed("exneat sweep", ["--multirun", f"+job={names}", *for_hydra], launch)
    return _summarise(experiment, launch, done_before)


def _sorted_arguments(arguments: Sequence[str]) -> tuple[str, list[str], list[str]]:
    """The experiment's name, what is meant for Hydra itself, and overrides for all runs."""
    name, for_hydra, overrides = "", [], []
    for argument in arguments:
        key, _, value = argument.partition("=")
        if key == "experiment":
            name = value
        elif argument in ("-m", "--multirun"):
            continue
        elif key.lstrip("+~").startswith("hydra"):
            for_hydra.append(argument)
        elif argument.startswith("-"):
            raise ExneatError(f"{argument}: unknown flag; exneat sweep takes settings, written key=value")
        else:
            overrides.append(argument)
    if not name:
        raise ExneatError("experiment: expected a name or a YAML file, e.g. exneat sweep experiment=track_maze")
    return name, for_hydra, overrides


class Launch:
    """What Hydra calls for each job, here or in another process; failures stay with the job.

    Args:
        jobs: all of the experiment's.
        pending: those to be done.
        command: the command line, for manifests.
        began: seconds since the epoch.
    """

    def __init__(self, jobs: Sequence[Job], pending: Sequence[Job], command: Sequence[str], began: float) -> None:
        self.jobs = jobs
        self.pending = {job.name: job for job in pending}
        self.command = command
        self.began = began
        self.errors: dict[str, str] = {}

    def __call__(self, config: DictConfig) -> None:
        """Do the job that `config` names."""
        job = self.pending[config.job]
        in_turn = HydraConfig.get().launcher["_target_"] == _BASIC_LAUNCHER
        began = time.time()
        try:
            figure = self._do(job, show_bar=in_turn and sys.stderr.isatty())
        except ExneatError as error:
            self._tell_failure(job, str(error))
        except Exception as error:
            traceback.print_exc()
            self._tell_failure(job, f"{type(error).__name__}: {error}")
        else:
            print(f"{self._count()} {job.name}: {figure} in {time.time() - began:.1f} s{self._left()}", flush=True)

    def _do(self, job: Job, *, show_bar: bool) -> str:
        settings, asked = job.settings, job.sweeps
        progress = progress_for_terminal() if show_bar else Silence()
        finished = train(settings, progress=progress, command=self.command)
        directory = finished.directory
        tested = run_robustness(
            directory, asked.sweeps, episodes=asked.episodes, executor=settings.executor, progress=progress
        )
        draw_what_is_missing(directory, settings.task.fitness_name, asked.labels, again=tested > 0)
        champion = finished.result["champion"]
        return f"{settings.task.fitness_name} {champion['fitness_mean']:.{settings.task.fitness_decimals}f}"

    def _tell_failure(self, job: Job, reason: str) -> None:
        self.errors[job.name] = reason
        print(f"{self._count()} {job.name}: failed: {reason}", file=sys.stderr, flush=True)

    def _finished(self) -> int:
        return sum(job.is_finished() for job in self.jobs)

    def _count(self) -> str:
        return f"[{self._finished():>{len(str(len(self.jobs)))}}/{len(self.jobs)}]"

    def _left(self) -> str:
        left = len(self.jobs) - self._finished()
        done = len(self.pending) - left
        if left == 0 or done <= 0:
            return ""
        seconds = (time.time() - self.began) / done * left
        return f", about {seconds / 60:.0f} min left" if seconds >= 90 else f", about {seconds:.0f} s left"


def _summarise(experiment: Experiment, launch: Launch, done_before: int) -> int:
    failed = [job for job in launch.pending.values() if job.name in launch.errors or not job.is_finished()]
    now = len(launch.pending) - len(failed)
    print(f"\n{experiment.name}: {now} runs done, {done_before} skipped as finished before, {len(failed)} failed")
    for job in failed:
        print(f"  {job.name}: {launch.errors.get(job.name) or _reason_on_disk(job)}", file=sys.stderr)
    if failed:
        print("  the same command does what is missing", file=sys.stderr)
    return 1 if failed else 0


def _reason_on_disk(job: Job) -> str:
    directory = job.settings.directory
    if not directory.is_there():
        return "it was not begun"
    manifest = directory.read_manifest()
    if manifest.get("status") == DONE:
        return "it was trained, but not tested at every level"
    return str(manifest.get("error", f"it did not finish (status {manifest.get('status')})"))
