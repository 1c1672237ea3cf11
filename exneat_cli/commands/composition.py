"""Hydra: composing a configuration from conf/ and the command line, and putting its complaints in our words."""

from __future__ import annotations

import contextlib
import os
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import hydra
from hydra.core.hydra_config import HydraConfig
from hydra.types import RunMode
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

import exneat_cli
from exneat_cli.commands.complaints import in_our_words
from exneat_cli.commands.overrides import check_overrides
from exneat_cli.commands.own_files import check_own_files
from exneat_cli.errors import ExneatError, check_choice
from exneat_cli.interruption import as_worker, launching, signal_heard
from exneat_cli.rollouts import keep_clusters
from exneat_cli.runs import RunSettings

# Hydra would otherwise make a directory of its own per run, write its files into it and open a log there.
_HYDRA_OVERRIDES = (
    "hydra.run.dir=.",
    "hydra.output_subdir=null",
    "hydra/job_logging=none",
    "hydra/hydra_logging=none",
    "hydra.sweep.subdir=.",
)
_FLAGS = {"--help", "-h", "--hydra-help", "--version", "--resolve", "--run", "-r", "--multirun", "-m"}
_FLAGS_WITH_VALUE = {
    *("--config-path", "-cp", "--config-name", "-cn", "--config-dir", "-cd"),
    *("--package", "-p", "--cfg", "-c", "--shell-completion", "-sc"),
}
BUDGETS = ("paper", "quick", "smoke")
"""What ``budget=`` may be, the largest first."""
_NOT_OF_THE_RUN = ("budget", "budgets", "sweep", "sweeps")


def configuration_directory() -> Path:
    """conf/, see `shipped_directory`."""
    return shipped_directory("conf")


def shipped_directory(name: str) -> Path:
    """A folder of data: the copy inside an installed package, else the one beside it in a checkout."""
    package = Path(exneat_cli.__file__).parent
    packaged = package / name
    return packaged if packaged.is_dir() else package.parent / name


def run_composed(
    program: str, arguments: Sequence[str], job: Callable[[DictConfig], None], config_name: str = "config"
) -> None:
    """Compose the configuration and call `job` with it, or with each of a multirun's.

    Args:
        program: what Hydra calls the program in its help, e.g. ``exneat train``.
        arguments: overrides and Hydra's flags, in any order.
        job: called once per combination; what it raises in a multirun stops only that combination.
        config_name: file in conf/ that the composition starts from.

    Raises:
        ExneatError: the configuration cannot be composed, or `job` raised it.
    """
    raised: list[BaseException] = []
    os.environ["HYDRA_FULL_ERROR"] = "1"
    flags, overrides = _flags_first(program, arguments)
    directory = str(configuration_directory())
    check_overrides(overrides, configuration_directory())
    try:
        # Jobs that are done one after the other share a cluster: starting one takes seconds.
        # Hydra saves a multirun.yaml into hydra.sweep.dir and cannot be told not to.
        with tempfile.TemporaryDirectory(prefix="exneat-", ignore_cleanup_errors=True) as scratch, keep_clusters():
            sys.argv = [program, *flags, *_HYDRA_OVERRIDES, f"hydra.sweep.dir={scratch}", *overrides]
            elsewhere = any(override.lstrip("+").startswith("hydra/launcher=") for override in overrides)
            guarded = _guarded(job, raised, Path(scratch))
            with launching(Path(scratch)) if elsewhere else contextlib.nullcontext():
                hydra.main(version_base="1.3", config_path=directory, config_name=config_name)(guarded)()
    except SystemExit as stop:
        if stop.code:
            raise ExneatError(f"{program}: the flags make no sense to Hydra, see {program} --hydra-help") from stop
        raise
    except Exception as error:
        if error in raised:
            raise
        raise ExneatError(in_our_words(error, configuration_directory())) from error
    if raised:
        raise raised[0]


