"""Launchers of Hydra's that run jobs elsewhere."""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from exneat_cli.main import main

PROGRAM = Path(sys.executable).parent / "exneat"


SLURM = {
    "sbatch": r"""
        tasks=$(sed -n 's/^#SBATCH --array=0-\([0-9]*\).*/\1/p' "$1")
        for task in $(seq 0 "$tasks"); do
            SLURM_JOB_ID=7$task SLURM_ARRAY_JOB_ID=7 SLURM_ARRAY_TASK_ID=$task SLURM_NTASKS=1 SLURM_JOB_NUM_NODES=1 \
            SLURM_JOB_NODELIST=here SLURM_NODEID=0 SLURM_PROCID=0 SLURM_LOCALID=0 bash "$1" >/dev/null 2>&1 &
        done
        cp "$1" "$(dirname "$0")/submitted"
        echo "Submitted batch job 7"
    """,
    "srun": """
        while [ "${1#--}" != "$1" ]; do
            case "$1" in --output|--error) shift 2 ;; *) shift ;; esac
        done
        exec "$@"
    """,
    "sacct": """
        printf 'JobID|State|NodeList\\n7_0|RUNNING|here\\n7_1|RUNNING|here\\n'
    """,
}
"""Stand-ins for Slurm's commands: they run the batch script on this machine, as many times as its array asks for."""


def run(*arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [PROGRAM, *arguments], capture_output=True, text=True, check=False, env={**os.environ, **environment}
    )


def test_workers_that_joblib_kept_write_where_the_next_launch_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("hydra_plugins.hydra_joblib_launcher")
    train = ["train", "-m", "hydra/launcher=joblib", "task=track_maze", "algorithm=motionless", "budget=smoke"]
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        monkeypatch.chdir(tmp_path / name)
        assert main([*train, "output=out"]) == 0
        assert (tmp_path / name / "out").is_dir()


def test_submitit_trains_the_same_and_says_why_a_job_failed(tmp_path: Path) -> None:
    pytest.importorskip("hydra_plugins.hydra_submitit_launcher")
    common = ["task=track_maze", "budget=smoke", "executor=serial"]
    assert run("train", *common, f"output={tmp_path / 'here'}").returncode == 0
    elsewhere = ["hydra/launcher=submitit_local", f"hydra.sweep.dir={tmp_path / 'jobs'}"]
    done = run("train", "-m", *elsewhere, *common, f"output={tmp_path / 'there'}", "task.gap=0,-1")
    assert done.returncode == 2
    assert "at least one job of the multirun failed; the first reason:\n  task.gap: expected" in done.stderr
    assert list((tmp_path / "jobs" / ".submitit").rglob("*_log.out"))
    (here,), (there,) = ((tmp_path / place).glob("*/*/champion.json") for place in ("here", "there"))
    assert here.read_bytes() == there.read_bytes()


def test_slurm_is_asked_for_what_was_set_and_its_jobs_train_the_same(tmp_path: Path) -> None:
    pytest.importorskip("hydra_plugins.hydra_submitit_launcher")
    commands = tmp_path / "bin"
    commands.mkdir()
    for name, script in SLURM.items():
        (commands / name).write_text(f"#!/bin/bash\n{textwrap.dedent(script)}")
        (commands / name).chmod(0o755)
    common = ["train", "-m", "task=track_maze", "budget=smoke", "executor=serial", "seed=0,1"]
    assert run(*common, f"output={tmp_path / 'here'}").returncode == 0
    slurm = ["hydra/launcher=submitit_slurm", "hydra.launcher.partition=long", "hydra.launcher.timeout_min=240"]
    place = [f"hydra.sweep.dir={tmp_path / 'jobs'}", f"output={tmp_path / 'there'}"]
    done = run(*common, *slurm, *place, PATH=f"{commands}:{os.environ['PATH']}")
    told = [line for line in done.stderr.splitlines() if "2 runs done, still running" not in line]  # every 30 s
    assert (done.returncode, told) == (0, [])
    submitted = (commands / "submitted").read_text()
    assert "#SBATCH --partition=long" in submitted
    assert "#SBATCH --time=240" in submitted
    here, there = (sorted((tmp_path / place).glob("*/*/champion.json")) for place in ("here", "there"))
    assert [path.read_bytes() for path in here] == [path.read_bytes() for path in there]
    assert len(there) == 2
