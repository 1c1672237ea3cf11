"""Launchers of Hydra's that run jobs elsewhere."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

PROGRAM = Path(sys.executable).parent / "exneat"


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([PROGRAM, *arguments], capture_output=True, text=True, check=False)


def test_submitit_trains_the_same_and_says_why_a_job_failed(tmp_path: Path) -> None:
    pytest.importorskip("hydra_plugins.hydra_submitit_launcher")
    common = ["task=track_maze", "budget=smoke", "executor=serial"]
    assert run("train", *common, f"output={tmp_path / 'here'}").returncode == 0
    elsewhere = ["hydra/launcher=submitit_local", f"hydra.sweep.dir={tmp_path / 'jobs'}"]
    done = run("train", "-m", *elsewhere, *common, f"output={tmp_path / 'there'}", "task.gap=0,-1")
    assert done.returncode == 2
    assert "at least one job of the multirun failed; the first:\n  task.gap: expected" in done.stderr
    assert list((tmp_path / "jobs" / ".submitit").rglob("*_log.out"))
    (here,), (there,) = ((tmp_path / place).glob("*/*/champion.json") for place in ("here", "there"))
    assert here.read_bytes() == there.read_bytes()
