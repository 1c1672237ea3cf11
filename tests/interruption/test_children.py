"""Ctrl-C where children must not hear it."""

from __future__ import annotations

import subprocess
import sys

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
    print(interrupted.number == signal.SIGINT, child.poll())
    child.kill()
"""


def test_children_do_not_hear_ctrl_c_where_they_must_not_and_their_parent_does() -> None:
    done = subprocess.run(
        [sys.executable, "-c", UNHEARD], capture_output=True, text=True, timeout=50, check=False, start_new_session=True
    )
    assert (done.stdout, done.stderr) == ("True None\n", "")


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
