"""Whole runs with executor=warp: their bytes depend on no batch, no other run and no interruption."""

from __future__ import annotations

import dataclasses
import re
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exneat_cli.algorithms import EvolutionSettings
from exneat_cli.errors import ConfigError, ExneatError
from exneat_cli.rollouts import Executor, Noise, Outcomes, Runner, keep_workers
from exneat_cli.runs import RunSettings, train
from exneat_cli.seeding import training_episodes
from exneat_cli.tasks import RobotTask
from exneat_cli.wiring import Geometry
from tests.rollouts.drifting import SERIAL, random_brains
from tests.runs.test_resume import content, small, train_stopping

wp = pytest.importorskip("warp", reason="needs exneat[gpu]")

ANT = RobotTask(model="ant", control_period=0.01, max_steps=12, patience=4, progress=0.002)
NOISE = Noise(sensor_std=0.05)
SAFE = EvolutionSettings(initial_connection="full_direct", module_hidden=0, safe_mutation=True)


def on_warp(worlds: int) -> Executor:
    return Executor("warp", worlds=worlds, device="cpu")


@pytest.fixture(scope="module", autouse=True)
def _the_same_worlds_for_all() -> Any:
    with keep_workers():
        yield


def ant(output: Path, worlds: int, **changes: Any) -> RunSettings:
    body = {"task": ANT, "algorithm": "exneat", "geometry": Geometry("single"), "noise": NOISE}
    sizes = {"population": 4, "episodes": 1, "generations": 2, "validation_episodes": 1, "test_episodes": 1}
    return small(output, **{**body, **sizes, "executor": on_warp(worlds), **changes})


def test_a_run_has_the_same_bytes_alone_and_beside_others_in_any_batch(tmp_path: Path) -> None:
    again, wider, beside = (ant(tmp_path / name, worlds) for name, worlds in (("b", 3), ("c", 64), ("d", 3)))
    alone = content(train(ant(tmp_path / "a", 3)).directory)
    other = dataclasses.replace(beside, seed=1)
    with ThreadPoolExecutor(2) as pool:
        together = [done.directory for done in pool.map(train, [beside, other])]
    for directory in (train(again).directory, train(wider).directory, together[0]):
        assert content(directory) == alone
    assert content(together[1]) != alone


def test_a_run_that_was_stopped_goes_on_to_the_same_bytes(tmp_path: Path) -> None:
    undisturbed = train(ant(tmp_path / "a", 3))
    train_stopping(ant(tmp_path / "b", 3), "write_checkpoint", 2)
    resumed = train(ant(tmp_path / "b", 3, resume=True))
    assert content(resumed.directory) == content(undisturbed.directory)
    assert "float32" in resumed.summary


def outcomes(executor: Executor, *, moments: bool = False) -> Outcomes:
    with Runner(ANT, Noise(), executor, training=True) as runner:
        return runner.run(random_brains(5, ANT), training_episodes(3, 0, 2), moments=moments)


def test_episodes_end_as_on_the_cpu_though_there_are_fewer_worlds_than_episodes() -> None:
    expected, came = outcomes(SERIAL), outcomes(on_warp(3))
    assert len(np.unique(expected.steps)) > 1
    np.testing.assert_array_equal(came.steps, expected.steps)
    np.testing.assert_array_equal(came.failed, expected.failed)
    np.testing.assert_allclose(came.fitness, expected.fitness, rtol=0.0, atol=1e-4)
    np.testing.assert_allclose(came.full_reward, expected.full_reward, rtol=0.0, atol=1e-3)


def test_what_networks_sense_has_the_statistics_that_it_has_on_the_cpu() -> None:
    expected, came = (outcomes(executor, moments=True).moments for executor in (SERIAL, on_warp(3)))
    assert expected is not None
    assert came is not None
    np.testing.assert_array_equal(came[0], expected[0])
    np.testing.assert_allclose(came[1], expected[1], rtol=0.0, atol=1e-4)
    np.testing.assert_allclose(came[2], expected[2], rtol=1e-3, atol=1e-4)


@pytest.mark.parametrize("changes", [{"evolution": SAFE}, {"algorithm": "ars"}])
def test_safe_mutation_and_evolution_strategies_train_in_any_batch(changes: dict[str, Any], tmp_path: Path) -> None:
    narrow, wide = (train(ant(tmp_path / str(worlds), worlds, **changes)).directory for worlds in (3, 64))
    assert content(narrow) == content(wide)


def test_room_for_contacts_is_doubled_once(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    from exneat_cli.tasks.robots.batch import worlds

    expected = outcomes(on_warp(10))
    monkeypatch.setattr(worlds, "ROWS", 8)
    np.testing.assert_allclose(outcomes(on_warp(9)).fitness, expected.fitness, rtol=0.0, atol=1e-4)
    assert "it is doubled" in capfd.readouterr().err
    monkeypatch.setattr(worlds, "ROWS", 2)
    with pytest.raises(ExneatError, match="after it was doubled"):
        outcomes(on_warp(8))


def test_the_backend_is_part_of_the_hash_but_the_number_of_worlds_is_not(tmp_path: Path) -> None:
    hashes = {ant(tmp_path, worlds).full_hash for worlds in (3, 64)}
    assert len(hashes) == 1
    assert ant(tmp_path, 3, executor=SERIAL).full_hash not in hashes


def test_what_cannot_run_in_batches_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(ConfigError, match=re.escape("executor: expected another executor with task=track_maze")):
        small(tmp_path, executor=on_warp(3))
    if not wp.is_cuda_available():
        with pytest.raises(ExneatError, match=r"executor\.device: expected one of cpu, got cuda\n"):
            Executor("warp", device="cuda").check_installed()
    monkeypatch.setattr("exneat_cli.rollouts.settings.version", lambda package: "3.1")
    with pytest.raises(
        ExneatError, match=re.escape("expected mujoco-warp 4.0.0, got 3.1\n  pip install 'exneat[gpu]'")
    ):
        on_warp(3).check_installed()
