"""A run that stops anywhere, and one that is made longer, end with the bytes of an undisturbed one."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import pytest

from exneat_cli.algorithms import RECURRENT
from exneat_cli.records import RunDirectory
from exneat_cli.rollouts import Executor, Sweep
from exneat_cli.runs import Progress, RunSettings, run_robustness, scores, train
from exneat_cli.runs import run as run_module
from exneat_cli.tasks import AntTask, TrackMaze
from exneat_cli.wiring import Geometry

GENERATIONS = 5
SWEEP = Sweep("sensor_noise", "noise.sensor_std", (0.0, 0.1))


class StoppedError(Exception):
    """What ends a run in these tests."""


class Listener(Progress):
    """Remembers what it is told."""

    def __init__(self) -> None:
        super().__init__()
        self.said: list[str] = []

    def say(self, text: str) -> None:
        self.said.append(text)


def small(output: Path, **changes: Any) -> RunSettings:
    values: dict[str, Any] = {
        "task": TrackMaze(),
        "algorithm": "neat",
        "generations": GENERATIONS,
        "population": 16,
        "episodes": 2,
        "validation_episodes": 2,
        "test_episodes": 2,
        "executor": Executor("serial"),
        "output": str(output),
    }
    return RunSettings(**{**values, **changes})


def ant(output: Path, **changes: Any) -> RunSettings:
    body = {"task": AntTask(max_steps=30), "algorithm": "exneat", "geometry": Geometry("all"), "linkage": "full"}
    return small(output, **{**body, "population": 6, "episodes": 1, **changes})


def content(directory: RunDirectory) -> dict[str, str]:
    """What must repeat: all files but those that tell of times and processes, history without its last column."""
    files = ["champion.json", "hall_of_fame.jsonl", "trace.csv", "robustness.csv"]
    found = {name: (directory.path / name).read_text() for name in files if (directory.path / name).exists()}
    rows = [line.rsplit(",", 1)[0] for line in directory.history.read_text().splitlines()]
    return {**found, "history.csv": "\n".join(rows)}


def stop_at_call(patch: pytest.MonkeyPatch, name: str, number: int) -> None:
    """Let the `number`-th call of a function that `runs.run` or `runs.scores` uses raise `StoppedError`."""
    module = run_module if hasattr(run_module, name) else scores
    original, calls = getattr(module, name), []

    def counted(*arguments: Any) -> Any:
        calls.append(name)
        if len(calls) == number:
            raise StoppedError
        return original(*arguments)

    patch.setattr(module, name, counted)


def train_stopping(settings: RunSettings, name: str, number: int) -> None:
    with pytest.MonkeyPatch.context() as patch:
        stop_at_call(patch, name, number)
        with pytest.raises(StoppedError):
            train(settings)


def resumed(settings: RunSettings, **changes: Any) -> tuple[dict[str, str], list[str]]:
    """What the run holds at its end, and what it said on the way."""
    listener = Listener()
    finished = train(dataclasses.replace(settings, resume=True, **changes), progress=listener)
    return content(finished.directory), listener.said


@pytest.mark.parametrize("genome", ["array", "stock"])
@pytest.mark.parametrize("algorithm", ["neat", "exneat"])
def test_a_run_that_stops_after_any_generation_ends_with_the_same_bytes(
    tmp_path: Path, genome: str, algorithm: str
) -> None:
    changes = {"evolution": dataclasses.replace(RECURRENT, genome=genome), "algorithm": algorithm}
    undisturbed = content(train(small(tmp_path / "undisturbed", **changes)).directory)
    for generation in range(1, GENERATIONS + 1):
        settings = small(tmp_path / str(generation), **changes)
        train_stopping(settings, "write_checkpoint", generation)
        assert resumed(settings)[0] == undisturbed


@pytest.mark.parametrize("algorithm", ["ars", "openai_es", "cma_es"])
def test_an_evolution_strategy_on_ant_goes_on_and_is_made_longer_to_the_same_bytes(
    tmp_path: Path, algorithm: str
) -> None:
    changes = {"algorithm": algorithm, "linkage": "output"}
    undisturbed = content(train(ant(tmp_path / "undisturbed", **changes)).directory)
    settings = ant(tmp_path / "stopped", **changes)
    train_stopping(settings, "write_checkpoint", 3)
    assert resumed(settings)[0] == undisturbed
    shorter = ant(tmp_path / "longer", generations=2, **changes)
    train(shorter)
    assert resumed(shorter, generations=GENERATIONS)[0] == undisturbed


def test_linked_modules_on_ant_go_on_to_the_same_bytes(tmp_path: Path) -> None:
    undisturbed = content(train(ant(tmp_path / "undisturbed")).directory)
    settings = ant(tmp_path / "stopped")
    train_stopping(settings, "write_checkpoint", 2)
    train_stopping(dataclasses.replace(settings, resume=True), "write_history", 2)
    found, said = resumed(settings)
    assert found == undisturbed
    assert any(text.startswith("continuing after generation 2") for text in said)


def test_a_run_that_judges_by_all_episodes_and_adapts_its_mutations_goes_on_to_the_same_bytes(tmp_path: Path) -> None:
    adaptive = dataclasses.replace(
        RECURRENT, mutation="adaptive", weight_mutate_power_min=0.01, crossover_prob=0.3, parent_selection="rank"
    )
    changes = {"evolution": adaptive, "judging": "mean", "champion": "race", "pairing": "parents"}
    undisturbed = content(train(small(tmp_path / "undisturbed", **changes)).directory)
    for generation in range(1, GENERATIONS + 1):
        settings = small(tmp_path / str(generation), **changes)
        train_stopping(settings, "write_checkpoint", generation)
        assert resumed(settings)[0] == undisturbed


@pytest.mark.parametrize("name", ["write_hall_of_fame", "write_json", "write_csv"])
def test_a_run_that_stops_after_training_trains_no_more(tmp_path: Path, name: str) -> None:
    undisturbed = content(train(small(tmp_path / "undisturbed")).directory)
    settings = small(tmp_path / "stopped")
    train_stopping(settings, name, 1)
    found, said = resumed(settings)
    assert found == undisturbed
    assert f"continuing after generation {GENERATIONS}" in said


@pytest.mark.parametrize("every", [2, 3, 100])
def test_how_often_a_checkpoint_is_written_changes_nothing(tmp_path: Path, every: int) -> None:
    undisturbed = content(train(small(tmp_path / "undisturbed")).directory)
    settings = small(tmp_path / "seldom", checkpoint_every=every)
    train_stopping(settings, "write_history", 4)
    found, said = resumed(settings)
    assert found == undisturbed
    assert [text for text in said if text.startswith("continuing")] == (
        [] if every == 100 else [f"continuing after generation {3 // every * every}"]
    )


def test_two_checkpoints_are_kept_and_one_is_of_the_last_generation(tmp_path: Path) -> None:
    directory = train(small(tmp_path, checkpoint_every=2)).directory
    assert sorted(path.name for path in directory.path.glob("checkpoint*")) == [
        "checkpoint-000004.npz",
        "checkpoint-000005.npz",
    ]


@pytest.mark.parametrize("damaged", [1, 2])
def test_a_damaged_checkpoint_is_passed_over_for_the_one_before_it_or_the_beginning(
    tmp_path: Path, damaged: int
) -> None:
    undisturbed = content(train(small(tmp_path / "undisturbed")).directory)
    settings = small(tmp_path / "stopped")
    train_stopping(settings, "write_checkpoint", 5)
    for path in sorted(settings.directory.path.glob("checkpoint*"), reverse=True)[:damaged]:
        data = bytearray(path.read_bytes())
        data[len(data) // 2] ^= 1
        path.write_bytes(bytes(data))
    found, said = resumed(settings)
    assert found == undisturbed
    assert len([text for text in said if "damaged" in text]) == damaged
    assert ("continuing after generation 3" in said) == (damaged == 1)


@pytest.mark.parametrize("genome", ["array", "stock"])
def test_a_finished_run_that_is_made_longer_ends_as_one_that_was_longer_from_the_start(
    tmp_path: Path, genome: str
) -> None:
    evolution = dataclasses.replace(RECURRENT, genome=genome)
    longer = train(small(tmp_path / "longer", evolution=evolution))
    run_robustness(longer.directory, [SWEEP], episodes=3, executor=Executor("serial"))
    settings = small(tmp_path / "raised", evolution=evolution, generations=2)
    run_robustness(train(settings).directory, [SWEEP], episodes=3, executor=Executor("serial"))
    assert settings.directory.robustness.exists()
    _, said = resumed(settings, generations=GENERATIONS)
    assert "continuing after generation 2" in said
    assert not settings.directory.robustness.exists()
    run_robustness(settings.directory, [SWEEP], episodes=3, executor=Executor("serial"))
    assert content(settings.directory) == content(longer.directory)


def test_going_on_with_other_versions_is_said_and_noted(tmp_path: Path) -> None:
    settings = small(tmp_path)
    train_stopping(settings, "write_history", 3)
    versions = settings.directory.read_manifest().versions
    settings.directory.update_manifest(versions={**versions, "numpy": "1.0"})
    said = resumed(settings)[1]
    assert any(text.startswith("numpy 1.0 then") for text in said)
    assert len(settings.directory.read_manifest().resumed) == 1


def test_a_checkpoint_of_another_run_is_not_gone_on_from(tmp_path: Path) -> None:
    other = train(small(tmp_path / "other", seed=7)).directory
    undisturbed = content(train(small(tmp_path / "undisturbed")).directory)
    settings = small(tmp_path / "stopped")
    train_stopping(settings, "write_checkpoint", 1)
    name = "checkpoint-000004.npz"
    (settings.directory.path / name).write_bytes((other.path / name).read_bytes())
    found, said = resumed(settings)
    assert found == undisturbed
    assert any("belongs to another run" in text for text in said)
