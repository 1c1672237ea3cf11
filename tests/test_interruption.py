"""Ctrl-C and SIGTERM wait for a write in hand, and for nothing else."""

from __future__ import annotations

import signal
import subprocess
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path

import pytest

from exneat_cli.interruption import Interrupted, finishing, heeding, listening


@pytest.fixture(name="listening")
def _listening() -> Iterator[None]:
    with listening():
        yield


@pytest.mark.usefixtures("listening")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_is_raised_with_its_number(number: int) -> None:
    with pytest.raises(Interrupted) as caught:
        signal.raise_signal(number)
    assert caught.value.number == number


@pytest.mark.usefixtures("listening")
def test_a_write_in_hand_is_finished_first() -> None:
    done = []

    def write() -> None:
        with finishing():
            with finishing():
                signal.raise_signal(signal.SIGTERM)
                done.append("inner")
            done.append("outer")
        done.append("never")

    with pytest.raises(Interrupted):
        write()
    assert done == ["inner", "outer"]


def in_process(code: str) -> subprocess.CompletedProcess[str]:
    prelude = (
        "import os, signal, subprocess, sys, time\nfrom exneat_cli.interruption import finishing, listen\nlisten()\n"
    )
    return subprocess.run(
        [sys.executable, "-c", prelude + textwrap.dedent(code)], capture_output=True, text=True, timeout=60, check=False
    )


def is_running(process: int) -> bool:
    try:
        return ") Z " not in Path(f"/proc/{process}/stat").read_text()
    except OSError:
        return False


def test_a_second_signal_ends_the_process_at_once_even_in_the_midst_of_a_write() -> None:
    done = in_process("""
        with finishing():
            os.kill(os.getpid(), signal.SIGINT)
            print("still writing", flush=True)
            time.sleep(0.3)
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(60)
            print("never", flush=True)
    """)
    assert done.stdout == "still writing\n"
    assert done.returncode == 130


def test_a_process_that_swallows_the_signal_is_ended_with_its_children(tmp_path: Path) -> None:
    note = tmp_path / "child"
    done = in_process(f"""
        child = subprocess.Popen(["sleep", "600"])
        open({str(note)!r}, "w").write(str(child.pid))
        try:
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(600)
        except KeyboardInterrupt:
            time.sleep(600)
    """)
    assert done.returncode == 143
    assert not is_running(int(note.read_text()))


DROPPED = """
import os, signal, time, weakref
from exneat_cli import interruption

class Thing:
    pass

interruption.listen()
thing = Thing()
watched = weakref.ref(thing, lambda _: [os.kill(os.getpid(), signal.SIGTERM), time.sleep(0.01)])
try:
    del thing
    time.sleep(60)
except interruption.Interrupted as interrupted:
    print("heard", interrupted.number == signal.SIGTERM)
"""

DROPPED_IN = """
import weakref
class Thing:
    pass
thing = Thing()
watched = weakref.ref(thing, lambda _: [os.kill(os.getpid(), signal.SIGINT), time.sleep(1)])
del thing
time.sleep(60)
"""

SWALLOWED = """
import os, signal, time
from exneat_cli import interruption

interruption.PATIENCE = 0.2
interruption.listen()
try:
    os.kill(os.getpid(), signal.SIGINT)
    time.sleep(60)
except BaseException:
    pass
time.sleep(60)
"""


def test_a_signal_in_the_callback_of_a_weak_reference_is_heard_after_it() -> None:
    done = in_process(DROPPED)
    assert (done.stdout, done.stderr) == ("heard True\n", "")


def test_a_process_that_swallows_the_exception_is_ended_with_the_line_that_says_how_to_go_on() -> None:
    done = in_process(SWALLOWED)
    assert done.returncode == 130
    assert done.stderr.startswith("exneat: interrupted; the same command goes on")


UNHEARD = """
import os, signal, subprocess, sys, time
from multiprocessing import resource_tracker
from exneat_cli.interruption import Interrupted, listen, unheard_by_children
listen()
try:
    with unheard_by_children():
        resource_tracker.ensure_running()
        child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])
        time.sleep(0.5)
        os.killpg(0, signal.SIGINT)
        time.sleep(60)
except Interrupted as interrupted:
    print(interrupted.number == signal.SIGINT, child.poll())
    child.kill()
"""


def test_children_do_not_hear_ctrl_c_where_they_must_not_and_their_parent_does() -> None:
    done = subprocess.run(
        [sys.executable, "-c", UNHEARD], capture_output=True, text=True, timeout=50, check=False, start_new_session=True
    )
    assert (done.stdout, done.stderr) == ("True None\n", "")


def test_a_process_that_is_done_ends_with_its_own_exit_code_whatever_comes_late() -> None:
    done = in_process("""
        from exneat_cli.interruption import stop_listening
        stop_listening()
        os.kill(os.getpid(), signal.SIGTERM)
        os.kill(os.getpid(), signal.SIGINT)
        raise SystemExit(7)
    """)
    assert done.returncode == 7


