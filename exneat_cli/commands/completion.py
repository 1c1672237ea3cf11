"""`exneat completion bash|zsh|fish`: a script for the shell, and the answers that it asks for at each Tab.

The script runs `exneat completion <shell> <words typed so far>`. Since the user waits for the answer, the YAML files
are read directly, without Hydra.
"""

from __future__ import annotations

import os
import re
import shlex
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from itertools import islice
from pathlib import Path
from typing import Any

import yaml

from exneat_cli.commands.shipped import section_of, shipped_directory, shipped_files, yaml_file
from exneat_cli.errors import check_choice

SHELLS = ("bash", "zsh", "fish")
HELP = """exneat completion: print a script that makes a shell complete commands, settings, options of groups and runs.
  bash: add to ~/.bashrc                      eval "$(exneat completion bash)"
  zsh:  add to ~/.zshrc, after compinit       eval "$(exneat completion zsh)"
  fish: exneat completion fish > ~/.config/fish/completions/exneat.fish
"""
_OF_TRAINING = ("train", "sweep", "search", "report")
"""Commands that take every setting of a run."""
_PLACES = ("-cd", "--config-dir", "-cp", "--config-path")
_FLAGS = ("--help", "--config-dir=", "--config-path=", "--config-name=", "--cfg")
_NOT_TYPED = re.compile(r"^budgets\.|\.name$")
"""Settings that follow from the options of groups."""
_MOST_ENTRIES = 2000
"""At most this many entries of a directory are searched for runs, so that the answer comes quickly."""
_Words = Sequence[str]


def run(words: _Words, commands: Collection[str]) -> int:
    """Print the script for a shell or, if `words` also holds what was typed so far, the completions, one per line.

    Raises:
        ExneatError: there is no script for that shell.
    """
    if not words or words[0] in ("-h", "--help"):
        print(HELP, end="")
        return 0
    shell, *typed = words
    check_choice("completion", shell, SHELLS)
    if not typed:
        print((Path(__file__).parent / "completion_scripts" / f"exneat.{shell}").read_text("utf-8"), end="")
        return 0
    # bash passes the whole line, since it splits words at every "=".
    _, *words, last = _split(typed[0]) if shell == "bash" else typed
    for found in _candidates(words, last, commands):
        print(found)
    return 0


def _split(line: str) -> list[str]:
    """The words of a line that may end within a word or within quotes; the last is empty after a space."""
    for ending in ("", "'", '"'):
        try:
            words = shlex.split(line + ending)
        except ValueError:
            continue
        return [*words, ""] if not ending and line[-1:].isspace() and not line.endswith("\\ ") else words
    return ["exneat", ""]


def _candidates(words: _Words, last: str, commands: Collection[str]) -> Iterator[str]:
    """Completions of the `last` word after the others; those that can be continued end with "=" or "/"."""
    if not words:
        yield from _beginning(last, [*commands, "--help", "--version"])
        return
    command, *typed = words
    if command not in commands:
        return
    if command == "completion":
        yield from _beginning(last, SHELLS)
    elif typed[-1:] and typed[-1] in _PLACES:
        yield from _paths(last, lambda path: path.is_dir())
    elif last.startswith("-"):
        for flag in _PLACES:
            if last.startswith(f"{flag}="):
                yield from (f"{flag}={path}" for path in _paths(last.partition("=")[2], lambda path: path.is_dir()))
        yield from _beginning(last, [*_FLAGS, *(["--multirun"] if command == "train" else [])])
    else:
        groups, settings = _known(command, typed)
        key, is_value, value = last.partition("=")
        if is_value:
            yield from (f"{key}={found}" for found in _values(command, key, value, groups, settings))
        else:
            yield from _beginning(last, [f"{name}=" for name in (*groups, *settings)])


def _beginning(word: str, known: Sequence[str]) -> Iterator[str]:
    yield from (each for each in dict.fromkeys(known) if each.startswith(word))


