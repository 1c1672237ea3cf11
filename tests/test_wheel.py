"""What an installed wheel can do, away from the repository."""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def unpacked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel's contents in a directory of their own."""
    directory = tmp_path_factory.mktemp("wheel")
    subprocess.run(
        [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(directory), str(ROOT)],
        check=True,
        capture_output=True,
    )
    (wheel,) = directory.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(directory / "site")
    return directory / "site"


def test_the_wheel_carries_conf_and_no_tests(unpacked: Path) -> None:
    packaged = {str(path.relative_to(unpacked / "exneat_cli" / "conf")) for path in unpacked.rglob("conf/**/*.yaml")}
    assert packaged == {str(path.relative_to(ROOT / "conf")) for path in (ROOT / "conf").rglob("*.yaml")}
    assert not (unpacked / "tests").exists()


def test_the_wheel_asks_for_every_library_that_it_imports(unpacked: Path) -> None:
    (metadata,) = unpacked.glob("*.dist-info/METADATA")
    required = {
        re.match(r"Requires-Dist: ([A-Za-z0-9_-]+)", line)[1]  # type: ignore[index]
        for line in metadata.read_text().splitlines()
        if line.startswith("Requires-Dist:") and "extra ==" not in line
    }
    imported = {
        name.split(".")[0]
        for path in (unpacked / "exneat_cli").rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text()))
        for name in (
            [alias.name for alias in node.names]
            if isinstance(node, ast.Import)
            else [str(node.module)]
            if isinstance(node, ast.ImportFrom)
            else []
        )
    }
    distributions = {"hydra": "hydra-core", "neat": "neat-python", "yaml": "pyyaml", "PIL": "pillow"}
    libraries = {distributions.get(name, name) for name in imported - set(sys.stdlib_module_names) - {"exneat_cli"}}
    of_extras = {
        "dask",
        "distributed",
        "mujoco_warp",
        "onnx",
        "imageio_ffmpeg",
        "mlflow",
        "optuna",
        "tensorboard",
        "wandb",
        "warp",
    }  # imported after a check that they are there
    assert libraries - of_extras == required


def test_the_wheel_installs_the_program(unpacked: Path) -> None:
    (entry_points,) = unpacked.glob("*.dist-info/entry_points.txt")
    assert "exneat = exneat_cli.main:program" in entry_points.read_text()


def test_the_wheel_trains_away_from_the_repository(unpacked: Path, tmp_path: Path) -> None:
    code = (
        "import exneat_cli, sys\n"
        f"assert exneat_cli.__file__.startswith({str(unpacked)!r}), exneat_cli.__file__\n"
        "from exneat_cli.main import main\n"
        "sys.exit(main(['train', 'budget=smoke', 'geometry=fb', 'task.max_steps=50']))"
    )
    environment = {**os.environ, "PYTHONPATH": str(unpacked)}
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    (run,) = (tmp_path / "outputs" / "ant").iterdir()
    assert (run / "plots" / "training.png").exists()
    assert [path.name for path in tmp_path.iterdir()] == ["outputs"]