IN_COMPILED_CODE = """
import hashlib, os, signal, threading
from exneat_cli import interruption

interruption.PATIENCE = {patience}
interruption.listen()
with interruption.scratch_directory() as scratch:
    (scratch / "file").write_text("temporary")
    print(scratch, flush=True)
    for seconds in {moments}:
        threading.Timer(seconds, os.kill, (os.getpid(), signal.SIGTERM)).start()
    hashlib.pbkdf2_hmac("sha256", b"", b"", 2**31 - 1)
"""
"""The main thread is in code that neither looks for signals nor ends within minutes."""


@pytest.mark.parametrize(
    ("patience", "moments"), [pytest.param(0.2, [0.1], id="one"), pytest.param(600.0, [0.1, 0.4], id="two")]
)
def test_a_main_thread_in_compiled_code_is_ended_and_its_temporary_files_deleted(
    patience: float, moments: list[float]
) -> None:
    done = in_process(IN_COMPILED_CODE.format(patience=patience, moments=moments))
    assert done.returncode == 143
    assert not Path(done.stdout.strip()).exists()
    assert ("goes on" in done.stderr) == (len(moments) == 1)


def test_a_process_is_not_ended_amid_a_write() -> None:
    done = in_process("""
        from exneat_cli import interruption
        interruption.PATIENCE, interruption._GRACE = 0.1, 60.0
        try:
            with finishing():
                os.kill(os.getpid(), signal.SIGTERM)
                time.sleep(0.4)
                print("written", flush=True)
        except KeyboardInterrupt:
            time.sleep(60)
    """)
    assert (done.stdout, done.returncode) == ("written\n", 143)


def test_a_watch_that_was_called_off_lets_the_process_live() -> None:
    done = in_process("""
        from exneat_cli import interruption
        interruption.PATIENCE = 0.1
        for _ in range(3):
            try:
                os.kill(os.getpid(), signal.SIGTERM)
                time.sleep(60)
            except KeyboardInterrupt:
                listen()
        time.sleep(0.3)
    """)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.usefixtures("listening")
def test_an_error_that_a_library_made_of_the_interruption_is_the_interruption_again() -> None:
    def library() -> None:
        try:
            signal.raise_signal(signal.SIGTERM)
        except KeyboardInterrupt:
            raise ValueError("Invalid bounding box") from None

    with pytest.raises(Interrupted) as caught, heeding():
        library()
    assert caught.value.number == signal.SIGTERM


@pytest.mark.usefixtures("listening")
def test_an_error_without_a_signal_stays_what_it_is() -> None:
    with pytest.raises(ValueError, match="its own"), heeding():
        raise ValueError("its own")


def test_an_echo_of_the_signal_is_no_second_one() -> None:
    done = in_process("""
        try:
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(60)
        except KeyboardInterrupt:
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(0.5)
            print("tidied up", flush=True)
    """)
    assert (done.stdout, done.returncode) == ("tidied up\n", 0)


def test_a_second_signal_ends_children_too_though_the_main_thread_ends_by_itself(tmp_path: Path) -> None:
    note = tmp_path / "child"
    done = in_process(f"""
        child = subprocess.Popen(["sleep", "600"])
        open({str(note)!r}, "w").write(str(child.pid))
        try:
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(60)
        finally:
            time.sleep(0.3)
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(60)
    """)
    assert done.returncode == 143
    assert not is_running(int(note.read_text()))


def test_ctrl_c_is_heard_also_after_an_exception_was_dropped_amid_children_that_must_not_hear_it() -> None:
    done = in_process(f"""
        from exneat_cli.interruption import unheard_by_children
        try:
            with unheard_by_children():
                exec({DROPPED_IN!r})
        except KeyboardInterrupt:
            print("heard")
    """)
    assert (done.stdout, done.stderr) == ("heard\n", "")


@pytest.mark.parametrize("block", ["listening", "nothing"])
def test_after_the_block_signals_and_errors_are_as_before(block: str) -> None:
    done = in_process(f"""
        from exneat_cli import interruption
        interruption._Heard.watch.call_off()
        signal.set_wakeup_fd(-1)
        signal.signal(signal.SIGINT, signal.default_int_handler)
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        interruption.PATIENCE = 0.1
        sys.unraisablehook = hook = lambda lost: None
        if {block!r} == "listening":
            try:
                with interruption.listening():
                    os.kill(os.getpid(), signal.SIGTERM)
                    time.sleep(60)
            except KeyboardInterrupt:
                pass
        print(signal.getsignal(signal.SIGINT) is signal.default_int_handler, sys.unraisablehook is hook)
        print(signal.getsignal(signal.SIGTERM) == signal.SIG_DFL, signal.set_wakeup_fd(-1))
        try:
            with interruption.heeding():
                raise ValueError
        except ValueError:
            time.sleep(0.3)
    """)
    assert (done.stdout, done.returncode) == ("True True\nTrue -1\n", 0)
