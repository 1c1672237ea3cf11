"""Over a dask cluster: the same outcomes as on one thread, whoever dies meanwhile, and nothing left behind."""

from __future__ import annotations

import importlib.util
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import psutil
import pytest

from exneat_cli.brains import Brain, RandomActions, linear_fusion, motionless
from exneat_cli.errors import ConfigError, ExneatError
from exneat_cli.rollouts import Executor, Noise, Runner, cluster, cluster_work, keep_clusters
from exneat_cli.rollouts.cluster_worker import play_parcel, versions
from exneat_cli.runs import RunSettings, train
from exneat_cli.seeding import shared_episodes, training_episodes
from exneat_cli.tasks import AntTask, GeneralMaze, Task
from exneat_cli.wiring import Geometry
from tests.rollouts.test_runner import ant_brains, assert_equal
from tests.torture.dask_workers import workers_of_this_process

TWO = Executor("dask", 2)
SERIAL = Executor("serial")
ANT = AntTask(max_steps=200)
MAZE = GeneralMaze()


@pytest.fixture(scope="module", autouse=True)
def _one_cluster_for_all() -> Iterator[None]:
    before = {thread for thread in threading.enumerate() if thread.is_alive()}
    with keep_clusters():
        yield
    assert not workers_of_this_process()
    # dask keeps this idle one for as long as the process lives; it is a daemon.
    left = [thread for thread in threading.enumerate() if thread not in before]
    assert {thread.name for thread in left} <= {"Dask-Offload_0"}


def maze_brains(count: int) -> list[Brain]:
    moving = [motionless(8, np.eye(5)[k % 5]) for k in range(count - 1)]
    return [linear_fusion(8, 5, MAZE.parts), *moving]


@pytest.mark.parametrize(
    ("task", "brains", "workers"),
    [(ANT, ant_brains(7), 2), (MAZE, maze_brains(31), 2), (MAZE, maze_brains(31), 3)],
    ids=["ant-2", "maze-2", "maze-3"],
)
def test_outcomes_are_those_of_one_thread(task: Task, brains: list[Brain], workers: int) -> None:
    episodes, noise = training_episodes(0, 3, 3), Noise(0.1)
    with Runner(task, noise, SERIAL, training=True) as runner:
        expected = runner.run(brains, episodes)
    with Runner(task, noise, Executor("dask", workers), training=True) as runner:
        for _ in range(2):
            assert_equal(runner.run(brains, episodes), expected)
        one = runner.run(brains[:1], episodes[:1])
    assert one.fitness == expected.fitness[:1, :1]
    assert len(np.unique(expected.fitness)) > 3


def test_random_actions_and_traces_are_those_of_one_thread() -> None:
    acting, episodes = RandomActions(*ANT.action_bounds), shared_episodes("test", 5)
    with Runner(ANT, Noise(), SERIAL, training=False) as one, Runner(ANT, Noise(), TWO, training=False) as two:
        assert_equal(two.run(acting, episodes), one.run(acting, episodes))
        np.testing.assert_array_equal(two.trace(acting, episodes[1]).steps, one.trace(acting, episodes[1]).steps)
        brain = ant_brains(2)[1]
        np.testing.assert_array_equal(two.trace(brain, episodes[1]).steps, one.trace(brain, episodes[1]).steps)


def test_a_cluster_at_an_address_does_as_well() -> None:
    with Runner(MAZE, Noise(), TWO, training=False) as runner:
        expected = runner.run(maze_brains(9), shared_episodes("test", 2))
        address = cluster.cluster_of(TWO).client.scheduler.address
        with Runner(MAZE, Noise(), Executor("dask", address=address), training=False) as afar:
            assert_equal(afar.run(maze_brains(9), shared_episodes("test", 2)), expected)


def test_a_whole_run_leaves_the_bytes_of_a_serial_one(tmp_path: Path) -> None:
    def files(executor: Executor) -> dict[str, bytes]:
        settings = RunSettings(
            task=AntTask(max_steps=60, patience=20),
            geometry=Geometry("lr"),
            generations=3,
            population=9,
            episodes=2,
            validation_episodes=2,
            test_episodes=3,
            executor=executor,
            output=str(tmp_path / executor.name),
        )
        run = train(settings).directory
        kept = ("champion.json", "hall_of_fame.jsonl", "trace.csv")
        rows = run.history.read_bytes().splitlines()
        assert rows[0].endswith(b",wall_seconds")
        history = b"\n".join(line.rpartition(b",")[0] for line in rows)
        return {"history": history, **{name: (run.path / name).read_bytes() for name in kept}}

    assert files(TWO) == files(SERIAL)


