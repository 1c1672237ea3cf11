"""Doing several jobs: here, one after another or together on a GPU, or elsewhere by a Hydra launcher."""

from __future__ import annotations

import contextlib
import functools
import os
import sys
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

from hydra._internal.callbacks import Callbacks
from hydra.core.global_hydra import GlobalHydra
from hydra.core.plugins import Plugins
from hydra.types import HydraContext
from omegaconf import OmegaConf

from exneat_cli.algorithms import ALGORITHMS
from exneat_cli.commands.command_line import CommandLine, in_words
from exneat_cli.commands.jobs import Job
from exneat_cli.errors import ExneatError
from exneat_cli.interruption import as_worker, launching, scratch_directory, signal_heard
from exneat_cli.output import forgiving_output
from exneat_cli.rollouts import keep_workers
from exneat_cli.tasks import TASKS
from exneat_cli.tasks.user_code import NAMED
from exneat_cli.wiring import LINKAGES

MOST_SIDE_BY_SIDE = 1024
"""At most this many runs train at once on one GPU."""
_REGISTRIES: tuple[Any, ...] = (TASKS, ALGORITHMS, LINKAGES, NAMED)
"""Registries to which a program or its user may have added; workers, which run another program, need the same."""
_WRITING_NOTHING = (
    *("hydra/job_logging=none", "hydra/hydra_logging=none", "hydra.output_subdir=null"),
    *("hydra.sweep.dir=.", "hydra.sweep.subdir=."),
)
"""Without these, Hydra would make directories, write its own files there and open a log."""


def run_jobs(work: Callable[[Job], None], jobs: Sequence[Job], line: CommandLine) -> list[str]:
    """Do `work` for each job; returns why each failed, empty if it did not.

    Args:
        work: what to do; picklable if the command line names a launcher.
        jobs: for which to do it.
        line: names the launcher.

    Raises:
        ExneatError: there is no such launcher, or it gave up; some jobs may be done by then.
    """
    if not line.launcher:
        with keep_workers():  # starting one takes seconds
            here = functools.partial(_do, work, jobs, None)
            numbers = [{"job": k} for k in range(len(jobs))]
            if side_by_side(jobs):
                # Their episodes share batches of worlds, which one run alone would not fill.
                with ThreadPoolExecutor(MOST_SIDE_BY_SIDE, thread_name_prefix="run") as pool:
                    return list(pool.map(here, numbers))
            return list(map(here, numbers))
    with scratch_directory() as workplace:
        known = [registry.copy() for registry in _REGISTRIES]
        here = functools.partial(_do_here, Path.cwd(), known, functools.partial(_do, work, jobs, workplace))
        with _importable():
            return _launch(here, len(jobs), line, workplace)


def side_by_side(jobs: Sequence[Job]) -> bool:
    """Whether jobs without a launcher run together here."""
    return all(job.settings.executor.name == "warp" for job in jobs)


def _launch(task: Callable[..., str], count: int, line: CommandLine, workplace: Path) -> list[str]:
    """Have a launcher do `task` for `count` jobs; workers lock `workplace`, a directory of this machine."""
    with replace(line, primary=None, settings=(*_WRITING_NOTHING, *line.launcher)).composed() as config:
        try:
            config.hydra.sweep.dir = os.path.expanduser(config.hydra.sweep.dir)
            OmegaConf.resolve(config.hydra.launcher)
            _refuse_calls(OmegaConf.to_container(config), "")
            context = HydraContext(config_loader=GlobalHydra.instance().config_loader(), callbacks=Callbacks())
            launcher = Plugins.instance().instantiate_launcher(context, task, config)
            with launching(workplace):
                done = launcher.launch([[f"+job={k}"] for k in range(count)], initial_job_idx=0)
            return [str(each.return_value) for each in done]
        except ExneatError:
            raise
        except Exception as error:  # launchers and their libraries raise errors of many kinds
            if signal_heard() is not None:
                raise
            raise ExneatError(in_words(error, line.directories)) from error


@contextlib.contextmanager
def _importable() -> Iterator[None]:
    """Let processes started within the block import what this one can, also from its program's directory."""
    before = os.environ.get("PYTHONPATH")
    os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, sys.path))
    try:
        yield
    finally:
        os.environ.pop("PYTHONPATH")
        if before is not None:
            os.environ["PYTHONPATH"] = before


def _do_here(
    directory: Path, known: Sequence[Any], task: Callable[[Mapping[str, int]], str], config: Mapping[str, int]
) -> str:
    """Do one job in a worker; joblib reuses workers, which may have begun in another directory."""
    os.chdir(directory)
    for registry, entries in zip(_REGISTRIES, known, strict=True):
        registry.update(entries)
    return task(config)


def _do(work: Callable[[Job], None], jobs: Sequence[Job], workplace: Path | None, config: Mapping[str, int]) -> str:
    """Do one job, here or in a worker; returns why it failed, as text, since not every error can be sent back."""
    job = jobs[config["job"]]
    if signal_heard() is not None:  # a library may have swallowed the exception
        raise KeyboardInterrupt
    try:
        with contextlib.ExitStack() as ending:
            if workplace is not None:
                ending.enter_context(forgiving_output())
                ending.enter_context(as_worker(workplace))
            work(job)
    except Exception as error:
        if signal_heard() is not None:
            raise KeyboardInterrupt from error
        if isinstance(error, ExneatError):
            reason = str(error)
        else:
            traceback.print_exc()
            reason = f"{type(error).__name__}: {error}"
    else:
        return ""
    print(f"exneat: {job.name}: {reason}", file=sys.stderr, flush=True)
    return reason


def _refuse_calls(node: Any, key: str) -> None:
    """Refuse Hydra settings that would call something, except in launchers, plug-ins that Hydra checks itself."""
    children = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for name, child in children:
        if name in ("_target_", "()") and key not in (".hydra.launcher", ".hydra.sweeper"):
            raise ExneatError(f"{key[1:]}.{name}: would call {child}; a configuration may not call code")
        _refuse_calls(child, f"{key}.{name}")
