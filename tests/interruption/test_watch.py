"""A process that does not end by itself is ended, with all that it started."""

from __future__ import annotations

import textwrap
from pathlib import Path

import pytest

from tests.interruption.processes import in_process, is_running


def end_with_child(note: Path, code: str) -> tuple[int, bool]:
    """Exit code of a process that starts a child and then runs this code, and whether the child outlived it."""
    child = f"child = subprocess.Popen(['sleep', '600'])\nopen({str(note)!r}, 'w').write(str(child.pid))\n"
    done = in_process(child + textwrap.dedent(code))
    return done.returncode, is_running(int(note.read_text()))


def test_a_process_that_swallows_the_signal_is_ended_with_its_children(tmp_path: Path) -> None:
    code, child_is_running = end_with_child(
        tmp_path / "child",
        """
        try:
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(600)
        except KeyboardInterrupt:
            time.sleep(600)
    """,
    )
    assert (code, child_is_running) == (143, False)


SWALLOWED = """
import os, signal, time
from exneat_cli import interruption
from exneat_cli.interruption import watch

watch.PATIENCE = 0.2
interruption.listen()
try:
    os.kill(os.getpid(), signal.SIGINT)
    time.sleep(60)
except BaseException:
    pass
time.sleep(60)
"""


def test_a_process_that_swallows_the_exception_is_ended_with_the_line_that_says_how_to_go_on() -> None:
    done = in_process(SWALLOWED)
    assert done.returncode == 130
    assert done.stderr.startswith("exneat: interrupted; the same command goes on")


def test_a_second_signal_ends_children_too_though_the_main_thread_ends_by_itself(tmp_path: Path) -> None:
    code, child_is_running = end_with_child(
        tmp_path / "child",
        """
        try:
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(60)
        finally:
            time.sleep(0.3)
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(60)
    """,
    )
    assert (code, child_is_running) == (143, False)


IN_COMPILED_CODE = """
import hashlib, os, signal, threading
from exneat_cli import interruption
from exneat_cli.interruption import watch

watch.PATIENCE = {patience}
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


def test_a_watch_that_was_called_off_lets_the_process_live() -> None:
    done = in_process("""
        from exneat_cli.interruption import watch
        watch.PATIENCE = 0.1
        for _ in range(3):
            try:
                os.kill(os.getpid(), signal.SIGTERM)
                time.sleep(60)
            except KeyboardInterrupt:
                listen()
        time.sleep(0.3)
    """)
    assert (done.returncode, done.stderr) == (0, "")


LAST_ACTS = """
import hashlib, os, signal, threading
from exneat_cli.interruption import before_the_end, listen, watch

def fail():
    raise ValueError

watch.PATIENCE = 0.2
listen()
with before_the_end(lambda: print("marked", flush=True)), before_the_end(fail):
    with before_the_end(lambda: print("over", flush=True)):
        pass
    threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGTERM)).start()
    hashlib.pbkdf2_hmac("sha256", b"", b"", 2**31 - 1)
"""


def test_what_is_to_be_done_before_the_end_is_done_where_the_main_thread_does_not_hear() -> None:
    done = in_process(LAST_ACTS)
    assert (done.stdout, done.returncode) == ("marked\n", 143)
