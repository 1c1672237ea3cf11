"""Turning plain data from JSON and YAML into typed values, or into one line that says what does not fit."""

from __future__ import annotations

import dataclasses
import re
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_args, get_origin, get_type_hints

import msgspec
import yaml
from msgspec import Meta

from exneat_cli.errors import ExneatError, check_keys, check_section, shortened
from exneat_cli.records.files import read_text

Word = Annotated[str, Meta(pattern=r"^[\w -~]{1,200}\Z")]
"""Letters of any script, digits, and printable ASCII."""
Real = Annotated[float, Meta(ge=-sys.float_info.max, le=sys.float_info.max)]
"""Finite."""
Count = Annotated[int, Meta(ge=0)]

_Kind = TypeVar("_Kind")
_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
"""The loader in C, if PyYAML has it, is ten times as fast."""
_NAMES = {"int": "a whole number", "float": "a number", "bool": "true or false", "str": "text"}
_NAMES |= {"array": "a list", "object": "a section", "null": "nothing"}
"""Our words for msgspec's types."""


def read_yaml(path: Path) -> dict[str, Any]:
    """Read keys with values; nothing in the file is run.

    Raises:
        ExneatError: the file is missing or unreadable, is not YAML, or holds something else.
    """
    try:
        content = yaml.load(read_text(path), Loader=_LOADER)
    except (yaml.YAMLError, ValueError) as error:
        mark = getattr(error, "problem_mark", None)
        place = f"{path}:{mark.line + 1}" if mark else str(path)
        problem = getattr(error, "problem", None) or " ".join(str(error).split())
        raise ExneatError(f"{place}: expected YAML, got something else: {problem}") from error
    if not isinstance(content, dict):
        raise ExneatError(f"{path}: expected keys with values, got {type(content).__name__}")
    return content


def as_yaml(content: object) -> str:
    """Write plain data as YAML that readers of other versions understand alike: ``1e5`` is text for PyYAML."""
    return yaml.dump(content, Dumper=_Dumper, sort_keys=False, allow_unicode=True)


def dotted(values: Mapping[str, Any]) -> dict[str, Any]:
    """Settings by dotted name; nested sections are flattened, and empty ones left out."""
    flat: dict[str, Any] = {}
    for name, value in values.items():
        if isinstance(value, Mapping):
            flat |= {f"{name}.{key}": each for key, each in dotted(value).items()}
        else:
            flat[str(name)] = value
    return flat


class _Dumper(yaml.SafeDumper):
    def represent_str(self, text: str) -> yaml.ScalarNode:
        """Quote text that reads as a number."""
        try:
            float(text.replace("_", ""))
        except ValueError:
            return super().represent_str(text)
        return self.represent_scalar("tag:yaml.org,2002:str", text, style="'")


_Dumper.add_representer(str, _Dumper.represent_str)


def read_json(path: Path, kind: type[_Kind], *versions: int) -> tuple[_Kind, dict[str, Any]]:
    """Read a JSON object whose field ``format`` is among `versions`; returns it as the struct `kind`, and as it was.

    Raises:
        ExneatError: the file is missing, unreadable, not a JSON object or of another format, or a field is missing,
            unknown or unusable.
    """
    try:
        content = msgspec.json.decode(read_text(path))
    except RecursionError as error:
        raise ExneatError(f"{path}: expected JSON, got something nested too deeply") from error
    except msgspec.DecodeError as error:
        raise ExneatError(f"{path}: expected JSON, got something else: {error}") from error
    if not isinstance(content, dict):
        raise ExneatError(f"{path}: expected a JSON object, got {type(content).__name__}")
    came = content.get("format")
    if came not in versions or isinstance(came, bool):
        why = "another version of exneat wrote it" if came else "exneat did not write it"
        raise ExneatError(f"{path}: expected format {versions[0]}, got {shortened(came)}: {why}")
    return converted(content, kind, f"{path}: damaged"), content


def converted(content: Any, kind: type[_Kind], where: str, *, strict: bool = True) -> _Kind:
    """Plain data as `kind`, any type that `msgspec.convert` knows.

    If not `strict`, text that reads as a number is taken as one, as in CSV files.

    Raises:
        ExneatError: it does not fit; names what is wrong: `where`, the field, what was expected and what came.
    """
    try:
        return msgspec.convert(content, kind, strict=strict)
    except msgspec.ValidationError as error:
        text, _, place = str(error).partition(" - at `$")
        place = place.removesuffix("`")
        said = re.sub(r"`([^`]+)`", lambda found: " or ".join(_NAMES.get(n, n) for n in found[1].split(" | ")), text)
        said = "".join(filter(str.isprintable, said[:1].lower() + said[1:]))[:200]
        if said.startswith("expected"):
            for name, index in re.findall(r"\.(\w+)|\[(\d+)\]", place.partition("[...]")[0]):
                content = content[name or int(index)]
            said = f"{said.partition(', got ')[0]}, got {shortened(content)}"
        raise ExneatError(": ".join(part for part in (where, place.lstrip("."), said) if part)) from error


def build(kind: type[_Kind], values: object, prefix: str = "") -> _Kind:
    """Make a dataclass from plain data, and likewise its fields that are dataclasses or tuples of them.

    Values that are dataclasses already stay as they are. `prefix` precedes keys in messages, e.g. ``noise.``.

    Raises:
        ConfigError: `values` is not a mapping, or `kind` refuses its values.
        ExneatError: a key is unknown, named with the nearest valid one, or missing.
    """
    section = check_section(prefix.rstrip("."), values)
    # A field's setting may have another name, see `exneat_cli.tasks.setting`.
    fields = {each.metadata.get("setting", each.name): each for each in dataclasses.fields(kind)}  # type: ignore[arg-type]
    check_keys(prefix, section, fields)
    for name, field in fields.items():
        if name not in section and field.default is field.default_factory is dataclasses.MISSING:
            raise ExneatError(f"{prefix}{name}: is missing")
    try:
        hints = get_type_hints(kind)
    except NameError:  # a user's class has hints for type checkers only, or from a program that is not this worker's
        hints = {}
    names = {key: fields[key].name for key in section}
    return kind(**{name: _made(hints.get(name), section[key], f"{prefix}{key}") for key, name in names.items()})


def _made(hint: Any, value: Any, key: str) -> Any:
    if dataclasses.is_dataclass(hint) and not dataclasses.is_dataclass(value):
        return build(hint, value, f"{key}.")  # type: ignore[arg-type]
    if get_origin(hint) is tuple and dataclasses.is_dataclass(get_args(hint)[0]) and isinstance(value, list | tuple):
        return tuple(_made(get_args(hint)[0], each, f"{key}[{k}]") for k, each in enumerate(value))
    return value