@pytest.mark.parametrize(
    ("broken", "error", "message"),
    [
        (lambda *_: __import__("no_such_module"), ExneatError, "a worker cannot import what it needs: No module named"),
        (lambda *_: 1 / 0, ZeroDivisionError, "division by zero"),
    ],
)
def test_an_error_in_a_worker_reaches_the_caller_and_leaves_the_cluster_usable(
    broken: Callable[..., object], error: type[Exception], message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    brains, episodes = maze_brains(5), shared_episodes("test", 2)
    with Runner(MAZE, Noise(), TWO, training=False) as runner:
        monkeypatch.setattr(cluster_work, "play_parcel", broken)
        with pytest.raises(error, match=message):
            runner.run(brains, episodes)
        monkeypatch.undo()
        assert not runner.run(brains, episodes).failed.any()


def test_the_work_of_a_killed_worker_is_done_again() -> None:
    brains, episodes, killed = ant_brains(40), training_episodes(0, 3, 4), []

    def kill() -> None:
        for pid in workers_of_this_process():
            os.kill(pid, signal.SIGKILL)
            killed.append(pid)

    with Runner(ANT, Noise(), SERIAL, training=True) as runner:
        expected = runner.run(brains, episodes)
    with Runner(ANT, Noise(), TWO, training=True) as runner:
        assert_equal(runner.run(brains, episodes), expected)
        killer = threading.Timer(0.2, kill)
        killer.start()
        outcomes = runner.run(brains, episodes)
        assert len(killed) >= 2
        killer.join()
    assert_equal(outcomes, expected)


def test_workers_with_other_versions_are_refused() -> None:
    message = r"expected workers with numpy 1\.0, got .*\n  install the same on all machines"
    with pytest.raises(ExneatError, match=message):
        play_parcel({**versions(), "numpy": "1.0"}, b"")


def test_an_address_where_nothing_answers_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "CONNECT_SECONDS", 1)
    nowhere = Executor("dask", address="tcp://127.0.0.1:9")
    with pytest.raises(ExneatError, match=r"executor\.address: expected a dask scheduler at tcp://127.0.0.1:9"):
        Runner(MAZE, Noise(), nowhere, training=False)


def test_a_cluster_that_stays_without_workers_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    from distributed import LocalCluster

    monkeypatch.setattr(cluster_work, "PATIENCE_SECONDS", 1.0)
    with LocalCluster(n_workers=0, processes=False, protocol="tcp://", dashboard_address=":0") as empty:
        executor = Executor("dask", address=empty.scheduler_address)
        with Runner(MAZE, Noise(), executor, training=False) as runner, pytest.raises(ExneatError, match="no workers"):
            runner.run(maze_brains(3), shared_episodes("test", 1))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"name": "threads", "address": "tcp://a:1"}, r"executor\.address: expected none with executor=threads"),
        ({"address": "somewhere"}, r"executor\.address: expected a scheduler's address"),
        ({"address": "tcp://a:1", "workers": 2}, r"executor\.workers: expected 0 together with"),
    ],
)
def test_settings_of_an_executor_that_make_no_sense_are_refused(changes: dict[str, object], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        Executor(**{"name": "dask", **changes})  # type: ignore[arg-type]


def test_without_dask_a_run_is_refused_before_it_leaves_anything(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("exneat_cli.rollouts.executor.find_spec", lambda name: None)
    assert importlib.util.find_spec("distributed")
    with pytest.raises(ExneatError, match=r"pip install 'exneat\[dask\]'"):
        train(RunSettings(executor=TWO, output=str(tmp_path / "out")))
    assert not (tmp_path / "out").exists()


def test_dask_is_not_imported_before_it_is_needed() -> None:
    program = "import sys, exneat_cli.commands.train; sys.exit('dask' in sys.modules or 'distributed' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_to_all_processes_ends_them_all_with_one_line(
    tmp_path: Path, number: signal.Signals, code: int
) -> None:
    program = Path(sys.executable).parent / "exneat"
    settings = ["task=general_maze", "generations=100000", "executor=dask", "executor.workers=2", f"output={tmp_path}"]
    started = subprocess.Popen(
        [program, "train", *settings], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    deadline = time.monotonic() + 120
    while not list(tmp_path.glob("*/*/history.csv")):
        assert started.poll() is None, started.stderr
        assert time.monotonic() < deadline
        time.sleep(0.1)
    children = psutil.Process(started.pid).children(recursive=True)
    assert len(children) >= 2
    os.killpg(started.pid, number)
    _, error = started.communicate(timeout=60)
    assert started.returncode == code
    shown = [line for line in error.splitlines() if not line.startswith("exneat-")]
    assert [line.partition(";")[0] for line in shown] == ["exneat: interrupted"]
    _, alive = psutil.wait_procs(children, timeout=10)
    assert not alive
