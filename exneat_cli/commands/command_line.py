"""The command line of every command: flags, and settings written key=value, which Hydra composes with YAML files."""

from __future__ import annotations

import argparse
import contextlib
import copy
import itertools
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import hydra
import yaml
from hydra._internal.config_loader_impl import ConfigLoaderImpl
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import Override
from hydra.errors import ConfigCompositionException, HydraException, MissingConfigException
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import ConfigAttributeError, ConfigKeyError, InterpolationKeyError, OmegaConfBaseException

from exneat_cli.commands.setting import LONGEST, as_written, is_hydras, read_setting
from exneat_cli.commands.shipped import section_of, shipped_directory, yaml_file
from exneat_cli.errors import ExneatError, check_keys, nearest

_FLAGS = ("--help", "--multirun", "--config-dir", "--config-path", "--config-name", "--cfg")


@dataclass(frozen=True)
class CommandLine:
    """What was typed after ``exneat``."""

    words: tuple[str, ...]  # all of it, beginning with exneat, for manifests
    primary: str | None  # the YAML file that the composition starts from, if any
    directories: tuple[Path, ...]  # where YAML files are searched, in this order
    settings: tuple[str, ...]  # key=value, as Hydra's composition takes them
    launcher: tuple[str, ...]  # the same for Hydra's launcher
    config_path: Path | None  # a directory that comes before all others, such as a run's
    multirun: bool  # whether to run every combination of settings with several values
    shown: str  # help or job if only that is to be printed, else empty
    bases: dict[Any, DictConfig] = field(default_factory=dict, repr=False, compare=False)  # earlier ones

    def compose(self, *keys: str) -> dict[str, Any]:
        """Compose settings and YAML files to dicts, lists, numbers and strings: those of `keys`, or all without `keys`.

        Raises:
            ExneatError: they do not fit together, or a key or what a value refers to is missing.
        """
        texts: list[Override] = []
        values: list[Override] = []
        for text in self.settings:
            override = OverridesParser.create().parse_override(text)
            is_value = override.is_force_add() and not override.is_sweep_override()
            (values if is_value else texts).append(override)
        config = self._base(tuple(str(override.input_line) for override in texts))
        try:
            ConfigLoaderImpl._apply_overrides_to_config(values, config)
            own = OmegaConf.masked_copy(config, list(keys)) if keys else config
            plain: Any = OmegaConf.to_container(own, resolve=True, throw_on_missing=True)
        except (OmegaConfBaseException, HydraException) as error:
            raise ExneatError(in_words(error, self.directories)) from error
        _check_there(plain, keys)
        return {str(key): value for key, value in plain.items()}

    def compose_only(self, needed: Sequence[str], optional: Sequence[str] = ()) -> dict[str, Any]:
        """Compose all settings as `compose` does: those `needed`, perhaps `optional` ones, and no others.

        Raises:
            ExneatError: as for `compose`, or there is another key.
        """
        plain = self.compose()
        check_keys("", plain, (*needed, *optional))
        _check_there(plain, needed)
        return plain

    def _base(self, chosen: tuple[str, ...]) -> DictConfig:
        """The composition of the YAML files with these options of groups, without Hydra's own section.

        It is kept, since Hydra takes a tenth of a second and the runs of an experiment use the same few options.
        """
        key = (self.primary, self.directories, chosen)
        if key not in self.bases:
            with replace(self, settings=chosen).composed() as config:
                self.bases[key] = OmegaConf.masked_copy(config, [str(each) for each in config if each != "hydra"])
        return copy.deepcopy(self.bases[key])

    @contextlib.contextmanager
    def composed(self) -> Iterator[DictConfig]:
        """Compose the settings with Hydra's own section; Hydra stays initialised within the block.

        Raises:
            ExneatError: they do not fit together.
        """
        first, *others = map(str, self.directories)
        overrides = [*self.settings, f"hydra.searchpath={as_written([f'file://{directory}' for directory in others])}"]
        with contextlib.ExitStack() as ending:
            try:
                ending.enter_context(hydra.initialize_config_dir(first, job_name="exneat", version_base="1.3"))
                config = hydra.compose(self.primary, overrides=overrides, return_hydra_config=True)
            except Exception as error:  # Hydra and YAML raise errors of many kinds
                raise ExneatError(in_words(error, self.directories)) from error
            yield config

    def names(self, key: str) -> bool:
        """Whether the user chose the value of a key, by a setting or by selecting the file that has it.

        Files in ``--config-path`` do not count: it may be the directory of a stranger's run.
        """
        return self.config_path is None or any(text.lstrip("+").partition("=")[0] == key for text in self.settings)

    def combinations(self) -> dict[str, CommandLine]:
        """Each combination of the settings that have several values, by those values."""
        choices = []
        for text in self.settings:
            override = OverridesParser.create().parse_override(text)
            values = override.sweep_string_iterator() if override.is_sweep_override() else ()
            choices.append([f"{override.get_key_element()}={value}" for value in values] or [text])
        varied = [k for k, texts in enumerate(choices) if len(texts) > 1]
        return {
            " ".join(texts[k].lstrip("+") for k in varied): replace(self, settings=texts)
            for texts in itertools.product(*choices)
        }

    def show(self) -> str:
        """The text to print: for ``--cfg job`` the composition as YAML, for ``--help`` every key."""
        if self.shown == "job":
            from exneat_cli.records import as_yaml  # takes longer to import than --help to answer

            return as_yaml(self.compose()).rstrip()
        from exneat_cli.commands.help_text import help_text

        with self.composed() as config:
            choices = dict(reversed(config.hydra.runtime.choices.items()))
            plain = {str(key): _shown(config, str(key)) for key in config if key != "hydra"}
        names = [str(self.primary), *(["config"] if "task" in choices else [])]
        names += [f"{group}/{option}" for group, option in choices.items()]
        paths = {name: yaml_file(self.directories, name) for name in names}
        files = [(section_of(name, path), path) for name, path in paths.items() if path]
        return help_text(self.words[1], files, plain, choices)


