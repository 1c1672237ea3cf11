"""`exneat search`: trainings whose settings Optuna chooses from the validation fitness of earlier ones.

Optuna's records are in a SQLite file beside the runs. The settings of a trial depend only on the trials before it and
on their number, so a killed search continues as if nothing had happened.
"""

from __future__ import annotations

import hashlib
import json
import shlex
from collections.abc import Mapping
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import msgspec

from exneat_cli.commands.command_line import CommandLine
from exneat_cli.commands.jobs import Job, read_job
from exneat_cli.commands.setting import as_written, read_setting
from exneat_cli.commands.shipped import chosen_file
from exneat_cli.errors import ExneatError, check_whole
from exneat_cli.records import RunDirectory, converted, make_directory, read_yaml
from exneat_cli.runs import Progress, train

_OWN = ("space", "trials")
"""Settings of the search itself, not of its trials; conf/search.yaml explains them."""


class Range(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Numbers from low to high, whole ones if both ends are; with `log`, their logarithm is drawn uniformly."""

    low: int | float
    high: int | float
    log: bool = False

    def __post_init__(self) -> None:
        if not self.low <= self.high or (self.log and self.low <= 0):
            raise ValueError(f"expected low <= high, and with log low > 0, got {self.low} and {self.high}")


class Space(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The range or choices of each searched setting, by dotted name; and the settings that all trials share."""

    space: dict[str, Range | list[bool | int | float | str]]
    settings: dict[str, Any] = {}


def run(line: CommandLine) -> int:
    """Do the missing trials, and print the best; returns the exit code.

    Raises:
        ExneatError: an argument makes no sense, Optuna is missing, another search is running, or a training failed.
    """
    asked = line.compose(*_OWN)
    check_whole("trials", asked["trials"], 1)
    path, space = _read_space(asked["space"])
    if find_spec("optuna") is None:
        raise ExneatError("exneat search: expected Optuna, which is not installed\n  pip install 'exneat[search]'")
    fixed = _texts(space.settings, line)
    line = replace(line, settings=(*fixed, *line.settings))
    first = _trial(line, {}, f"search-{path.stem}")
    if first.settings.algorithm.rule:
        raise ExneatError(
            f"algorithm={first.settings.algorithm.name}: nothing is trained, so there is nothing to search"
        )
    folder = first.settings.directory.path.parent
    make_directory(folder)
    with RunDirectory(folder).held():
        study = _study(folder, first, space)
        _search(study, space, line, path.stem, asked["trials"])
    best = study.best_trial
    done = _complete(study)
    equals = sum(trial.value == best.value for trial in done)
    alone = f", the first of {equals} that reached it" if equals > 1 else ""
    where = f"trial {best.number}{alone}, {best.user_attrs['run']}"
    print(f"\nbest of {len(done)} trials: validation fitness {best.value:.6g}, {where}")
    print("to repeat this training elsewhere:")
    others = [word for word in line.words[2:] if word.partition("=")[0] not in (*_OWN, "name")]
    settings = [f"{key}={_typed(value)}" for key, value in (space.settings | best.params).items()]
    print(shlex.join(["exneat", "train", *settings, *others, f"name=best-{path.stem}"]))
    return 0


def _read_space(name: object) -> tuple[Path, Space]:
    path = chosen_file("space", name, "experiments/searches")
    space = converted(read_yaml(path), Space, f"{path}")
    if not space.space:
        raise ExneatError(f"{path}: space: expected at least one setting to search, got none")
    for key, values in space.space.items():
        if values == []:
            raise ExneatError(f"{path}: space: {key}: expected at least one choice, got none")
    return path, space


def _texts(settings: Mapping[str, Any], line: CommandLine) -> tuple[str, ...]:
    return tuple(read_setting(f"{key}={as_written(value)}", line.directories) for key, value in settings.items())


def _trial(line: CommandLine, chosen: Mapping[str, Any], folder: str) -> Job:
    """The training with the chosen values, which take precedence over the command line."""
    is_named = any(text.lstrip("+").startswith("name=") for text in line.settings)
    named = () if is_named else _texts({"name": folder}, line)
    return read_job("", replace(line, settings=(*line.settings, *named, *_texts(chosen, line))), _OWN)


def _study(folder: Path, first: Job, space: Space) -> Any:
    """The study of these settings in the folder's file; trials that a killed process left open are marked failed."""
    import optuna

    optuna.logging.set_verbosity(optuna.logging.WARNING)
    question = [first.settings.full_hash, first.settings.trained_generations, msgspec.to_builtins(space.space)]
    name = hashlib.sha256(json.dumps(question, sort_keys=True).encode()).hexdigest()[:16]
    storage = f"sqlite:///{folder / 'study.db'}"
    study = optuna.create_study(study_name=name, storage=storage, direction="maximize", load_if_exists=True)
    for trial in study.get_trials(deepcopy=False, states=[optuna.trial.TrialState.RUNNING]):
        study.tell(trial.number, state=optuna.trial.TrialState.FAIL)
    return study


def _complete(study: Any) -> list[Any]:
    return [trial for trial in study.get_trials(deepcopy=False) if trial.state.name == "COMPLETE"]


def _search(study: Any, space: Space, line: CommandLine, name: str, trials: int) -> None:
    import optuna

    possible = {key: _distribution(values) for key, values in space.space.items()}
    while (done := len(_complete(study))) < trials:
        study.sampler = optuna.samplers.TPESampler(seed=done)
        trial = study.ask(possible)
        job = _trial(line, trial.params, f"search-{name}")
        finished = train(job.settings, progress=Progress(), command=line.words, go_on=True)
        trial.set_user_attr("run", str(finished.directory.path))
        study.tell(trial, finished.result.validation)
        chosen = "  ".join(f"{key.rpartition('.')[2]} {_short(value)}" for key, value in trial.params.items())
        print(f"[{done + 1}/{trials}] validation {finished.result.validation:.4g}: {chosen}", flush=True)


def _typed(value: object) -> str:
    """A value as a user would type it."""
    return value if isinstance(value, str) and value.isidentifier() else as_written(value)


def _short(value: object) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def _distribution(values: Range | list[bool | int | float | str]) -> Any:
    import optuna

    if not isinstance(values, Range):
        return optuna.distributions.CategoricalDistribution(values)
    if isinstance(values.low, int) and isinstance(values.high, int):
        return optuna.distributions.IntDistribution(values.low, values.high, log=values.log)
    return optuna.distributions.FloatDistribution(values.low, values.high, log=values.log)
