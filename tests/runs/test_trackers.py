"""Trackers hold what history.csv holds, each step once, also after a kill, and never cost a run anything."""

from __future__ import annotations

import csv
import importlib
import signal
import struct
import subprocess
import sys
import textwrap
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, ClassVar

import matplotlib.image
import numpy as np
import pytest

from exneat_cli.errors import ConfigError, ExneatError
from exneat_cli.records import RunDirectory
from exneat_cli.rollouts import Executor
from exneat_cli.runs import RunSettings, tracked, train
from exneat_cli.runs.trackers import TRACKERS
from exneat_cli.tasks import TrackMaze
from exneat_cli.wiring import Geometry

ROOT = Path(__file__).parents[2]

KILLED = """
    import os, signal
    from exneat_cli.runs import Progress, train
    from tests.runs.test_trackers import small_run

    class Killing(Progress):
        def generation(self, row):
            if row["generation"] == 3:
                os.kill(os.getpid(), signal.SIGKILL)

    train(small_run({output!r}, {tracker!r}), progress=Killing())
"""

Steps = dict[str, dict[int, list[float]]]
"""Column -> step -> all values that a tracker has there."""


def small_run(output: str, tracker: str | tuple[str, ...] = "none", seed: int = 0) -> RunSettings:
    few = {"generations": 5, "population": 4, "episodes": 1, "validation_episodes": 1, "test_episodes": 2}
    task, executor = TrackMaze(), Executor("serial")
    return RunSettings(
        task=task, geometry=Geometry("single"), executor=executor, output=output, tracker=tracker, seed=seed, **few
    )


def from_tensorboard(run: RunDirectory) -> tuple[Steps, Any]:
    events = pytest.importorskip("tensorboard.backend.event_processing.event_accumulator", reason="no tensorboard here")
    read = events.EventAccumulator(
        str(run.path / "tensorboard"), size_guidance={"scalars": 0, "images": 0, "tensors": 0}
    )
    read.Reload()
    steps: Steps = {}
    for tag in read.Tags()["scalars"]:
        for event in read.Scalars(tag):
            steps.setdefault(tag.replace("/", "."), {}).setdefault(event.step, []).append(event.value)
    assert read.Tags()["images"] == ["figures/training"]
    assert b"population: 4" in read.Tensors("settings")[0].tensor_proto.string_val[0]
    return steps, np.float32


def from_mlflow(run: RunDirectory) -> tuple[Steps, Any]:
    tracking = pytest.importorskip("mlflow.tracking", reason="no mlflow here")
    client = tracking.MlflowClient((run.path.parent.parent / "mlruns").absolute().as_uri())
    (found,) = client.search_runs([each.experiment_id for each in client.search_experiments()])
    steps: Steps = {}
    for name in found.data.metrics:
        for metric in client.get_metric_history(found.info.run_id, name):
            steps.setdefault(name, {}).setdefault(metric.step, []).append(metric.value)
    assert found.data.params["population"] == "4"
    assert [each.path for each in client.list_artifacts(found.info.run_id, "figures")] == ["figures/training.png"]
    return steps, float


def records_of(data: bytes) -> Iterator[bytes]:
    """The records of a file of W&B's, which its library parses but nowhere reads.

    They stand in blocks of 32 KiB as in LevelDB's logs: a checksum, length and kind (whole, first, middle, last).
    """
    place, block, begun = 7, 2**15, b""  # after a heading
    while len(data) - place >= 7:
        if block - place % block < 7:
            place += block - place % block
            continue
        _, length, kind = struct.unpack_from("<IHB", data, place)
        begun += data[place + 7 : place + 7 + length]
        place += 7 + length
        if kind in (1, 4):
            yield begun
            begun = b""


