"""Output that nobody reads, in processes of their own."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

PROGRAM = Path(sys.executable).parent / "exneat"
PRINTING = """
import contextlib, os, pathlib, sys
from exneat_cli.output import forgiving_output
with forgiving_output() as lost:
    for k in range(3000):
        print("told on standard output \\udcff", k)
        print("told on standard error", k, file=sys.stderr)
    sys.stdout.flush()
    pathlib.Path("data").write_bytes(b"data")
    with contextlib.suppress(OSError):
        os.write(2, b"a library's words")
    pathlib.Path("lost").write_text(str(bool(lost)))
"""


def shell(command: str, place: Path) -> subprocess.CompletedProcess[str]:
    """Run a line of bash; its exit code is that of the first program of a pipe."""
    script = f"{command}; exit ${{PIPESTATUS[0]}}"
    return subprocess.run(["bash", "-c", script], capture_output=True, text=True, cwd=place, check=False)


@pytest.mark.parametrize(
    "where", ["| head -1", "2>&1 | head -1", "> /dev/full", "2> /dev/full", ">&-", "2>&-", "<&- >&- 2>&-"]
)
def test_whoever_does_not_read_ends_nothing(where: str, tmp_path: Path) -> None:
    (tmp_path / "printing.py").write_text(PRINTING)
    done = shell(f"{sys.executable} printing.py {where}", tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "data").read_bytes() == b"data"
    assert (tmp_path / "lost").read_text() == str(where == "> /dev/full")
    assert "Traceback" not in done.stderr


def test_a_terminal_that_goes_away_and_a_pipe_that_does_not_wait_end_nothing(tmp_path: Path) -> None:
    mine, terminal = os.openpty()
    process = subprocess.Popen(
        [sys.executable, "-c", "import sys; sys.stdin.read()\n" + PRINTING],
        stdin=subprocess.PIPE,
        stdout=terminal,
        stderr=terminal,
        cwd=tmp_path,
    )
    os.close(terminal)
    os.close(mine)
    process.communicate(b"")
    assert process.returncode == 0
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    process = subprocess.Popen([sys.executable, "-c", PRINTING], stdout=writing, stderr=writing, cwd=tmp_path)
    os.close(writing)
    with open(reading, "rb") as pipe:
        assert pipe.read().count(b"\n") == 6000
    assert process.wait() == 0


@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_a_line_on_standard_error_is_there_when_a_process_is_killed(unbuffered: str, tmp_path: Path) -> None:
    (tmp_path / "killed.py").write_text(f"{PRINTING}    os.kill(os.getpid(), 9)")
    done = shell(f"PYTHONUNBUFFERED={unbuffered} {sys.executable} killed.py", tmp_path)
    assert done.stderr.count("told on standard error") == 3000


def test_a_training_that_nobody_reads_is_done(tmp_path: Path) -> None:
    train = f"{PROGRAM} train task=track_maze budget=smoke executor=serial output=out"
    assert shell(f"{train} 2>&1 | head -1", tmp_path).returncode == 0
    (manifest,) = tmp_path.glob("out/*/*/manifest.json")
    assert json.loads(manifest.read_text())["status"] == "done"


def test_help_that_is_cut_off_is_no_error_but_a_list_that_is_lost_is_one(tmp_path: Path) -> None:
    done = shell(f"{PROGRAM} train --help | head -1", tmp_path)
    assert (done.returncode, done.stderr, done.stdout.count("\n")) == (0, "", 1)
    done = shell(f"{PROGRAM} --help > /dev/full", tmp_path)
    expected = "exneat: standard output could not be written: No space left on device\n"
    assert (done.returncode, done.stderr) == (2, expected)
