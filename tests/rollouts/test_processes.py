"""In worker processes: the same outcomes as on one thread, whoever dies meanwhile, and nobody left behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import psutil
import pytest

from exneat_cli.errors import ConfigError, ExneatError
from exneat_cli.rollouts import Executor, keep_workers
from exneat_cli.tasks import AntTask, Task
from exneat_cli.tasks.gym import GymTask
from tests.rollouts.drifting import SERIAL, Drifting, assert_equal, random_brains, run
from tests.torture.dask_workers import workers_of_this_process

ONE, TWO = Executor("processes", 1), Executor("processes", 2)
PLAIN, CHEETAH = Drifting(compiled=False), GymTask(env_id="HalfCheetah-v5", max_steps=40)


@pytest.fixture(scope="module", autouse=True)
def _the_same_workers_for_all() -> Iterator[None]:
    threads = set(threading.enumerate())
    with keep_workers():
        yield
    assert not workers_of_this_process()
    assert set(threading.enumerate()) <= threads


@pytest.mark.parametrize("task", [AntTask(max_steps=60), PLAIN, GymTask(), CHEETAH], ids=lambda task: task.name)
def test_outcomes_and_moments_are_those_of_one_thread(task: Task) -> None:
    for brains in (random_brains(13, task), random_brains(1, task), None):
        expected = run(task, brains, SERIAL)
        for where in (ONE, TWO, Executor("threads", 2)):
            assert_equal(run(task, brains, where), expected)


def test_the_work_of_killed_workers_is_done_again() -> None:
    brains, killed = random_brains(20, CHEETAH), []

    def kill() -> None:
        for _ in range(2):
            time.sleep(0.1)
            for worker in workers_of_this_process():
                os.kill(worker, signal.SIGKILL)
                killed.append(worker)

    expected = run(CHEETAH, brains, SERIAL)
    assert_equal(run(CHEETAH, brains, TWO), expected)
    kill()
    assert_equal(run(CHEETAH, brains, TWO), expected)
    killer = threading.Thread(target=kill)
    killer.start()
    assert_equal(run(CHEETAH, brains, TWO), expected)
    killer.join()
    assert len(killed) >= 4


class Lethal(Drifting):
    """Kills whoever opens it in a worker."""

    def open(self, *, training: bool) -> Any:
        if threading.current_thread().name == "MainThread" and "spawn_main" in " ".join(psutil.Process().cmdline()):
            os.kill(os.getpid(), signal.SIGKILL)
        return super().open(training=training)


class Raising(Drifting):
    """Fails in a worker with an error that cannot travel."""

    def open(self, *, training: bool) -> Any:
        if "spawn_main" in " ".join(psutil.Process().cmdline()):
            error: Any = ZeroDivisionError("by nothing")
            error.because = lambda: None
            raise error
        return super().open(training=training)


@pytest.mark.parametrize(
    ("task", "error", "message"),
    [
        (
            Lethal(compiled=False),
            ExneatError,
            "gave up: one worker after the other died over the same brains\n  resume",
        ),
        (Raising(compiled=False), RuntimeError, "ZeroDivisionError: by nothing"),
    ],
)
def test_what_goes_wrong_in_workers_reaches_the_caller_and_the_next_ones_are_sound(
    task: Task, error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        run(task, random_brains(5), TWO)
    assert not run(PLAIN, random_brains(5), TWO).failed.any()


def test_workers_stay_for_the_next_runner() -> None:
    run(PLAIN, random_brains(5), TWO)
    before = workers_of_this_process()
    run(GymTask(), random_brains(5, GymTask()), TWO)
    assert workers_of_this_process() == before


def test_an_address_is_none_of_theirs() -> None:
    with pytest.raises(ConfigError, match=r"executor\.address: expected none with executor=processes"):
        Executor("processes", 0, "tcp://a:1")


def started(folder: Path) -> tuple[subprocess.Popen[str], list[psutil.Process]]:
    """A long run, once it is under way and all that it needs is compiled, and its processes but for the first."""
    settings = ["task=gym", "generations=100000", "executor.workers=2", "task.max_steps=50", f"output={folder}"]
    command = [Path(sys.executable).parent / "exneat", "train", *settings]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True)
    deadline = time.monotonic() + 120
    while not any(len(path.read_text().splitlines()) > 3 for path in folder.glob("*/*/history.csv")):
        assert time.monotonic() < deadline
        assert process.poll() is None, process.stderr.read()  # type: ignore[union-attr]
        time.sleep(0.1)
    children = psutil.Process(process.pid).children(recursive=True)
    assert len(children) >= 2
    return process, children


@pytest.mark.parametrize(
    ("send", "number", "code"),
    [(os.killpg, signal.SIGINT, 130), (os.kill, signal.SIGTERM, 143), (os.killpg, signal.SIGTERM, 143)],
)
def test_a_signal_ends_all_processes_and_the_last_lines_say_how_to_go_on(
    tmp_path: Path, send: Callable[[int, int], None], number: int, code: int
) -> None:
    process, children = started(tmp_path)
    send(process.pid, number)
    _, error = process.communicate(timeout=5)
    assert process.returncode == code
    shown = [line for line in error.splitlines() if not line.startswith("exneat-")]
    assert [line.partition("=")[0] for line in shown] == ["exneat: interrupted; to continue:", "exneat resume run"]
    assert not psutil.wait_procs(children, timeout=2)[1]


def test_workers_die_with_a_killed_parent(tmp_path: Path) -> None:
    process, children = started(tmp_path)
    process.kill()
    process.communicate(timeout=5)
    assert not psutil.wait_procs(children, timeout=5)[1]