def from_wandb(run: RunDirectory) -> tuple[Steps, Any]:
    parsed = pytest.importorskip("wandb.proto.wandb_internal_pb2", reason="no wandb here")
    (path,) = run.path.glob("wandb/offline-run-*/*.wandb")
    steps: Steps = {}
    pictures = []
    for data in records_of(path.read_bytes()):
        record = parsed.Record.FromString(data)
        items = [(item.key or ".".join(item.nested_key), item.value_json) for item in record.history.item]
        for name, value in items:
            if name.startswith("figures/"):
                pictures.append(name.partition(".")[0])
            elif not name.startswith("_"):
                steps.setdefault(name, {}).setdefault(record.history.step.num, []).append(float(value))
        for item in record.summary.update:
            name = item.key or ".".join(item.nested_key)
            if name.startswith("result/"):
                steps[name.replace("/", ".")] = {0: [float(item.value_json)]}
        if record.run.config.update:
            config = {item.key: item.value_json for item in record.run.config.update}
    assert config["population"] == "4"
    assert set(pictures) == {"figures/training"}
    return steps, float


READERS = {"tensorboard": from_tensorboard, "wandb": from_wandb, "mlflow": from_mlflow}


@contextmanager
def finished(settings: RunSettings) -> Iterator[RunDirectory]:
    """The run done, with a figure that the trackers were told of."""
    with tracked(settings.trackers) as tracking:
        run = train(settings, go_on=True, tracking=tracking).directory
        run.plots.mkdir(exist_ok=True)
        matplotlib.image.imsave(run.plots / "training.png", np.eye(2))
        tracking.pictures(run)
    yield run


@pytest.mark.parametrize("tracker", TRACKERS)
def test_a_tracker_read_back_is_history_csv_with_each_step_once_after_a_kill_amid_the_run(
    tmp_path: Path, tracker: str
) -> None:
    pytest.importorskip(tracker, reason=f"{tracker} is not installed here")
    code = textwrap.dedent(KILLED).format(output=str(tmp_path), tracker=tracker)
    killed = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert killed.returncode == -signal.SIGKILL, killed.stderr
    with finished(small_run(str(tmp_path), tracker)) as run:
        steps, kind = READERS[tracker](run)
    with run.history.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 5
    for name in rows[0].keys() - {"generation"}:
        assert steps[name] == {int(row["generation"]): [kind(float(row[name]))] for row in rows}, name
    result = run.read_result()
    (validation,) = steps["result.validation"].values()
    (test,) = steps["result.champion.fitness_mean"].values()
    assert (validation, test) == ([kind(result.validation)], [kind(result.champion.fitness_mean)])


class Failing:
    """A tracker whose server is gone from some generation on."""

    told: ClassVar[list[str]] = []

    def __init__(self, *arguments: Any) -> None:
        self.told.append("begun")

    def generation(self, row: dict[str, float]) -> None:
        self.told.append("generation")
        if row["generation"] == 2:
            raise OSError(f"asked {'the server ' * 99}for long: no route to host\nand more")

    def close(self) -> None:
        self.told.append("closed")


def test_a_tracker_that_fails_is_named_once_and_costs_the_run_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    module = importlib.import_module("exneat_cli.runs.trackers.tensorboard")
    monkeypatch.setattr(module, "OneRun", Failing)
    followed = train(small_run(str(tmp_path / "a"), "tensorboard"))
    told = capsys.readouterr().err
    name = followed.directory.path.name
    assert told.startswith(f"exneat: {name}: tracker=tensorboard gave up, the run goes on: asked the server the")
    assert told.endswith("the server for long: no route to host\n")
    assert len(told) < 400
    assert Failing.told == ["begun", "generation", "generation"]
    alone = train(small_run(str(tmp_path / "b")))
    same = [one.directory.history.read_text().splitlines() for one in (followed, alone)]
    assert [line.rpartition(",")[0] for line in same[0]] == [line.rpartition(",")[0] for line in same[1]]
    assert name == alone.directory.path.name


def test_a_tracker_that_is_not_installed_is_refused_before_anything_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("exneat_cli.runs.trackers.find_spec", lambda name: None)
    with pytest.raises(ExneatError, match=r"tracker=wandb: .* not installed\n  pip install 'exneat\[wandb\]'"):
        train(small_run(str(tmp_path / "out"), ("none", "wandb")))
    assert not (tmp_path / "out").exists()
    with pytest.raises(ConfigError, match="did you mean tensorboard"):
        small_run(str(tmp_path), "tensorbord")
