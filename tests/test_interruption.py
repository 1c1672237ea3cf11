"""Signals that come up where Python drops exceptions are not lost."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import exneat_cli

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


def run(program: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": str(Path(exneat_cli.__file__).parents[1])}
    return subprocess.run(
        [sys.executable, "-c", program], env=environment, capture_output=True, text=True, timeout=50, check=False
    )


def test_a_signal_in_the_callback_of_a_weak_reference_is_heard_after_it() -> None:
    done = run(DROPPED)
    assert (done.stdout, done.stderr) == ("heard True\n", "")


def test_a_process_that_swallows_the_exception_is_ended_with_the_line_that_says_how_to_go_on() -> None:
    done = run(SWALLOWED)
    assert done.returncode == 130
    assert done.stderr.startswith("exneat: interrupted; the same command goes on")