def _guarded(
    job: Callable[[DictConfig], None], raised: list[BaseException], workplace: Path
) -> Callable[[DictConfig], None]:
    """The job, which notes in `raised` what it raises."""
    asked_by = os.getpid()

    def guarded(config: DictConfig) -> None:
        try:
            with contextlib.nullcontext() if os.getpid() == asked_by else as_worker(workplace):
                job(config)
        except BaseException as error:
            if signal_heard() is not None:
                raise KeyboardInterrupt from error  # Hydra would go on to the next job after any other error
            raised.append(error)
            if isinstance(error, ExneatError) and HydraConfig.get().mode is not RunMode.MULTIRUN:
                return  # raised below: Hydra would print lines of its own about it
            raise

    return guarded


def settings_from(config: DictConfig) -> RunSettings:
    """The settings that a composed configuration describes.

    Raises:
        ExneatError: a key is unknown, missing or of the wrong type, or a value is out of range.
    """
    plain = plain_from(config)
    _check_budgets(plain.get("budgets"))
    return RunSettings.from_plain({key: value for key, value in plain.items() if key not in _NOT_OF_THE_RUN})


def plain_from(config: DictConfig) -> dict[str, Any]:
    """A composed configuration as dicts, lists, numbers and strings.

    Raises:
        ExneatError: a value is missing or refers to something that is not there.
    """
    try:
        plain = OmegaConf.to_container(config, resolve=True, throw_on_missing=True)
    except OmegaConfBaseException as error:
        raise ExneatError(in_our_words(error, configuration_directory())) from error
    assert isinstance(plain, dict)
    return {str(key): value for key, value in plain.items()}


@contextlib.contextmanager
def composing() -> Iterator[Callable[[Sequence[str]], DictConfig]]:
    """Gives a function from overrides to the composed configuration, for many compositions in a row.

    Raises:
        ExneatError: by that function, if the configuration cannot be composed.
    """

    def compose_one(overrides: Sequence[str]) -> DictConfig:
        check_overrides(overrides, configuration_directory())
        try:
            return hydra.compose("config", overrides=list(overrides))
        except Exception as error:
            raise ExneatError(in_our_words(error, configuration_directory())) from error

    with hydra.initialize_config_dir(str(configuration_directory()), version_base="1.3"):
        yield compose_one


def _flags_first(program: str, arguments: Sequence[str]) -> tuple[list[str], list[str]]:
    """Flags and overrides apart: argparse refuses overrides on both sides of a flag."""
    flags: list[str] = []
    overrides: list[str] = []
    waiting = iter(arguments)
    for argument in waiting:
        name, separator, joined = argument.partition("=")
        if not argument.startswith("-"):
            overrides.append(argument)
        elif name in _FLAGS and not separator:
            flags.append(argument)
        elif name in _FLAGS_WITH_VALUE:
            given = joined if separator else next(waiting, "")
            if not given:
                raise ExneatError(f"{argument}: expected a value after it, got nothing")
            flags += [name, _checked_flag(name, given)]
        else:
            raise ExneatError(f"{argument}: unknown flag; settings are written key=value, see {program} --help")
    return flags, overrides


def _checked_flag(name: str, value: str) -> str:
    """A flag's value as Hydra needs it."""
    if name in ("--cfg", "-c"):
        check_choice(name, value, ("job", "hydra", "all"))
    if name in ("--config-path", "-cp"):
        directory = Path(value).absolute()
        check_own_files(directory, None)
        return str(directory)
    if name in ("--config-dir", "-cd"):
        directory = Path(value).absolute()
        check_own_files(directory, configuration_directory())
        return str(directory)
    return value


def _check_budgets(budgets: object) -> None:
    fields = {"generations", "population", "episodes", "validation_episodes", "test_episodes", "sweep_episodes"}
    for name, budget in budgets.items() if isinstance(budgets, dict) else ():
        check_choice(f"budgets.{name}", name, BUDGETS)
        for key in budget if isinstance(budget, dict) else ():
            check_choice(f"budgets.{name}.{key}", key, sorted(fields))
