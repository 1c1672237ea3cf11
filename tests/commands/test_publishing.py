"""Published rows: written as runs finish, and true: a run of the repository's own is done again, to the last digit."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from exneat_cli.commands.command_line import read_command_line
from exneat_cli.commands.shipped import shipped_files
from exneat_cli.commands.sweep import plan_jobs, read_experiment, results_file
from exneat_cli.main import main
from exneat_cli.records import PublishedRun, provenance, published_run, read_published
from exneat_cli.runs import Progress

pytestmark = pytest.mark.usefixtures("no_figures")
SMALL = {
    "claim": "A network beats the rule.",
    "settings": {"task": "track_maze"},
    "variants": {
        "neat": {"label": "NEAT", "settings": {"algorithm": "neat"}},
        "linear_fusion": {"label": "rule", "runs": 1, "settings": {"algorithm": "linear_fusion"}},
    },
    "conditions": {
        "clean": {"label": "clean", "settings": {}},
        "gap": {"label": "gap", "settings": {}, "sweeps": ["gap"]},
    },
    "runs": {"smoke": 2},
}
ANEW = ("wall_seconds", "commit")
"""What differs between equal runs."""


def test_rows_are_published_as_runs_finish_and_tables_come_from_them_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, results = tmp_path / "small.yaml", tmp_path / "results" / "small.csv"
    path.write_text(yaml.safe_dump(SMALL, sort_keys=False))
    sweep = ["sweep", f"experiment={path}", "budget=smoke", f"output={tmp_path / 'out'}"]
    assert main(sweep) == 0
    assert not results.exists()
    assert main([*sweep, "publish=true"]) == 0, "runs that were finished before are published at once"
    rows = read_published(results)
    kinds = [("neat", 0), ("neat", 1), ("linear_fusion", 0)]
    assert [(row.condition, row.variant, row.seed) for row in rows] == [
        (c, *k) for c in ("clean", "gap") for k in kinds
    ]
    assert [len(row.levels) for row in rows] == [0] * 3 + [6] * 3
    before = results.read_bytes()
    results.unlink()
    side_by_side = ["hydra/launcher=joblib", "hydra.launcher.n_jobs=2", "executor=serial"]
    assert main([*sweep[:-1], f"output={tmp_path / 'again'}", "publish=true", *side_by_side]) == 0
    again = read_published(results)
    anew = dict.fromkeys(ANEW)
    assert [row._replace(**anew) for row in again] == [row._replace(**anew) for row in rows]
    champions, same = (sorted((tmp_path / place).rglob("champion.json")) for place in ("out", "again"))
    assert [path.read_bytes() for path in champions] == [path.read_bytes() for path in same]
    assert len(champions) == 4
    results.write_bytes(before)
    capsys.readouterr()
    assert main(["report", f"experiment={path}", "budget=smoke", f"output={tmp_path / 'none'}"]) == 0
    table = (tmp_path / "none" / "report" / "small" / "comparison-small.md").read_text()
    assert "6 of these runs are published rows" in table
    assert main(["report", f"experiment={path}", "budget=smoke", f"output={tmp_path / 'out'}"]) == 0
    own = tmp_path / "out" / "report" / "small" / "comparison-small.csv"
    assert own.read_bytes() == (tmp_path / "none" / "report" / "small" / "comparison-small.csv").read_bytes()


def published_here() -> PublishedRun:
    """A published run of the cheapest experiment that this machine can repeat."""
    for row in read_published(results_file("general_maze")):
        versions = "; ".join(f"{name} {version}" for name, version in provenance.versions().items())
        alike = (row.processor or "").split()[:2] == provenance.processor().split()[:2]
        if row.variant == "exneat" and row.versions == versions and alike:
            return row
    pytest.skip("no published run of general_maze was made with these versions and on this class of processor")


def test_a_published_run_gives_the_same_row_again(tmp_path: Path) -> None:
    row = published_here()
    line = read_command_line("sweep", [f"output={tmp_path}"])
    jobs = plan_jobs(read_experiment("general_maze"), row.budget, line, ("experiment", "publish"))
    job = next(job for job in jobs if job.name == f"{row.condition}/{row.variant}/{row.seed}")
    assert job.settings.full_hash == row.configuration_hash, "settings have changed: publish the experiment again"
    job.do(Progress(), (), go_on=False)
    levels = {(sweep.name, float(level)) for sweep in job.sweeps for level in sweep.levels}
    again = published_run(job.settings.directory, (row.condition, row.variant, row.budget), levels, job.episodes)
    assert again._replace(**dict.fromkeys(ANEW)) == row._replace(**dict.fromkeys(ANEW), processor=again.processor)


@pytest.mark.parametrize("name", shipped_files("experiments"))
def test_published_rows_are_few_bytes_and_no_run_is_there_twice(name: str) -> None:
    path = results_file(name)
    rows = read_published(path)
    assert len({row.place for row in rows}) == len(rows)
    assert not path.exists() or path.stat().st_size < 700_000
