"""Hydra: composing a configuration from conf/ and the command line, and reading its complaints."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import hydra
import yaml
from hydra.errors import HydraException
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

import exneat_cli
from exneat_cli.errors import ExneatError
from exneat_cli.runs import RunSettings

# Hydra would otherwise make a directory of its own per run, write its files into it and open a log there.
_HYDRA_OVERRIDES = (
    "hydra.run.dir=.",
    "hydra.output_subdir=null",
    "hydra/job_logging=none",
    "hydra/hydra_logging=none",
    "hydra.sweep.dir=${output}/.multirun",
    "hydra.sweep.subdir=.",
)
_FLAGS = {
    *("--help", "-h", "--hydra-help", "--version", "--cfg", "-c", "--resolve", "--package", "-p"),
    *("--run", "-r", "--multirun", "-m", "--info", "-i", "--shell-completion", "-sc"),
    *("--config-path", "-cp", "--config-name", "-cn", "--config-dir", "-cd"),
}
_LONGEST_LINE = 300


def configuration_directory() -> Path:
    """conf/: the copy inside an installed package, else the one beside it in a checkout."""
    package = Path(exneat_cli.__file__).parent
    packaged = package / "conf"
    return packaged if packaged.is_dir() else package.parent / "conf"


def run_composed(program: str, arguments: Sequence[str], job: Callable[[DictConfig], None]) -> None:
    """Compose the configuration and call `job` with it, or with each of a multirun's.

    Args:
        program: what Hydra calls the program in its help, e.g. ``exneat train``.
        arguments: overrides and Hydra's flags.
        job: called once per combination.

    Raises:
        ExneatError: the configuration cannot be composed, or a job raised it.
    """
    for argument in arguments:
        if argument.startswith("-") and argument.split("=")[0] not in _FLAGS:
            raise ExneatError(f"{argument}: unknown flag; settings are written key=value, see {program} --help")
    os.environ["HYDRA_FULL_ERROR"] = "1"
    sys.argv = [program, *_HYDRA_OVERRIDES, *arguments]
    directory = str(configuration_directory())
    try:
        hydra.main(version_base="1.3", config_path=directory, config_name="config")(job)()
    except (HydraException, OmegaConfBaseException, yaml.YAMLError, UnicodeDecodeError, OSError) as error:
        raise ExneatError(_in_few_lines(error)) from error


def settings_from(config: DictConfig) -> RunSettings:
    """The settings that a composed configuration describes.

    Raises:
        ExneatError: a key is unknown, missing or of the wrong type, or a value is out of range.
    """
    try:
        plain = OmegaConf.to_container(config, resolve=True, throw_on_missing=True)
    except OmegaConfBaseException as error:
        raise ExneatError(_in_few_lines(error)) from error
    assert isinstance(plain, dict)
    settled = {str(key): value for key, value in plain.items() if key not in ("budget", "budgets")}
    return RunSettings.from_plain(settled)


def _in_few_lines(error: BaseException) -> str:
    """At most three lines: what Hydra, OmegaConf, YAML or the system says, without its explanations."""
    text = str(error)
    cause = error.__cause__
    if cause is not None and str(cause) not in text:
        text = f"{text}\n{cause}"
    if isinstance(error, UnicodeDecodeError):
        text = f"a configuration file is not UTF-8 text: {error}"
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    kept = [lines[0], " ".join(lines[1:])] if len(lines) > 3 else lines
    return "\n  ".join(line[:_LONGEST_LINE] for line in kept)
