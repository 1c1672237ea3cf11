"""Over a dask cluster: the same outcomes as on one thread, whoever dies meanwhile, and nothing left behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import distributed
import psutil
import pytest
from hypothesis import given
from hypothesis import strategies as st

from exneat_cli.errors import ConfigError, ExneatError
from exneat_cli.rollouts import Executor, cluster, keep_workers, settings
from exneat_cli.rollouts.blocks import blocks, run_block, versions
from exneat_cli.rollouts.workers import workers_of
from exneat_cli.runs import RunSettings, train
from exneat_cli.tasks import AntTask, GeneralMaze, Task
from exneat_cli.wiring import Geometry
from tests.rollouts.drifting import SERIAL, Drifting, assert_equal, random_brains, run
from tests.torture.dask_workers import RESULTS, workers_of_this_process

TWO = Executor("dask", 2)
ANT = AntTask(max_steps=60)
PLAIN = Drifting(compiled=False)  # every worker would have to compile it anew


@pytest.fixture(scope="module", autouse=True)
def _one_cluster_for_all(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    threads, scratch = set(threading.enumerate()), tmp_path_factory.mktemp("scratch")
    with pytest.MonkeyPatch.context() as patch, keep_workers():
        patch.setattr(tempfile, "tempdir", str(scratch))
        yield
    assert not workers_of_this_process()
    assert not list(scratch.glob("exneat-*"))
    # dask keeps these for as long as the process lives; they are daemons.
    assert {thread.name for thread in threading.enumerate() if thread not in threads} <= {"Dask-Offload_0", "IO loop"}


@pytest.mark.parametrize("task", [ANT, GeneralMaze(), PLAIN], ids=lambda task: task.name)
def test_outcomes_and_moments_are_those_of_one_thread(task: Task) -> None:
    for brains in (random_brains(13, task), random_brains(1, task), None):
        assert_equal(run(task, brains, TWO), run(task, brains, SERIAL))


def test_a_cluster_at_an_address_does_as_well() -> None:
    afar, brains = Executor("dask", address=workers_of(TWO).client.scheduler.address), random_brains(9)
    assert_equal(run(PLAIN, brains, afar), run(PLAIN, brains, SERIAL))


def test_a_cluster_of_our_own_listens_on_this_machine_alone() -> None:
    run(PLAIN, random_brains(9), TWO)
    processes = [psutil.Process(), *psutil.Process().children(recursive=True)]
    sockets = [socket for process in processes for socket in process.net_connections()]
    assert {socket.laddr.ip for socket in sockets if socket.status == psutil.CONN_LISTEN} == {"127.0.0.1"}


def test_a_whole_run_leaves_the_bytes_of_a_serial_one(tmp_path: Path) -> None:
    def files(where: Executor) -> list[bytes]:
        sizes = {"generations": 3, "population": 9, "episodes": 2, "validation_episodes": 2, "test_episodes": 3}
        body = {"task": AntTask(max_steps=60, patience=20), "geometry": Geometry("lr"), "linkage": "full"}
        found = train(RunSettings(executor=where, output=str(tmp_path / where.name), **body, **sizes)).directory
        history = [line.rpartition(b",")[0] for line in found.history.read_bytes().splitlines()]
        return [*history, *(found.path.joinpath(name).read_bytes() for name in RESULTS)]

    assert files(TWO) == files(SERIAL)


@pytest.mark.parametrize(
    ("broken", "error", "message"),
    [
        (lambda *_: __import__("no_such_module"), ExneatError, "a worker cannot import what it needs: No module named"),
        (lambda *_: 1 / 0, ZeroDivisionError, "division by zero"),
        (lambda *_: os.kill(os.getpid(), signal.SIGKILL), ExneatError, "one worker after the other died"),
    ],
)
def test_an_error_in_a_worker_reaches_the_caller_and_leaves_the_cluster_usable(
    broken: Callable[..., Any], error: type[Exception], message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cluster, "run_block", broken)
    monkeypatch.setattr(workers_of(TWO)._own.scheduler, "allowed_failures", 0)
    with pytest.raises(error, match=message):
        run(PLAIN, random_brains(5), TWO)
    monkeypatch.undo()
    assert not run(PLAIN, random_brains(5), TWO).failed.any()


def test_the_work_of_killed_workers_is_done_again() -> None:
    brains, killed = random_brains(20, ANT), []

    def kill() -> None:
        for pid in workers_of_this_process():
            os.kill(pid, signal.SIGKILL)
            killed.append(pid)

    expected = run(ANT, brains, SERIAL)
    assert_equal(run(ANT, brains, TWO), expected)
    killer = threading.Timer(0.2, kill)
    killer.start()
    assert_equal(run(ANT, brains, TWO), expected)
    killer.join()
    assert len(killed) >= 2


@given(st.integers(1, 60), st.integers(0, 30), st.integers(1, 20), st.integers(1, 10**9))
def test_processes_get_every_brain_once_in_each_episode(b: int, e: int, workers: int, smallest: int) -> None:
    given_out = blocks(b, e, workers, smallest)
    runs = [(k, n) for some, which in given_out for k in range(some.start, some.stop) for n in range(e)[which]]
    assert sorted(runs) == [(k, n) for k in range(b) for n in range(e)]
    assert len(given_out) >= min(workers, b * e)
    if smallest >= b * e:  # not worth being cut
        assert len(given_out) <= 2 * workers


def test_workers_with_other_versions_are_refused() -> None:
    with pytest.raises(ExneatError, match=r"expected workers with numpy 1\.0, got .*\n  install the same on all"):
        run_block({**versions(), "numpy": "1.0"}, b"", b"")


def test_an_address_without_a_scheduler_or_workers_is_given_up_in_words(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "CONNECT_SECONDS", 1)
    monkeypatch.setattr(cluster, "PATIENCE_SECONDS", 1.0)
    with pytest.raises(ExneatError, match=r"executor\.address: expected a dask scheduler at tcp://127.0.0.1:9"):
        run(PLAIN, [], Executor("dask", address="tcp://127.0.0.1:9"))
    with (
        distributed.LocalCluster(n_workers=0, processes=False, protocol="tcp://", dashboard_address=":0") as empty,
        pytest.raises(ExneatError, match="had no workers for 1 s\n  start some: dask worker"),
    ):
        run(PLAIN, random_brains(3), Executor("dask", address=empty.scheduler_address))


def test_an_address_that_makes_no_sense_is_refused() -> None:
    for message, values in {
        "address: expected none with executor=threads": ("threads", 0, "tcp://a:1"),
        "address: expected a scheduler's address": ("dask", 0, "somewhere"),
        "workers: expected 0 together with": ("dask", 2, "tcp://a:1"),
    }.items():
        with pytest.raises(ConfigError, match=message):
            Executor(*values)


def test_without_dask_a_run_is_refused_before_it_leaves_anything(tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.setattr(settings, "find_spec", lambda name: None)
    with pytest.raises(ExneatError, match=r"pip install 'exneat\[dask\]'"):
        train(RunSettings(executor=TWO, output=str(tmp_path / "out")))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_to_all_processes_ends_them_all_and_the_last_line_goes_on(
    tmp_path: Path, number: int, code: int
) -> None:
    settings = ["task=general_maze", "generations=100000", "executor=dask", "executor.workers=2", f"output={tmp_path}"]
    command = [Path(sys.executable).parent / "exneat", "train", *settings]
    environment = {**os.environ, "TMPDIR": str(tmp_path)}
    started = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True, env=environment)
    deadline = time.monotonic() + 120
    while not list(tmp_path.glob("*/*/history.csv")):
        assert time.monotonic() < deadline
        time.sleep(0.1)
    children = psutil.Process(started.pid).children(recursive=True)
    assert len(children) >= 2
    os.killpg(started.pid, number)
    _, error = started.communicate(timeout=60)
    assert started.returncode == code
    shown = [line for line in error.splitlines() if not line.startswith("exneat-")]
    assert [line.partition("=")[0] for line in shown] == ["exneat: interrupted; to continue:", "exneat resume run"]
    assert not psutil.wait_procs(children, timeout=10)[1]
    assert [path.name for path in tmp_path.iterdir()] == ["general_maze"]
