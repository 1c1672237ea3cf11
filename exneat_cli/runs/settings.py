"""Everything that defines one run, as one frozen object that can be written to a file and read back."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

from exneat_cli.algorithms import (
    ALGORITHMS,
    CHAMPIONS,
    JUDGINGS,
    PAIRINGS,
    RECURRENT,
    Algorithm,
    EvolutionSettings,
    ExNEAT,
    Problem,
)
from exneat_cli.errors import ConfigError, ExneatError, check_choice, check_flag, check_path, check_section, check_whole
from exneat_cli.records import RunDirectory, build, configuration_hash
from exneat_cli.rollouts import Executor, Noise
from exneat_cli.runs.trackers import TRACKERS
from exneat_cli.tasks import TASKS, AntTask, HasBatch, HasInitialPose, Task
from exneat_cli.tasks.contract import check_description, is_ours
from exneat_cli.tasks.user_code import find_task
from exneat_cli.wiring import CENTRAL, Geometry, Plan, Wiring

_Part = TypeVar("_Part")
_NO_POSE = 0.1
"""The `noise.reset_scale` of tasks without an initial pose: it has no effect, but is part of hashes."""
_CAME_LATER = (
    ("", "judging", "last"),
    ("", "champion", "thesis"),
    ("wiring", "trunk", "none"),
    ("evolution", "output_activation", None),
    ("evolution", "mutation", "fixed"),
    ("evolution", "safe_mutation", False),
    ("evolution", "weight_mutate_power_min", 0.0),
    ("evolution", "weight_mutate_power_max", 12.0),
    ("evolution", "crossover", "choose"),
    ("evolution", "crossover_prob", 1.0),
    ("evolution", "parent_selection", "uniform"),
)
"""Settings that were added later, by section and name, with the value that means the earlier behaviour: runs with that
value keep their hashes."""
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,99}")


@dataclass(frozen=True)
class RunSettings:
    """One training of one variant with one seed; the defaults are Ant's quick budget.

    Attributes:
        task: what is learned.
        algorithm: settings of the algorithm, or its name in `ALGORITHMS` for its defaults.
        geometry, linkage, wiring: how modules are wired.
        noise: what disturbs the agent, in training, validation and test alike.
        evolution: how genomes change and compete; by default, settings that suit the task's kind of network.
        executor: where episodes run; without effect on results, except for ``warp`` and its device.
        seed: root of all random streams except those of validation and test.
        generations, population: of each subpopulation.
        episodes: training episodes per team and generation.
        pairing: ``rank``, ``parents`` or ``index``.
        judging: ``last`` or ``mean``: a team that survives competes by its mean over the episodes of one generation, or
            over all that it ever had; under ``mean`` the best are evaluated again, at the expense of new teams.
        champion: how the champion is chosen, ``race`` or ``thesis``.
        validation_episodes: per team of the hall of fame; in a race, of the last teams in it.
        test_episodes: per tested brain.
        name: directory below `output`; None takes the task's name.
        output: root of all run directories; a leading ``~`` is the home directory.
        resume: continue an unfinished run, or extend a finished one.
        checkpoint_every: generations between checkpoints.
        tracker: one or several of `TRACKERS`, which are told of the run; without effect on results.
        task_kind: ``package.module:Class`` of the task if the user named it that way, else None; ``task.kind`` in plain
            data.

    Raises:
        ConfigError: a value is out of range, or the combination makes no sense.
    """

    task: Task = field(default_factory=AntTask)
    algorithm: Algorithm = field(default_factory=ExNEAT)
    geometry: Geometry = field(default_factory=Geometry)
    linkage: str = "none"
    wiring: Wiring = field(default_factory=Wiring)
    noise: Noise = field(default_factory=Noise)
    evolution: EvolutionSettings = None  # type: ignore[assignment]
    executor: Executor = field(default_factory=Executor)
    seed: int = 0
    generations: int = 25
    population: int = 100
    episodes: int = 1
    pairing: str = "rank"
    judging: str = "last"
    champion: str = "thesis"
    validation_episodes: int = 10
    test_episodes: int = 20
    name: str | None = None
    output: str = "outputs"
    resume: bool = False
    checkpoint_every: int = 1
    tracker: str | Sequence[str] = "none"
    task_kind: str | None = None

    def __post_init__(self) -> None:
        if not is_ours(self.task):
            check_description(self.task)
        if isinstance(self.algorithm, str):
            object.__setattr__(self, "algorithm", _chosen(ALGORITHMS, "algorithm", {"name": self.algorithm}))
        if self.evolution is None:
            object.__setattr__(self, "evolution", self.algorithm.usual_evolution(_suiting(self.task)))
        check_whole("seed", self.seed, 0, 2**64 - 1)
        check_whole("generations", self.generations, 1)
        check_whole("population", self.population, 2, 1_000_000)
        check_whole("episodes", self.episodes, 1)
        check_choice("pairing", self.pairing, PAIRINGS)
        check_choice("judging", self.judging, JUDGINGS)
        check_choice("champion", self.champion, CHAMPIONS)
        check_whole("validation_episodes", self.validation_episodes, 1)
        check_whole("test_episodes", self.test_episodes, 1)
        check_flag("resume", self.resume)
        check_whole("checkpoint_every", self.checkpoint_every, 1)
        for name in [self.tracker] if isinstance(self.tracker, str) else self.tracker:
            check_choice("tracker", name, ("none", *TRACKERS))
        output = check_path("output", self.output, "a directory, without control characters")
        object.__setattr__(self, "output", str(output))
        if self.name is not None and (not isinstance(self.name, str) or not _NAME.fullmatch(self.name)):
            fix = "run directories stay below output=; set that to write elsewhere"
            raise ConfigError("name", "one folder name of letters, digits, '.', '_' and '-'", self.name, fix)
        self._settle()
        if self.executor.name == "warp" and not isinstance(self.task, HasBatch):
            raise ConfigError("executor", f"another executor with task={self.task.name}", "warp", "it runs robots only")
        self.algorithm.check(self.problem)

    def _settle(self) -> None:
        """Fill in what is left to the task, and to how its parts share genomes."""
        own = self.task.usual_reset_scale() if isinstance(self.task, HasInitialPose) else None
        if own is None and self.noise.reset_scale not in (None, _NO_POSE):
            fix = f"task={self.task.name} has no initial pose that noise could disturb"
            raise ConfigError("noise.reset_scale", "null, its default", self.noise.reset_scale, fix)
        if self.noise.reset_scale is None:
            object.__setattr__(self, "noise", replace(self.noise, reset_scale=_NO_POSE if own is None else own))
        if self.algorithm.modular:
            subpopulations = self.geometry.subpopulations(self.task.parts)
            object.__setattr__(self, "task", self.task.shared_by(subpopulations))

    @property
    def plan(self) -> Plan:
        """Who senses and drives what."""
        return self.algorithm.plan(self.task, self.geometry, self.linkage, self.wiring, self.evolution)

    @property
    def problem(self) -> Problem:
        """What the algorithm is to solve."""
        return Problem(
            plan=self.plan,
            evolution=self.evolution,
            population=self.population,
            episodes=self.episodes,
            pairing=self.pairing,
            seed=self.seed,
            judging=self.judging,
            champion=self.champion,
        )

    @property
    def variant(self) -> str:
        """The variant in one word, e.g. ``exneat-all-none`` or ``neat``."""
        if not self.algorithm.modular:
            return self.algorithm.name
        vector = self.geometry.subpopulations(self.task.parts) if self.geometry.vector else ()
        geometry = self.geometry.name + "".join(str(entry) for entry in vector)
        words = [self.algorithm.name, geometry, self.linkage]
        if self.wiring.trunk != "none":
            words.append(f"trunk{self.wiring.trunk}")
        elif self.task.trunk is not None and self.wiring.central is False:
            words.append("nocentral")
        return "-".join(words)

    @property
    def wants_moments(self) -> bool:
        """Whether the algorithm wants statistics of what the networks sense."""
        return self.algorithm.wants_moments(self.evolution)

    @property
    def trackers(self) -> tuple[str, ...]:
        """The trackers by name, each once."""
        names = (self.tracker,) if isinstance(self.tracker, str) else self.tracker
        return tuple(dict.fromkeys(name for name in names if name != "none"))

    @property
    def trained_generations(self) -> int:
        """Generations of training; 0 for a baseline, which is not trained."""
        return 0 if self.algorithm.rule else self.generations

    @cached_property
    def directory(self) -> RunDirectory:
        """Where the run keeps its files: ``<output>/<name>/<variant>-s<seed>-<hash>``."""
        short = configuration_hash(self._identity(), with_seed=False)[:6]
        return RunDirectory(Path(self.output) / (self.name or self.task.name) / f"{self.variant}-s{self.seed}-{short}")

    @cached_property
    def full_hash(self) -> str:
        """Hash of everything on which results depend, except the number of generations."""
        return configuration_hash(self._identity())

    def _identity(self) -> dict[str, Any]:
        """What is hashed: the settings with defaults that depend on the task spelled out."""
        plain = self.to_plain()
        plain["task"] = {**self.task.identity(), **({} if self.task_kind is None else {"kind": self.task_kind})}
        plain["evolution"] = self.algorithm.identity_of(self.evolution)
        for section, name, before in _CAME_LATER:
            own = plain[section] if section else plain
            if own.get(name) == before:
                own.pop(name, None)
        if self.executor.name == "warp":
            kind = self.executor.device_name.partition(":")[0]
            plain["backend"] = {"name": "warp", "device": kind, "precision": "float32"}
        plain["wiring"]["central"] = any(module.name == CENTRAL for module in self.plan.modules)
        if self.geometry.vector is not None:
            plain["geometry"]["vector"] = list(self.geometry.subpopulations(self.task.parts))
        return plain

    def to_plain(self) -> dict[str, Any]:
        """The settings as dicts, lists, tuples, numbers and strings; `from_plain` reads them back."""
        plain = {**asdict(self), "task": self.task.to_plain()}
        kind = plain.pop("task_kind")
        return plain if kind is None else {**plain, "task": {**plain["task"], "kind": kind}}

    @classmethod
    def from_plain(cls, plain: Mapping[str, Any]) -> RunSettings:
        """Settings from plain data, such as a composed configuration or a run's config.yaml.

        Raises:
            ConfigError: a key is unknown, a value has the wrong type or range, or it would need code that
                the user neither registered nor named, see `exneat_cli.tasks.user_code`.
        """
        kind, task = _task(plain.get("task"))
        algorithm = _chosen(ALGORITHMS, "algorithm", plain.get("algorithm", {"name": "exneat"}))
        chosen: dict[str, Any] = {"task": task, "task_kind": kind, "algorithm": algorithm}
        if "evolution" in plain:
            usual = asdict(algorithm.usual_evolution(_suiting(task)))
            chosen["evolution"] = {**usual, **check_section("evolution", plain["evolution"])}
        return build(cls, {**plain, **chosen})


def _suiting(task: Task) -> EvolutionSettings:
    return RECURRENT if task.recurrent else EvolutionSettings()


def _task(values: object) -> tuple[str | None, Task]:
    """The name of the task's class, if the user chose the task by that, and the task."""
    section = {key: value for key, value in check_section("task", values).items() if (key, value) != ("name", None)}
    found, kind = find_task(section, TASKS), section.pop("kind", None)
    try:
        return kind, build(found, section, "task.")
    except ExneatError:
        raise
    except Exception as error:  # whatever a user's class raises on values that it does not expect
        raise ConfigError("task", f"parameters that {found.__name__} accepts", section, repr(error)[:300]) from error


def read_task(section: object) -> Task:
    """A task from plain data, by the ``name`` in it.

    Raises:
        ConfigError: there is no such task, or it cannot be made of these parameters.
    """
    return _task(section)[1]


def _chosen(registry: Mapping[str, type[_Part]], key: str, values: object) -> _Part:
    """One of several dataclasses, by the ``name`` in its section."""
    section = check_section(key, values)
    check_choice(key, section.get("name"), list(registry))
    return build(registry[section["name"]], section, f"{key}.")
