"""Ctrl-C, and the processes of a launcher."""

from __future__ import annotations

import pickle
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from exneat_cli.interruption import Interrupted
from tests.interruption.processes import in_process

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
    print(interrupted.number == signal.SIGINT, child.wait() == -signal.SIGTERM)
"""


def test_children_are_ended_by_their_parent_and_not_by_ctrl_c() -> None:
    done = subprocess.run(
        [sys.executable, "-c", UNHEARD], capture_output=True, text=True, timeout=50, check=False, start_new_session=True
    )
    assert (done.stdout, done.stderr) == ("True True\n", "")


DROPPED_IN = """
import weakref
class Thing:
    pass
thing = Thing()
watched = weakref.ref(thing, lambda _: [os.kill(os.getpid(), signal.SIGINT), time.sleep(1)])
del thing
time.sleep(60)
"""


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


WORKING = """
import pathlib, sys, time
from exneat_cli.interruption import as_worker, finishing
try:
    with as_worker():
        with finishing():
            print("begun", flush=True)
            time.sleep(0.3)
            pathlib.Path(sys.argv[1]).touch()
        time.sleep(60)
finally:
    pathlib.Path(sys.argv[2]).touch()
    try:
        with as_worker():
            pathlib.Path(sys.argv[2]).unlink()
    except KeyboardInterrupt:
        time.sleep(60)
"""


@pytest.mark.parametrize("send", ["os.killpg(0, signal.SIGINT)", "os.kill(os.getpid(), signal.SIGTERM)"])
def test_jobs_of_children_finish_their_writes_and_end_before_anybody_may_kill_them(tmp_path: Path, send: str) -> None:
    done = in_process(f"""
        from exneat_cli.interruption import children, unheard_by_children
        children.JOB_SECONDS = 30.0
        os.setsid()
        files = {[str(tmp_path / name) for name in ("written", "ended")]!r}
        try:
            with unheard_by_children():
                child = subprocess.Popen([sys.executable, "-c", {WORKING!r}, *files], stdout=subprocess.PIPE)
                child.stdout.readline()
                {send}
                time.sleep(60)
        except KeyboardInterrupt:
            print([os.path.exists(file) for file in files])
            child.kill()
    """)
    assert (done.stdout, done.stderr) == ("[True, True]\n", "")


def test_a_job_is_done_though_whoever_started_its_process_is_gone(tmp_path: Path) -> None:
    done = in_process(f"""
        from exneat_cli.interruption import as_worker
        os.environ["EXNEAT_JOBS"] = {str(tmp_path / "gone" / "jobs")!r}
        with as_worker():
            print("done")
    """)
    assert done.stdout == "done\n"


def test_the_interruption_of_a_job_can_travel() -> None:
    assert pickle.loads(pickle.dumps(Interrupted(signal.SIGTERM))).number == signal.SIGTERM
