"""The text of a command's --help: every key with its default and its comment in the YAML file."""

from __future__ import annotations

import json
import re
import shutil
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

_LINE = re.compile(r"(?P<indent> *)(?P<item>- )?(?P<key>[\w/@.]+):(?P<value>.*?)(?:\s# ?(?P<comment>.*))?$")
_OPTIONAL = ("override", "optional")
_COLUMN = 38
_ALL = ("train", "sweep", "search")
"""Commands that accept every key of their composition; others accept only the keys in their own file."""


def help_text(
    command: str, files: Sequence[tuple[str, Path]], settings: Mapping[str, Any], choices: Mapping[str, str | None]
) -> str:
    """Write the help of a command.

    Args:
        command: its name, also that of its YAML file.
        files: the section that each YAML file fills (empty: all settings) and its path; the command's own file first.
        settings: the composition, as plain data.
        choices: the chosen option of each group.
    """
    comments: dict[str, str] = {}
    groups: dict[str, str] = {}
    own: set[str] = set()
    for section, path in files:
        for key, comment, is_group in _commented(path.read_text("utf-8")):
            name = f"{section}.{key}" if section and not is_group else key
            (groups if is_group else comments).setdefault(name, comment)
            if path.stem == command and (comment or not is_group):
                own.add(f"{key}=" if is_group else key.partition(".")[0])
    shown = {key: value for key, value in settings.items() if command in _ALL or key in own or f"{key}=" in own}
    rows = [(f"{group}={choices.get(group) or 'null'}", comment) for group, comment in groups.items() if comment]
    rows = [row for row in rows if command in _ALL or f"{row[0].partition('=')[0]}=" in own]
    lines = [*_introduction(files[0][1]), ""]
    for title, table in (("Groups, each with settings of its own:", rows), ("Settings:", list(_rows(shown, comments)))):
        if table:
            lines += [title, *_table(table), ""]
    return "\n".join(lines).rstrip()


def _introduction(path: Path) -> Iterator[str]:
    """The comment that begins a file."""
    for line in path.read_text("utf-8").splitlines():
        if not line.startswith("#"):
            return
        yield line.removeprefix("#").removeprefix(" ")


def _commented(text: str) -> Iterator[tuple[str, str, bool]]:
    """(dotted key, comment, whether it chooses an option of a group) of every line that sets something."""
    above: list[tuple[int, str]] = []
    for line in text.splitlines():
        found = _LINE.fullmatch(line)
        if not found or line.lstrip().startswith("#"):
            continue
        indent, comment = len(found["indent"]), (found["comment"] or "").strip()
        if found["item"]:
            if not found["key"].startswith(_OPTIONAL):
                yield found["key"].removeprefix("/").partition("@")[0], comment, True
            continue
        above = [(depth, key) for depth, key in above if depth < indent]
        above.append((indent, found["key"]))
        yield ".".join(key for _, key in above), comment, False


def _rows(settings: Mapping[str, Any], comments: Mapping[str, str], prefix: str = "") -> Iterator[tuple[str, str]]:
    for key, value in settings.items():
        name = f"{prefix}{key}"
        below = any(other.startswith(f"{name}.") for other in comments)
        if isinstance(value, Mapping) and value and below:
            yield from _rows(value, comments, f"{name}.")
        else:
            written = value if isinstance(value, str) else json.dumps(value)
            yield f"{name}={written}", comments.get(name, "")


def _table(rows: Sequence[tuple[str, str]]) -> Iterator[str]:
    """Key and comment side by side; long comments are wrapped, and begin below a key that leaves no room."""
    width = max(80, min(120, shutil.get_terminal_size().columns))
    for key, comment in rows:
        lines = textwrap.wrap(comment, width - _COLUMN - 2) or [""]
        if len(key) > _COLUMN - 2:
            yield f"  {key}"
            lines = lines if comment else []
        else:
            yield f"  {key:<{_COLUMN - 2}}  {lines.pop(0)}".rstrip()
        yield from (f"{'':<{_COLUMN + 2}}{each}" for each in lines)
