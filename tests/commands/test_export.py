"""`exneat export`: files beside the run or where the user wants them, and refusals that leave nothing."""

from __future__ import annotations

import json
import runpy
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from exneat_cli.main import main
from exneat_cli.records.exports import FORMATS
from tests.commands.figures import without_figures
from tests.commands.refusals import check_refusal

OF_EXTRAS = {
    *("dask", "distributed", "imageio_ffmpeg", "mlflow", "mujoco_warp", "nbformat", "onnx", "onnxruntime", "optuna"),
    *("tensorboard", "wandb", "warp"),
}
"""Libraries that a few settings and commands need."""
TRAIN = ["train", "task=track_maze", "budget=smoke"]


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    output = tmp_path_factory.mktemp("outputs")
    with without_figures():
        for settings in (["algorithm=neat"], ["geometry=all", "linkage=output"], ["algorithm=random"]):
            assert main([*TRAIN, *settings, f"output={output}"]) == 0
    return output / "track_maze"


def run_of(runs: Path, variant: str) -> Path:
    (found,) = runs.glob(f"{variant}-s*")
    return found


@pytest.mark.parametrize("form", FORMATS)
def test_a_champion_is_written_into_its_run_and_said_where(
    form: str, runs: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    if form == "onnx":
        pytest.importorskip("onnx", reason="pip install 'exneat[onnx]'")
    run = run_of(runs, "neat")
    assert main(["export", f"run={run}", f"format={form}"]) == 0
    place = run / "export" / FORMATS[form]
    said = {line.removeprefix("Written: ") for line in capsys.readouterr().out.splitlines()}
    assert said == {str(path) for path in (place.iterdir() if place.is_dir() else [place])}


def test_champions_of_a_pattern_keep_their_own_files_and_one_goes_where_the_user_wants(
    runs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    assert main(["export", f"run={runs}/*neat-*"]) == 0
    assert len(list(runs.glob("*/export/champion.py"))) == 2
    path = tmp_path / "new" / "agent.py"
    assert main(["export", f"run={run_of(runs, 'neat')}", "output='~/new/agent.py'"]) == 0
    champion = runpy.run_path(str(path))["Champion"]()
    assert champion.act(np.full(8, 0.5)).shape == (5,)
    assert [each.name for each in path.parent.iterdir()] == ["agent.py"]


BAD = {
    "format=pickle": "format: expected one of python, onnx, neat, dot, got 'pickle'",
    "format=[a]": "format: expected one of python, onnx, neat, dot",
    "output=''": "output: expected a file",
    "seed=1": "seed: unknown key",
    "task.size=5": "task.size: unknown key",
    "output=/proc/self/no/champion.py": "/proc/self/no",
}


@pytest.mark.parametrize("given", BAD)
def test_what_makes_no_sense_is_refused(given: str, runs: Path, capfd: pytest.CaptureFixture[str]) -> None:
    check_refusal(["export", f"run={run_of(runs, 'neat')}", given], [BAD[given]], runs, capfd)


def test_runs_without_a_champion_or_with_one_that_does_not_fit_are_refused(
    runs: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    linked = run_of(runs, "exneat-all-output")
    old, unlike = tmp_path / "old" / linked.name, tmp_path / "unlike" / linked.name
    for copy, change in ((old, {"format": 2}), (unlike, {"variant": "neat"})):
        shutil.copytree(linked, copy)
        content = json.loads((copy / "champion.json").read_text())
        (copy / "champion.json").write_text(json.dumps(content | change))
    for arguments, named in {
        "": "run: expected a run directory, or a pattern",
        f"run={tmp_path}/none": "there is no such run",
        f"run={tmp_path}/none*": "run: expected a run directory, or a pattern that matches some",
        f"run={run_of(runs, 'random')}": "has no champion: random is a baseline",
        f"run={linked} format=neat": f"{linked}: format=neat: expected modules that do not read each other",
        f"run={old}": "champion.json: expected format 3, got 2: another version of exneat wrote it",
        f"run={unlike}": "expected a champion of exneat-all-output, got neat",
        f"run={runs}/*neat-* output=one.py": "output: expected null for several runs",
    }.items():
        check_refusal(["export", *arguments.split()], [named], tmp_path, capfd)


def test_one_champion_that_does_not_fit_keeps_those_of_a_pattern_from_being_written(
    runs: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    for number, variant in enumerate(("neat", "exneat-all-output")):
        shutil.copytree(run_of(runs, variant), tmp_path / "runs" / f"{number}", ignore=lambda *_: ["export"])
    named = [f"{tmp_path}/runs/1: format=neat: expected modules"]
    check_refusal(["export", f"run={tmp_path}/runs/*", "format=neat"], named, tmp_path, capfd)


def test_without_onnx_the_command_says_how_to_install_it(
    runs: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "onnx", None)
    named = ["format=onnx: expected onnx", "pip install 'exneat[onnx]'"]
    check_refusal(["export", f"run={run_of(runs, 'neat')}", "format=onnx"], named, runs, capfd)


def test_training_and_exporting_python_load_no_library_of_an_extra(tmp_path: Path) -> None:
    code = (
        "import sys, exneat_cli\n"
        "from exneat_cli.main import main\n"
        f"assert main([*{TRAIN}, 'output={tmp_path}']) == 0\n"
        f"assert main(['export', 'run={tmp_path}/track_maze/*']) == 0\n"
        f"assert not {OF_EXTRAS} & set(sys.modules), {OF_EXTRAS} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, cwd=tmp_path)
