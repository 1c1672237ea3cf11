"""Ctrl-C, SIGTERM and their like, in processes of their own where they may end one."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from exneat_cli.errors import ExneatError
from exneat_cli.interruption import listening, scratch_directory, signal_heard, uninterrupted
from exneat_cli.main import main

PRELUDE = """
import os, pathlib, signal, subprocess, sys, time
from exneat_cli.interruption import as_worker, launching, listening, scratch_directory, uninterrupted
"""


def in_process(code: str, *arguments: str | Path) -> subprocess.CompletedProcess[str]:
    """Run code in a session of its own, so that it may signal all of its group."""
    command = [sys.executable, "-c", PRELUDE + textwrap.dedent(code), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False, start_new_session=True)


NAMES = ("SIGINT", "SIGTERM", "SIGHUP", "SIGUSR1", "SIGUSR2", "SIGXCPU")


@pytest.mark.parametrize("number", [signal.Signals[name] for name in NAMES])
def test_a_signal_raises_keyboard_interrupt_once_and_is_known_afterwards(number: int) -> None:
    before = signal.getsignal(number)
    with listening():
        assert signal_heard() is None
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(number)
        signal.raise_signal(signal.SIGTERM)  # `timeout` sends it to the process and to its group
        assert signal_heard() == number
    assert (signal_heard(), signal.getsignal(number)) == (None, before)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGHUP])
def test_a_signal_that_is_ignored_from_the_beginning_stays_ignored(number: signal.Signals) -> None:
    ignore = f"signal.signal({number}, signal.SIG_IGN)"
    work = f"""
with listening():
    with uninterrupted():
        os.kill(os.getpid(), {number})
    os.kill(os.getpid(), {number})
    try:
        os.kill(os.getpid(), signal.SIGTERM)
    except KeyboardInterrupt:
        os.kill(os.getpid(), {number})
        print("went on")
"""
    done = in_process(f"{ignore}\nos.execv(sys.executable, [sys.executable, '-c', {PRELUDE + work!r}])")
    assert (done.stdout, done.stderr, done.returncode) == ("went on\n", "", 0)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_scratch_directories_are_gone_with_their_process_or_at_the_next_start(
    number: signal.Signals, tmp_path: Path
) -> None:
    done = in_process(
        f"""
        with listening(), scratch_directory("x-", pathlib.Path(sys.argv[1])) as path:
            (path / "file").touch()
            os.kill(os.getpid(), {number})
    """,
        tmp_path,
    )
    assert done.returncode == -(signal.SIGKILL if number == signal.SIGKILL else signal.SIGINT)
    left = list(tmp_path.iterdir())
    assert len(left) == (number == signal.SIGKILL)
    for path in left:
        os.utime(path / "held", (0, 0))
    with scratch_directory("x-", tmp_path) as own:
        os.utime(own / "held", (0, 0))
        with scratch_directory("x-", tmp_path) as other:
            assert set(tmp_path.iterdir()) == {own, other}
    assert not list(tmp_path.iterdir())


def test_a_second_ctrl_c_ends_the_process_at_once() -> None:
    done = in_process("""
        with listening():
            try:
                os.kill(os.getpid(), signal.SIGINT)
            except KeyboardInterrupt:
                print("first", flush=True)
                os.kill(os.getpid(), signal.SIGINT)
                print("never")
    """)
    assert (done.stdout, done.returncode) == ("first\n", -signal.SIGINT)


@pytest.mark.parametrize("handled_by", ["exneat", "Python"])
def test_what_must_not_be_interrupted_is_finished_first(handled_by: str) -> None:
    done = []

    def work() -> None:
        with uninterrupted():
            with uninterrupted():
                signal.raise_signal(signal.SIGINT)
                done.append("inner")
            done.append("outer")
        done.append("never")

    before = signal.getsignal(signal.SIGINT)
    with listening():
        if handled_by == "Python":
            signal.signal(signal.SIGINT, signal.default_int_handler)
        with pytest.raises(KeyboardInterrupt):
            work()
    assert done == ["inner", "outer"]
    assert signal.getsignal(signal.SIGINT) is before


def test_signals_while_genomes_reproduce_crash_nothing() -> None:
    done = in_process("""
        import random
        from exneat_cli.algorithms import EvolutionSettings, neat_config
        from exneat_cli.algorithms.neat.subpopulation import Subpopulation
        from exneat_cli.seeding import stream

        subpopulation = Subpopulation(neat_config(EvolutionSettings(), 20, (4, 3, 2)), stream(0, "evolution", 0))
        signal.signal(signal.SIGALRM, lambda *_: os.kill(os.getpid(), signal.SIGINT))
        chance, heard = random.Random(0), 0
        for generation in range(1500):
            try:
                with listening():
                    signal.setitimer(signal.ITIMER_REAL, chance.uniform(1e-5, 1e-3))
                    subpopulation.advance(dict.fromkeys(subpopulation.genomes, 0.0))
                    signal.setitimer(signal.ITIMER_REAL, 0)
            except KeyboardInterrupt:
                heard += 1
        print(heard > 100)
    """)
    assert (done.stdout, done.stderr, done.returncode) == ("True\n", "", 0)


def test_a_signal_in_a_callback_where_python_drops_exceptions_is_raised_after_it() -> None:
    done = in_process("""
        import weakref
        thing = set()
        watched = weakref.ref(thing, lambda _: os.kill(os.getpid(), signal.SIGTERM) or time.sleep(60))
        with listening():
            try:
                del thing
                time.sleep(60)
            except KeyboardInterrupt:
                print("raised")
    """)
    assert (done.stdout, done.stderr) == ("raised\n", "")


@pytest.mark.parametrize(
    "error", [KeyboardInterrupt(), ValueError("Invalid bounding box"), ExneatError("no such file")]
)
def test_whatever_error_comes_after_a_signal_is_the_interruption(
    error: BaseException, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(name: str) -> None:
        try:
            signal.raise_signal(signal.SIGTERM)
        except KeyboardInterrupt:
            raise error from None

    monkeypatch.setattr("exneat_cli.main.importlib.import_module", interrupted)
    assert main(["report"]) == 143
    assert capsys.readouterr().err.splitlines() == ["exneat: interrupted; to continue:", "exneat report"]


def test_a_program_that_is_done_ends_with_its_own_exit_code_whatever_comes_late() -> None:
    done = in_process("""
        from exneat_cli.main import program
        sys.argv[1:] = ["--version"]
        program()
        os.kill(os.getpid(), signal.SIGTERM)
        os.kill(os.getpid(), signal.SIGINT)
        raise SystemExit(7)
    """)
    assert (done.returncode, done.stderr) == (7, "")


def test_no_other_python_is_asked_for_the_version_of_a_library_of_windows() -> None:
    done = in_process("""
        started = []
        sys.addaudithook(lambda event, about: started.append(about) if event == "subprocess.Popen" else None)
        from exneat_cli.main import main
        main(["inspect", "task=gym", "task.env_id=HalfCheetah-v5"])
        print("glfw" in sys.modules, started, file=sys.stderr)
    """)
    assert (done.stderr, done.returncode) == ("True []\n", 0)


WORKER = """
try:
    with as_worker(pathlib.Path(sys.argv[1])):
        with uninterrupted():
            print("begun", flush=True)
            time.sleep(0.3)
            pathlib.Path(sys.argv[1], "written").touch()
        time.sleep(60)
