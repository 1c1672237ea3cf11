"""What Hydra, OmegaConf and YAML say, in one or two lines that name the file or the setting."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import yaml
from hydra.errors import MissingConfigException
from omegaconf.errors import ConfigAttributeError, ConfigKeyError, InterpolationKeyError

_LONGEST = 300


def in_words(error: BaseException, directories: Sequence[Path]) -> str:
    """Say in one or two lines what went wrong.

    Args:
        error: what Hydra or a library below it raised.
        directories: whose options are listed where one does not exist.
    """
    error = error if str(error) else error.__cause__ or error
    if isinstance(error, MissingConfigException) and error.missing_cfg_file:
        group, _, option = str(error.missing_cfg_file).rpartition("/")
        files = sorted({path.stem for directory in directories for path in (directory / group).glob("*.yaml")})
        known = f"{group or '--config-name'}={option}: no such option; known: {', '.join(files or error.options or ())}"
        return f"{known}\n  pip install 'exneat[joblib]' or 'exneat[slurm]' adds more" if "launcher" in group else known
    if isinstance(error, yaml.MarkedYAMLError) and error.problem_mark is not None:
        return f"{error.problem_mark.name}:{error.problem_mark.line + 1}: cannot be read as YAML: {error.problem}"
    if isinstance(error, UnicodeDecodeError):
        paths = (path for directory in directories for path in directory.rglob("*.yaml"))
        place = next((path for path in paths if error.object in path.read_bytes()), "a YAML file")
        return f"{place}: expected UTF-8 text, got the byte {error.object[error.start]:#04x}"
    if isinstance(error, RecursionError):
        return "a YAML file leads back to itself through its defaults, or values do through ${...}"
    cause = error.__cause__
    if isinstance(cause, ConfigKeyError | ConfigAttributeError) and cause.parent_node is not None:
        return f"{cause.full_key}: unknown key; known here: {', '.join(map(str, cause.parent_node))}"
    first = (str(error).strip() or type(error).__name__).splitlines()[0][:_LONGEST]
    if key := getattr(error, "full_key", None):
        first = f"{key}: {first}"
    if isinstance(error, InterpolationKeyError):
        first += "\n  a YAML file of your own that sets it begins with # @package _global_"
    return first