def _known(command: str, typed: _Words) -> tuple[dict[str, list[str]], dict[str, Any]]:
    """The groups with their options, and every setting with its default, given the options `typed` so far."""
    folders = [shipped_directory("conf"), *_own_folders(typed)]
    chosen = dict(word.lstrip("+").split("=", 1) for word in typed if "=" in word)
    groups: dict[str, list[str]] = {}
    settings: dict[str, Any] = {}
    waiting = [command, *(["config"] if command in _OF_TRAINING else [])]
    for name in waiting:  # which grows within the loop
        if path := yaml_file(folders, name):
            content, section = _read(path), section_of(name, path)
            for group, option in _groups(content.pop("defaults", [])):
                if "/" not in group and any((folder / group).is_dir() for folder in folders):
                    groups.setdefault(group, _options(folders, group))
                    waiting.append(f"{group}/{chosen.get(group, option)}")
            settings |= dict(_flat(content, section and f"{section}."))
    return groups, {key: value for key, value in settings.items() if not _NOT_TYPED.search(key)}


def _own_folders(typed: _Words) -> Iterator[Path]:
    for k, word in enumerate(typed):
        flag, is_joined, place = word.partition("=")
        if flag in _PLACES and (is_joined or k + 1 < len(typed)):
            yield Path(place if is_joined else typed[k + 1]).expanduser()


def _read(path: Path) -> dict[str, Any]:
    """The sections of a YAML file; none if it cannot be read as such."""
    try:
        content = yaml.load(path.read_text("utf-8"), getattr(yaml, "CSafeLoader", yaml.SafeLoader))
    except (OSError, ValueError, yaml.YAMLError):
        return {}
    return content if isinstance(content, dict) else {}


def _groups(defaults: Sequence[Any]) -> Iterator[tuple[str, str]]:
    """(group, option) of the entries of a defaults list that choose one."""
    for entry in defaults:
        for group, option in entry.items() if isinstance(entry, dict) else ():
            yield str(group).split(" ")[-1].removeprefix("/").partition("@")[0], str(option)


def _options(folders: Sequence[Path], group: str) -> list[str]:
    return sorted({path.stem for folder in folders for path in (folder / group).glob("*.yaml")})


def _flat(values: Mapping[str, Any], prefix: str) -> Iterator[tuple[str, Any]]:
    for key, value in values.items():
        if isinstance(value, dict) and value:
            yield from _flat(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def _values(
    command: str, key: str, value: str, groups: Mapping[str, Sequence[str]], settings: Mapping[str, Any]
) -> Iterator[str]:
    if key in groups:
        before = re.match(r"(.*[\[,])?", value)[0]  # type: ignore[index]  # it fits everything
        yield from (f"{before}{option}" for option in _beginning(value.removeprefix(before), groups[key]))
    elif key == "run" or (key == "output" and command == "inspect"):
        yield from _paths(value, _leads_to_runs)
    elif key == "output":
        yield from _paths(value, lambda path: path.is_dir())
    elif key == "experiment":
        yield from _beginning(value, list(shipped_files("experiments")))
        yield from _paths(value, lambda path: path.is_dir() or path.suffix in (".yaml", ".yml"))
    elif key == "only":
        yield from _beginning(value, list(_read(shipped_directory("experiments") / "catalogue.yaml")))
    elif isinstance(settings.get(key), bool):
        yield from _beginning(value, ["true", "false"])


def _paths(typed: str, fits: Callable[[Path], bool]) -> Iterator[str]:
    """The fitting paths that begin with what was `typed`; a directory that is not a run ends with "/"."""
    parent, _, name = typed.rpartition("/")
    shown = f"{parent}/" if "/" in typed else ""
    try:
        with os.scandir(Path(shown or ".").expanduser()) as entries:
            found = sorted(entry.name for entry in islice(entries, _MOST_ENTRIES) if entry.name.startswith(name))
    except OSError:
        return
    for each in found:
        path = Path(shown).expanduser() / each
        if fits(path) and (name or not each.startswith(".")):
            yield f"{shown}{each}" + ("/" if path.is_dir() and not (path / "manifest.json").is_file() else "")


def _leads_to_runs(path: Path, depth: int = 2) -> bool:
    """Whether a path is a run, or there are runs in it or in one of its folders."""
    if (path / "manifest.json").is_file():
        return True
    try:
        with os.scandir(path) as entries:
            inner = [entry for entry in islice(entries, _MOST_ENTRIES) if entry.is_dir()]
    except OSError:
        return False
    return depth > 0 and any(_leads_to_runs(Path(entry.path), depth - 1) for entry in inner)