except KeyboardInterrupt:
    try:
        with as_worker(pathlib.Path(sys.argv[1])):
            print("never", flush=True)
    except KeyboardInterrupt:
        pathlib.Path(sys.argv[1], "refused").touch()
        time.sleep(60)
"""
LAUNCHER = f"""
place = pathlib.Path(sys.argv[1])
try:
    with listening(), launching(place):
        worker = subprocess.Popen([sys.executable, "-c", {PRELUDE + WORKER!r}, place], stdout=subprocess.PIPE)
        worker.stdout.readline()
        SEND
        while True:
            time.sleep(0.01)
except KeyboardInterrupt:
    print(worker.poll(), (place / "written").exists())
    while not (place / "refused").exists():
        time.sleep(0.01)
    print("refused", flush=True)
"""


@pytest.mark.parametrize(
    "send", ["os.killpg(0, signal.SIGINT)", "os.kill(os.getpid(), signal.SIGTERM)", "os.killpg(0, signal.SIGTERM)"]
)
def test_jobs_of_workers_end_before_anybody_may_kill_them_and_begin_no_more(tmp_path: Path, send: str) -> None:
    done = in_process(LAUNCHER.replace("SEND", send), tmp_path)
    assert (done.stdout, done.stderr, done.returncode) == ("None True\nrefused\n", "", 0)


def test_workers_end_with_a_launcher_that_was_killed(tmp_path: Path) -> None:
    done = in_process(LAUNCHER.replace("SEND", "os.kill(os.getpid(), signal.SIGKILL)"), tmp_path)
    assert done.returncode == -signal.SIGKILL  # and nobody holds its streams any more, or it would still be waited for


def test_a_job_on_another_machine_is_done_without_the_launchers_directory(tmp_path: Path) -> None:
    done = in_process(
        """
        with as_worker(pathlib.Path(sys.argv[1])):
            print("done")
    """,
        tmp_path / "elsewhere",
    )
    assert done.stdout == "done\n"
