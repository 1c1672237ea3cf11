"""`exneat inspect` as a list of runs, and the tables that end a multirun."""

from __future__ import annotations

import contextlib
import csv
import io
import subprocess
import sys
from pathlib import Path

import pytest

from exneat_cli.main import main
from tests.commands.figures import without_figures

GRID = ("task=general_maze", "budget=smoke", "algorithm=random", "test_episodes=1")


def table(text: str) -> list[list[str]]:
    """Cells of the lines from the heading on; columns stand two spaces apart."""
    lines = text[text.index("status ") :].splitlines()
    return [[cell.strip() for cell in line.split("  ") if cell.strip()] for line in lines if line]


@pytest.fixture(scope="module")
def multirun(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """A multirun's output root, and what it printed."""
    output, printed = tmp_path_factory.mktemp("multirun"), io.StringIO()
    varied = ("seed=0,1", "noise.sensor_std=0.0,0.2", "task.size=7,9")
    with contextlib.redirect_stdout(printed), without_figures():
        assert main(["train", "-m", *GRID, f"output={output}", *varied]) == 0
    return output, printed.getvalue()


def test_a_multirun_counts_its_runs_and_ends_with_one_table_of_what_differs_best_first(
    multirun: tuple[Path, str],
) -> None:
    output, printed = multirun
    lines = printed.splitlines()
    assert lines[0] == "8 runs, 0 of them already finished"
    assert lines[1] == "[1/8] seed=0 noise.sensor_std=0.0 task.size=7 begins"
    assert lines[2].startswith("[1/8] seed=0 noise.sensor_std=0.0 task.size=7: fitness ")
    assert "1 of 8 done" in lines[2]
    assert sum("begins" in line for line in lines) == sum("in 0." in line or " done" in line for line in lines) == 8
    assert ".json" not in printed
    heading, *rows = table(printed)
    assert heading == ["status", "seed", "test fitness", "size", "sensor_std", "run"]
    assert sorted((row[1], row[3], row[4]) for row in rows) == sorted(
        (seed, size, std) for seed in "01" for size in "79" for std in ("0.0", "0.2")
    )
    fitness = [float(row[2].split()[0]) for row in rows]
    assert fitness == sorted(fitness, reverse=True)
    assert all(Path(row[5]).parent == output / "general_maze" for row in rows)


def test_the_list_is_sorted_by_any_setting_found_at_every_depth_and_written_as_a_table(
    multirun: tuple[Path, str], capsys: pytest.CaptureFixture[str]
) -> None:
    output, _ = multirun
    file = output / "runs.csv"
    for where in (f"output={output}", f"output={output}/general_maze", f"run={output}/general_maze/*"):
        assert main(["inspect", where, "sort=sensor_std", f"csv={file}"]) == 0
        rows = table(capsys.readouterr().out)[1:]
        assert [row[4] for row in rows] == ["0.0"] * 4 + ["0.2"] * 4
        with file.open(encoding="utf-8", newline="") as stream:
            written = list(csv.DictReader(stream))
        assert [(row["seed"], row["task.size"], row["noise.sensor_std"]) for row in written] == [
            (row[1], row[3], row[4]) for row in rows
        ]
        assert all(float(row["test_fitness"]) >= 0.0 for row in written)
    assert main(["inspect", f"output={output}", "sort=sensor_sdt"]) == 2
    assert "did you mean noise.sensor_std?" in capsys.readouterr().err
    assert main(["inspect", f"run={rows[0][-1]}"]) == 2
    assert "a baseline has no networks" in capsys.readouterr().err


def test_listing_runs_imports_neither_simulators_nor_compilers() -> None:
    program = "import sys; from exneat_cli.main import main; main(['inspect', 'output=nowhere']); print(*sys.modules)"
    told = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout
    assert not {"numba", "mujoco", "gymnasium", "neat", "pandas", "matplotlib", "numpy"} & set(told.split())
