"""Whole tiny runs from plain objects."""

from __future__ import annotations

import csv
import json
import signal
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exneat_cli.algorithms import ACTIVATIONS
from exneat_cli.brains import Brains, assemble
from exneat_cli.errors import ExneatError
from exneat_cli.records.champion import read_champion
from exneat_cli.rollouts import Executor, Noise, Runner
from exneat_cli.runs import RunSettings, train
from exneat_cli.runs import training as training_module
from exneat_cli.runs.scores import score_all
from exneat_cli.seeding import shared_episodes
from exneat_cli.tasks import AntTask
from exneat_cli.wiring import GEOMETRIES, LINKAGES, Geometry, Wiring
from tests.records.histories import history_of

TINY = {"generations": 2, "population": 6, "validation_episodes": 1, "test_episodes": 2}
SHORT = AntTask(max_steps=60, patience=20)


def tiny(tmp_path: Path, **changes: Any) -> RunSettings:
    return RunSettings(**{"task": SHORT, "output": str(tmp_path), **TINY, **changes})


@pytest.mark.parametrize(
    ("geometry", "linkage", "central"),
    [
        *((geometry, "output", True) for geometry in GEOMETRIES),
        *(("lr", linkage, True) for linkage in LINKAGES if linkage != "output"),
        *(("lr", linkage, False) for linkage in LINKAGES if linkage not in ("feedback", "full")),
    ],
)
def test_every_geometry_and_every_linkage_trains(tmp_path: Path, geometry: str, linkage: str, central: bool) -> None:
    vector = (0, 1, 1, 2) if geometry == "custom" else None
    settings = tiny(
        tmp_path, geometry=Geometry(geometry, vector), linkage=linkage, wiring=Wiring(central), population=4
    )
    finished = train(settings)
    assert len(history_of(finished.directory.history)) == 2
    assert finished.result.champion.episodes == 2


def test_neat_trains_and_leaves_every_file_of_the_design(tmp_path: Path) -> None:
    finished = train(tiny(tmp_path, algorithm="neat"))
    names = {path.name for path in finished.directory.path.iterdir()}
    assert names == {
        *("manifest.json", "config.yaml", "history.csv", "champion.json", "hall_of_fame.jsonl", "trace.csv"),
        *("checkpoint-000001.npz", "checkpoint-000002.npz"),
    }
    assert finished.directory.path.name.startswith("neat-s0-")


def test_random_actions_are_tested_without_training(tmp_path: Path) -> None:
    finished = train(tiny(tmp_path, algorithm="random"))
    names = {path.name for path in finished.directory.path.iterdir()}
    assert names == {"manifest.json", "config.yaml", "robustness.csv", "trace.csv"}
    with finished.directory.robustness.open() as file:
        (row,) = csv.DictReader(file)
    assert (row["variant"], row["parameter"], row["level"], row["episodes"]) == ("random", "none", "0.0", "2")
    assert float(row["fitness_mean"]) == finished.result.champion.fitness_mean
    assert finished.summary.startswith("No training: on 2 test episodes the baseline went ")


@pytest.mark.parametrize("algorithm", ["exneat", "neat", "ars", "openai_es", "cma_es"])
def test_the_history_is_the_same_for_any_number_of_workers(tmp_path: Path, algorithm: str) -> None:
    rows = []
    for workers in (1, 2, 4):
        settings = tiny(
            tmp_path / str(workers),
            algorithm=algorithm,
            generations=4,
            noise=Noise(0.1),
            executor=Executor(workers=workers),
        )
        rows.append(history_of(train(settings).directory.history))
    assert rows[0] == rows[1] == rows[2]


def test_seed_zero_works_and_two_seeds_differ(tmp_path: Path) -> None:
    zero, one = (train(tiny(tmp_path, seed=seed)) for seed in (0, 1))
    assert zero.directory.path != one.directory.path
    assert history_of(zero.directory.history) != history_of(one.directory.history)


def test_history_counts_add_up(tmp_path: Path) -> None:
    settings = tiny(
        tmp_path, generations=5, episodes=2, geometry=Geometry("all"), pairing="index", noise=Noise(0.2, 0.0)
    )
    rows = history_of(train(settings).directory.history)
    assert [int(row["generation"]) for row in rows] == [1, 2, 3, 4, 5]
    assert [int(row["episodes"]) for row in rows] == [12, 24, 36, 48, 60]
    steps = [int(row["env_steps"]) for row in rows]
    assert all(12 <= after - before <= 12 * 60 for before, after in zip([0, *steps], steps, strict=False))
    best = [float(row["best_fitness"]) for row in rows]
    assert [float(row["best_so_far"]) for row in rows] == list(np.maximum.accumulate(best))
    for row in rows:
        assert float(row["best_fitness"]) >= float(row["median_fitness"])


def test_a_finished_run_is_found_not_trained_again(tmp_path: Path) -> None:
    first = train(tiny(tmp_path))
    before = {path: path.stat().st_mtime_ns for path in first.directory.path.iterdir()}
    again = train(tiny(tmp_path, executor=Executor(workers=1)))
    assert (first.trained_now, again.trained_now) == (True, False)
    assert again.summary == first.summary
    assert {path: path.stat().st_mtime_ns for path in first.directory.path.iterdir()} == before


