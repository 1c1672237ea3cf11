"""`exneat completion`: what may come next, and the same in a real shell."""

from __future__ import annotations

import os
import pty
import select
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from exneat_cli.commands.command_line import read_command_line
from exneat_cli.commands.completion import SHELLS
from exneat_cli.main import COMMANDS, main


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A current directory with two runs, and folders without any."""
    for run in ("my runs/ant/neat-s0-abc", "my runs/ant/neat-s1-abc", "other/x/y/z"):
        (tmp_path / run).mkdir(parents=True)
    for manifest in ("my runs/ant/neat-s0-abc", "my runs/ant/neat-s1-abc"):
        (tmp_path / manifest / "manifest.json").touch()
    noise = tmp_path / "mine" / "noise"
    noise.mkdir(parents=True)
    (noise / "stormy.yaml").write_text("noise: {gusts: 3}\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path


CASES = {
    "exneat wa": ["watch"],
    "exneat train geom": ["geometry=", "geometry.vector="],
    "exneat train task=h": ["task=hunting"],
    "exneat train task=hunting task.p_": ["task.p_e=", "task.p_c=", "task.p_m="],
    "exneat train recipe=th": ["recipe=thesis"],
    "exneat train -m noise=clean,s": ["noise=clean,sensor"],
    "exneat train sweep=[gap,ma": ["sweep=[gap,map_size", "sweep=[gap,maze_size"],
    "exneat train resume=": ["resume=true", "resume=false"],
    "exneat train --config-dir mine noise=s": ["noise=sensor", "noise=stormy"],
    "exneat train --mul": ["--multirun"],
    "exneat train --config-dir ot": ["other/"],
    "exneat evaluate run=": ["run=my runs/"],
    "exneat watch 'run=my runs/ant/neat-s0": ["run=my runs/ant/neat-s0-abc"],
    r"exneat export run=my\ runs/a": ["run=my runs/ant/"],
    "exneat train output=o": ["output=other/"],
    "exneat sweep experiment=track": ["experiment=track_maze"],
    "exneat report only=table-5.": [f"only=table-5.{k}" for k in range(1, 6)],
    "exneat inspect sor": ["sort="],
    "exneat report publi": [],
    "exneat completion f": ["fish"],
    "exneat nonsense ": [],
}


@pytest.mark.parametrize("line", CASES)
def test_what_may_come_next_is_offered(line: str, place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["completion", "bash", line]) == 0
    assert sorted(capsys.readouterr().out.splitlines()) == sorted(CASES[line])


@pytest.mark.parametrize("command", [name for name in COMMANDS if name != "completion"])
def test_every_setting_that_a_command_composes_is_offered(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["completion", "zsh", "exneat", command, ""]) == 0
    offered = {word.partition("=")[0].partition(".")[0] for word in capsys.readouterr().out.splitlines()}
    with read_command_line(command, []).composed() as config:
        composed = {str(key) for key in config} - {"hydra", "budgets"}
    assert composed <= offered


def test_an_answer_waits_for_no_large_library() -> None:
    code = "import sys; from exneat_cli.main import program; program(); print(*sys.modules)"
    words = [sys.executable, "-c", code, "completion", "fish", "exneat", "train", "task="]
    answer = subprocess.run(words, capture_output=True, text=True, check=True).stdout
    assert "task=ant" in answer
    assert not {"hydra", "omegaconf", "numpy", "numba", "matplotlib", "mujoco"} & set(answer.split())


def test_a_real_bash_completes_what_is_typed(place: Path) -> None:
    bash = shutil.which("bash")
    if bash is None:
        pytest.skip("there is no bash")
    (place / "rc").write_text(
        f"""PS1='ready '; export PYTHONPATH={os.pathsep.join(filter(None, sys.path))!r}
exneat() {{
    if [[ $1 == completion ]]; then {sys.executable} -m exneat_cli "$@"; else printf '<%s>' "$@"; echo done; fi
}}
eval "$(exneat completion bash)"
"""
    )
    child, terminal = pty.fork()
    if child == 0:
        os.execv(bash, [bash, "--rcfile", "rc", "--noprofile", "-i"])

    def heard(until: bytes) -> bytes:
        said = b""
        while until not in said:
            assert select.select([terminal], [], [], 120)[0], said
            said += os.read(terminal, 4096)
        return said

    heard(b"ready ")
    os.write(terminal, b"exneat tra\ttask=hunt\ttask.p_m\t0.5\n")
    assert b"<train><task=hunting><task.p_m=0.5>" in heard(b"done")
    os.write(terminal, b"exneat insp\trun=m\tan\tneat-s1\t\n")
    assert b"<inspect><run=my runs/ant/neat-s1-abc>" in heard(b"done")
    os.write(terminal, b"exit\n")
    os.waitpid(child, 0)
    os.close(terminal)


@pytest.mark.parametrize("shell", SHELLS)
def test_each_shell_can_read_its_script(shell: str, capsys: pytest.CaptureFixture[str]) -> None:
    if shutil.which(shell) is None:
        pytest.skip(f"there is no {shell}")
    assert main(["completion", shell]) == 0
    read = subprocess.run([shell, "-n"], input=capsys.readouterr().out, text=True, capture_output=True)
    assert (read.returncode, read.stderr) == (0, "")


def test_another_shell_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["completion", "tcsh"]) == 2
    assert "completion: expected one of bash, zsh, fish, got 'tcsh'" in capsys.readouterr().err
