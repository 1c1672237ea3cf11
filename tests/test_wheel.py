"""What an installed wheel can do, away from the repository."""

from __future__ import annotations

import os
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
