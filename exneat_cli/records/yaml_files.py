"""Reading YAML that anyone may have written, as data: nothing in it is run, dropped or blown up."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml

from exneat_cli.errors import ExneatError
from exneat_cli.records.files import read_text

_DEEPEST = 50
_LARGEST = 100_000
_PLAIN = {
    f"tag:yaml.org,2002:{kind}" for kind in ("str", "int", "float", "bool", "null", "timestamp", "merge", "value")
}
_NOTHING = "tag:yaml.org,2002:null"
_LIST, _SECTION = "tag:yaml.org,2002:seq", "tag:yaml.org,2002:map"


def read_yaml(path: Path) -> dict[str, Any]:
    """Read keys with values from YAML, as data.

    Raises:
        ExneatError: see `check_yaml`.
    """
    return _read(path)[0]


def check_yaml(path: Path) -> Iterator[tuple[str, int, str]]:
    """Refuse a file that YAML readers would misunderstand, choke on or call code for.

    Yields:
        Every key that has a plain value, its line, and the value as it is written.

    Raises:
        ExneatError: the file is missing, unreadable, empty, no YAML, no keys with values, names a key twice, has tags
            that are not plain values, is nested deeper than 50 levels or stands for more than 100,000 values.
    """
    yield from _scalars(_read(path)[1], set())


def _read(path: Path) -> tuple[dict[str, Any], yaml.Node]:
    text = read_text(path)
    loader = None
    try:
        loader = yaml.SafeLoader(text)
        node = loader.get_single_node()
        if node is None:
            raise ExneatError(f"{path}: expected keys with values, got an empty file")
        if not isinstance(node, yaml.MappingNode):
            came = "a list" if isinstance(node, yaml.SequenceNode) else f"{_short(node)}"
            raise ExneatError(f"{path}:{node.start_mark.line + 1}: expected keys with values, got {came}")
        _weigh(path, node, {}, 0)
        return loader.construct_document(node), node
    except yaml.reader.ReaderError as error:
        line = text[: error.position].count("\n") + 1
        raise ExneatError(f"{path}:{line}: expected YAML, got the character {error.character:#x}") from error
    except yaml.YAMLError as error:
        raise ExneatError(_syntax(path, error)) from error
    except RecursionError as error:
        raise ExneatError(f"{path}: expected at most {_DEEPEST} levels of nesting, got more") from error
    except (ValueError, TypeError) as error:
        raise ExneatError(f"{path}: holds a value that cannot be read: {error}") from error
    finally:
        if loader is not None:
            loader.dispose()


def _syntax(path: Path, error: yaml.YAMLError) -> str:
    mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
    place = f"{path}:{mark.line + 1}" if mark else str(path)
    problem = getattr(error, "problem", None) or " ".join(str(error).split())
    fix = "\n  indent with spaces" if "'\\t'" in problem else ""
    return f"{place}: expected YAML, got something else: {problem}{fix}"


def _weigh(path: Path, node: yaml.Node, weights: dict[int, int], depth: int) -> int:
    """How many values `node` stands for, with each repetition of an alias counted: a small file may mean billions."""
    where = f"{path}:{node.start_mark.line + 1}"
    if id(node) in weights:
        if not weights[id(node)]:
            raise ExneatError(f"{where}: an alias that contains itself")
        return weights[id(node)]
    if depth > _DEEPEST:
        raise ExneatError(f"{where}: expected at most {_DEEPEST} levels of nesting, got more")
    weights[id(node)] = 0
    weight = 1 + sum(_weigh(path, child, weights, depth + 1) for child in _children(path, node))
    if weight > _LARGEST:
        raise ExneatError(f"{where}: expected at most {_LARGEST} values, got more, through aliases or by itself")
    weights[id(node)] = weight
    return weight


def _children(path: Path, node: yaml.Node) -> list[yaml.Node]:
    if isinstance(node, yaml.MappingNode) and node.tag == _SECTION:
        seen: dict[tuple[str, str], int] = {}
        for key, _ in node.value:
            line = key.start_mark.line + 1
            if not isinstance(key, yaml.ScalarNode) or key.tag == _NOTHING:
                came = "nothing" if isinstance(key, yaml.ScalarNode) else "a list or section"
                raise ExneatError(f"{path}:{line}: expected a word as a key, got {came}")
            name = key.tag, key.value
            if name in seen:
                raise ExneatError(f"{path}:{line}: the key {_short(key)} comes twice, first on line {seen[name]}")
            seen[name] = line
        return [child for pair in node.value for child in pair]
    if isinstance(node, yaml.SequenceNode) and node.tag == _LIST:
        return list(node.value)
    if isinstance(node, yaml.ScalarNode) and node.tag in _PLAIN:
        return []
    tag = node.tag.replace("tag:yaml.org,2002:", "!!")
    raise ExneatError(f"{path}:{node.start_mark.line + 1}: expected plain values, got the tag {tag!r}; leave it out")


def _scalars(node: yaml.Node, seen: set[int]) -> Iterator[tuple[str, int, str]]:
    if id(node) in seen or isinstance(node, yaml.ScalarNode):
        return
    seen.add(id(node))
    if isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            if isinstance(value, yaml.ScalarNode):
                yield key.value, key.start_mark.line + 1, value.value
            yield from _scalars(value, seen)
    else:
        for child in node.value:
            yield from _scalars(child, seen)


def _short(node: yaml.Node) -> str:
    return repr(node.value if len(node.value) <= 60 else f"{node.value[:60]}...")