@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError])
def test_an_interrupted_run_can_be_done_again_with_the_same_bytes(
    error: type[BaseException], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    undisturbed = train(tiny(tmp_path / "a"))

    def interrupt(*arguments: object) -> None:
        patch.setattr("exneat_cli.runs.run.signal_heard", lambda: signal.SIGINT)
        raise error

    with monkeypatch.context() as patch:
        patch.setattr("exneat_cli.runs.run.write_history", interrupt)
        with pytest.raises(error):
            train(tiny(tmp_path / "b"))
    directory = tiny(tmp_path / "b").directory
    assert directory.read_manifest().status == "interrupted"
    with pytest.raises(ExneatError, match="resume=true"):
        train(tiny(tmp_path / "b"))
    train(tiny(tmp_path / "b", resume=True))
    assert history_of(directory.history) == history_of(undisturbed.directory.history)
    assert directory.champion.read_bytes() == undisturbed.directory.champion.read_bytes()
    assert directory.read_manifest().status == "done"


def test_the_champion_in_the_file_earns_the_figures_beside_it(tmp_path: Path) -> None:
    settings = tiny(tmp_path, geometry=Geometry("lr"), linkage="full", generations=3)
    finished = train(settings)
    champion = read_champion(finished.directory.champion)
    assert champion.plan == settings.plan
    with Runner(settings.task, settings.noise, settings.executor, training=False) as runner:
        (tested,) = score_all(runner.run([champion.brain()], shared_episodes("test", settings.test_episodes)))
    assert tested == champion.scores.test == finished.result.champion


def test_the_champion_is_the_best_of_the_hall_of_fame_on_validation(tmp_path: Path) -> None:
    settings = tiny(tmp_path, population=20, generations=3, validation_episodes=2)
    finished = train(settings)
    hall = [json.loads(line) for line in finished.directory.hall_of_fame.read_text().splitlines()]
    scores = read_champion(finished.directory.champion).scores
    assert [entry["validation_fitness"] for entry in hall] == sorted(
        (entry["validation_fitness"] for entry in hall), reverse=True
    )
    assert hall[0]["validation_fitness"] == scores.validation.fitness_mean
    assert hall[0]["training_fitness"] == scores.training["fitness"]


def test_training_stops_early_but_the_test_does_not(tmp_path: Path) -> None:
    finished = train(tiny(tmp_path, task=AntTask(max_steps=300, patience=5, progress=1.0), generations=1))
    (row,) = history_of(finished.directory.history)
    assert int(row["env_steps"]) == 6 * 5
    assert finished.result.standing_still.full_reward_mean > 250


def test_a_run_whose_first_write_fails_leaves_no_directory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full_disk(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full_disk)
    with pytest.raises(ExneatError, match="No space left"):
        train(tiny(tmp_path))
    assert not tiny(tmp_path).directory.path.exists()


def exploding(brains: Brains, every: int = 1) -> Brains:
    """NaN biases in every so many brains; identity activations, since neat-python's tanh clips NaN to a number."""
    bias, activation = brains.bias.copy(), brains.activation.copy()
    for b in range(0, len(brains.size), every):
        own = slice(brains.first_node[b], brains.first_node[b + 1])
        bias[own] = np.nan
        activation[own] = ACTIVATIONS.index("identity")
    return brains._replace(bias=bias, activation=activation)


def test_exploding_teams_are_counted_and_never_best(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(training_module, "assemble", lambda *a, **o: exploding(assemble(*a, **o), every=2))
    settings = tiny(tmp_path, population=10, generations=4)
    with Runner(settings.task, settings.noise, settings.executor, training=True) as runner:
        training = training_module.Training.start(settings)
        while not training.is_over:
            training.advance(runner)
    assert [row["failed_episodes"] for row in training.history] == [5, 5, 5, 5]
    assert all(row["best_fitness"] > -100.0 for row in training.history)
    assert all(np.isfinite(list(row.values())).all() for row in training.history)
    assert all(entry.fitness > -100.0 for entry in training.search.candidates())


def test_two_trainings_in_one_process_do_not_disturb_each_other(tmp_path: Path) -> None:
    alone = [history_of(train(tiny(tmp_path / "alone", seed=seed, generations=4)).directory.history) for seed in (0, 1)]
    with ThreadPoolExecutor(2) as pool:
        finished = pool.map(lambda seed: train(tiny(tmp_path / "both", seed=seed, generations=4)), (0, 1))
        assert [history_of(run.directory.history) for run in finished] == alone


def test_a_run_in_which_every_team_explodes_fails_with_a_clear_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(training_module, "assemble", lambda *a, **o: exploding(assemble(*a, **o)))
    with pytest.raises(ExneatError, match="no team ever finished"):
        train(tiny(tmp_path))
    manifest = tiny(tmp_path).directory.read_manifest()
    assert manifest.status == "failed"
    assert "no team ever finished" in str(manifest.error)
    assert [row["failed_episodes"] for row in history_of(tiny(tmp_path).directory.history)] == ["6", "6"]


def test_exploding_physics_leaves_no_log_of_mujoco_in_the_working_directory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ExneatError, match="no team ever finished"):
        train(tiny(tmp_path / "out", noise=Noise(0.0, reset_scale=50.0)))
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
