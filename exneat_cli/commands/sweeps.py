"""From the groups `sweep` of a configuration to robustness sweeps."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from omegaconf import DictConfig

from exneat_cli.commands.composition import plain_from
from exneat_cli.errors import ConfigError, ExneatError
from exneat_cli.rollouts import Sweep


class Sweeps(NamedTuple):
    """What is perturbed after training.

    Attributes:
        sweeps: one after another.
        episodes: test episodes per level.
        labels: of the axes, by name.
    """

    sweeps: tuple[Sweep, ...]
    episodes: int
    labels: dict[str, str]


def sweeps_from(config: DictConfig, task: str) -> Sweeps:
    """The robustness sweeps that a composed configuration asks for.

    Args:
        config: has ``sweeps``, by name, and ``sweep.levels`` and ``sweep.episodes`` for all of them.
        task: whose levels are taken.

    Raises:
        ExneatError: a key is unknown or missing, levels are out of range, or a sweep does not fit the task.
    """
    plain = plain_from(config)
    if "sweep" not in plain or not plain.get("sweeps"):
        return Sweeps((), 1, {})
    common = _section("sweep", plain.get("sweep"), {"levels", "episodes"})
    chosen = _section("sweeps", plain.get("sweeps"), None)
    sweeps, labels = [], {}
    for name, entry in chosen.items():
        sweep = _section(f"sweeps.{name}", entry, {"parameter", "label", "levels"})
        levels = common["levels"]
        if levels is None:
            by_task = _section(f"sweeps.{name}.levels", sweep["levels"], None)
            if task not in by_task:
                raise ConfigError("sweep", f"a sweep that fits task={task}", name, f"it fits {', '.join(by_task)}")
            levels = by_task[task]
        if not isinstance(levels, list):
            raise ConfigError("sweep.levels", "a list of numbers, e.g. [0, 0.1]", levels)
        sweeps.append(Sweep(name, str(sweep["parameter"]), tuple(levels)))
        labels[name] = str(sweep["label"])
    return Sweeps(tuple(sweeps), common["episodes"], labels)


def _section(key: str, value: Any, known: set[str] | None) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        raise ConfigError(key, "a section with keys of its own", value)
    for name in value:
        if known is not None and name not in known:
            raise ExneatError(f"{key}.{name}: unknown key; known here: {', '.join(sorted(known))}")
    for name in sorted((known or set()) - set(value)):
        raise ExneatError(f"{key}.{name}: missing; exneat's own conf/sweep shows what a sweep needs")
    return value
