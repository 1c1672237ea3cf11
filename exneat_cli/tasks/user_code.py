"""Users' code: where the classes of their tasks come from, and which settings would import code.

A class is found by its name in `TASKS` or among the entry points of installed packages, or by
``task.kind=package.module:Class``. A setting that would import code is followed only if the user of this process gave
it explicitly (`NAMED`), never because a run directory, a champion or a checkpoint contains it.
"""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import importlib
import importlib.util
import inspect
import re
import sys
from collections.abc import Mapping
from importlib.machinery import PathFinder
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

from exneat_cli.errors import ConfigError
from exneat_cli.tasks.task import Task

ENTRY_POINTS = "exneat.tasks"
"""The group of entry points by which an installed package registers its tasks, name -> ``package.module:Class``."""
NAMED: set[str] = set()
"""Code that the user of this process named explicitly, as returned by `code_in`; launchers pass it to their workers."""
_CODE = re.compile(r"[\w.]+:[\w./-]+")


def code_in(section: Mapping[str, Any]) -> dict[str, str]:
    """Code that a task's settings would import, by dotted key: its class, and the module before an environment's id."""
    named = {"task.kind": section.get("kind"), "task.env_id": section.get("env_id")}
    return {key: text for key, text in named.items() if isinstance(text, str) and (key == "task.kind" or ":" in text)}


def find_task(section: Mapping[str, Any], registry: Mapping[str, type[Task]]) -> type[Task]:
    """The class of a task with these settings: by ``kind`` if they have one, else by ``name``.

    Raises:
        ConfigError: there is no such class, it cannot be imported or is not a task, or it would have to be imported
            although the user did not name it.
    """
    for key, reference in code_in(section).items():
        if not _CODE.fullmatch(reference):
            raise ConfigError(key, "module:name, e.g. task.kind=my_package.my_module:MyTask", reference)
        if reference not in NAMED and not _is_there(key, reference, registry):
            fix = f"a run or --config-path alone cannot import code; if you trust it, add {key}={reference}"
            raise ConfigError(key, "code that is registered, or that you name yourself", reference, fix)
    kind, name = section.get("kind"), section.get("name")
    if kind is None:
        return _by_name(name, registry)
    if not isinstance(kind, str):
        raise ConfigError("task.kind", "package.module:Class", kind)
    found = _registered(kind, registry) or _imported(kind)
    name = getattr(found, "name", None) if name is None else name
    if registry.get(str(name), found) is not found:
        fix = f"choose task=custom, or a file of yours in --config-dir, rather than task={name}"
        raise ConfigError("task.kind", f"nothing, for task.name={name} has a class already", kind, fix)
    return found


def _by_name(name: object, registry: Mapping[str, type[Task]]) -> type[Task]:
    if isinstance(name, str) and name in registry:
        return registry[name]
    installed = entry_points(group=ENTRY_POINTS)
    places = sorted({point.value for point in installed if point.name == name})
    if not places:
        known = ", ".join(sorted({*registry, *installed.names}))
        fix = "a class of your own goes by task=custom task.kind=package.module:Class"
        raise ConfigError("task.name", f"one of {known}", name, fix)
    if len(places) > 1:
        raise ConfigError("task.name", "the name of one task", name, f"packages define several: {', '.join(places)}")
    return _imported(places[0])


def _is_there(key: str, reference: str, registry: Mapping[str, type[Task]]) -> bool:
    """Whether the class is registered, or the environment's module already imported."""
    if key == "task.kind":
        return _registered(reference, registry) is not None
    return reference.partition(":")[0] in sys.modules


def _registered(reference: str, registry: Mapping[str, type[Task]]) -> type[Task] | None:
    """The class with this reference, if it is in the registry or an installed package registers it."""
    for known in registry.values():
        if f"{known.__module__}:{known.__qualname__}" == reference:
            return known
    return _imported(reference) if any(p.value == reference for p in entry_points(group=ENTRY_POINTS)) else None


def _imported(reference: str) -> type[Task]:
    module, _, name = reference.partition(":")
    make_findable(module.partition(".")[0])
    try:
        found: Any = functools.reduce(getattr, name.split("."), importlib.import_module(module))
    except (Exception, SystemExit) as error:  # its code may raise anything
        why = f"{type(error).__name__}: {next(iter(str(error).splitlines()), '')}"
        raise ConfigError("task.kind", "a class that can be imported from here", reference, why[:300]) from error
    _check_class(found, reference)
    return found  # type: ignore[no-any-return]


def make_findable(package: str) -> None:
    """Append the current directory to the import path if a package is found there and nowhere else.

    It stays on the path for workers and for later imports of the package.
    """
    importlib.invalidate_caches()
    with contextlib.suppress(ValueError):  # modules such as __main__ have no spec
        here = str(Path.cwd())
        if importlib.util.find_spec(package) is None and PathFinder.find_spec(package, [here]) is not None:
            sys.path.append(here)


def _check_class(found: Any, reference: str) -> None:
    """Refuse anything but a frozen dataclass that derives from `Task` and defines its abstract members."""
    if not isinstance(found, type) or not issubclass(found, Task):
        raise ConfigError("task.kind", "a class that derives from exneat_cli.tasks.Task", reference, f"it is {found!r}")
    if missing := sorted(found.__abstractmethods__) if inspect.isabstract(found) else []:
        raise ConfigError(
            "task.kind", "a class that defines all of a task", reference, f"it lacks {', '.join(missing)}"
        )
    if not (dataclasses.is_dataclass(found) and found.__dataclass_params__.frozen):
        raise ConfigError("task.kind", "a frozen dataclass", reference, "write @dataclass(frozen=True) above the class")
    fields = {field.name for field in dataclasses.fields(found)}
    if "name" not in fields or "kind" in fields:
        raise ConfigError("task.kind", "a dataclass with a field `name` and none called `kind`", reference)