def _shown(config: DictConfig, key: str) -> Any:
    """A resolved value, or the value as written if it refers to something that is not chosen yet."""
    try:
        value = config[key]
        return OmegaConf.to_container(value, resolve=True) if OmegaConf.is_config(value) else value
    except OmegaConfBaseException:
        return OmegaConf.to_container(config, resolve=False)[key]  # type: ignore[call-overload, index]


def _check_there(plain: Mapping[str, Any], keys: Sequence[str]) -> None:
    for key in keys:
        if key not in plain:
            raise ExneatError(f"{key}: is missing")


def read_command_line(command: str, arguments: Sequence[str]) -> CommandLine:
    """Read flags and settings, in any order.

    Raises:
        ExneatError: a flag is unknown or lacks its value, or a setting cannot be read, may not be set by the user, or
            has several values without ``-m``.
    """
    flags, unknown = _flag_parser().parse_known_intermixed_args(list(arguments))
    if unknown:
        hint = nearest(unknown[0], _FLAGS) or f"settings are written key=value, see exneat {command} --help"
        raise ExneatError(f"{unknown[0]}: unknown flag; {hint}")
    if flags.multirun and command != "train":
        raise ExneatError(f"-m: only exneat train accepts several values, exneat {command} does not")
    shipped = shipped_directory("conf")
    for own in flags.config_dir:
        for path in own.rglob("*.yaml"):
            name = path.relative_to(own)
            if (shipped / name).exists():
                raise ExneatError(f"{path}: exneat has a {name} of its own, which would be used instead; rename yours")
    directories = (*filter(None, [flags.config_path]), shipped, *flags.config_dir)
    read = [read_setting(text, directories, multirun=flags.multirun) for text in flags.settings]
    return CommandLine(
        words=("exneat", command, *arguments),
        primary=flags.config_name or ("config" if command == "train" else command),
        directories=directories,
        settings=tuple(text for text in read if not is_hydras(text)),
        launcher=tuple(text for text in read if is_hydras(text)),
        config_path=flags.config_path,
        multirun=flags.multirun,
        shown="help" if flags.help else flags.cfg or "",
    )


def _flag_parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    parser.add_argument("-h", "--help", action="store_true")
    parser.add_argument("-m", "--multirun", action="store_true")
    parser.add_argument("-cd", "--config-dir", action="append", default=[], type=_directory)
    parser.add_argument("-cp", "--config-path", type=_directory)
    parser.add_argument("-cn", "--config-name")
    parser.add_argument("-c", "--cfg", choices=["job"])
    parser.add_argument("settings", nargs="*")

    def refuse(message: str) -> None:
        raise ExneatError(message.removeprefix("argument "))

    parser.error = refuse  # type: ignore[method-assign, assignment]
    return parser


def _directory(text: str) -> Path:
    directory = Path(text).expanduser().absolute()
    if not directory.is_dir():
        came = "a file" if directory.exists() else "nothing"
        raise ExneatError(f"{text}: expected a directory with YAML files, got {came}")
    return directory


def in_words(error: BaseException, directories: Sequence[Path]) -> str:
    """An error of Hydra, OmegaConf or YAML in one or two lines that name the file, the setting or the known options."""
    error = error if str(error) else error.__cause__ or error
    if isinstance(error, MissingConfigException) and error.missing_cfg_file:
        group, _, option = str(error.missing_cfg_file).rpartition("/")
        files = sorted({path.stem for directory in directories for path in (directory / group).glob("*.yaml")})
        known = f"{group or '--config-name'}={option}: no such option; known: {', '.join(files or error.options or ())}"
        if hint := nearest(option, files or error.options or ()):
            known += f"\n  {hint}"
        if group == "task":
            return f"{known}\n  for a class of your own: task=custom task.kind=package.module:Class"
        return f"{known}\n  pip install 'exneat[joblib]' or 'exneat[slurm]' adds more" if "launcher" in group else known
    if isinstance(error, yaml.MarkedYAMLError) and error.problem_mark is not None:
        return f"{error.problem_mark.name}:{error.problem_mark.line + 1}: cannot be read as YAML: {error.problem}"
    if isinstance(error, UnicodeDecodeError):
        paths = (path for directory in directories for path in directory.rglob("*.yaml"))
        place = next((path for path in paths if error.object in path.read_bytes()), "a YAML file")
        return f"{place}: expected UTF-8 text, got the byte {error.object[error.start]:#04x}"
    if isinstance(error, RecursionError):
        return "a YAML file includes itself through its defaults, or values refer to themselves through ${...}"
    cause = error.__cause__
    if isinstance(cause, ConfigKeyError | ConfigAttributeError) and cause.parent_node is not None:
        return f"{cause.full_key}: unknown key; known here: {', '.join(map(str, cause.parent_node))}"
    if isinstance(error, ConfigCompositionException) and (found := re.match(r"Could not override '(\w+)'", str(error))):
        of_robots = "\n  recipes are for robots: task=ant, task=robot" if found[1] == "recipe" else ""
        whose = "this command, or the chosen task,"
        return f"{found[1]}: expected nothing, since {whose} has no {found[1]} to choose{of_robots}"
    first = (str(error).strip() or type(error).__name__).splitlines()[0][:LONGEST]
    if key := getattr(error, "full_key", None):
        first = f"{key}: {first}"
    if isinstance(error, InterpolationKeyError):
        first += "\n  a YAML file of your own that sets it must begin with # @package _global_"
    return first
