"""`exneat report`: every figure and table of the catalogue from smoke runs, and plain words for what is missing."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from exneat_cli.analysis.catalogue import read_catalogue
from exneat_cli.commands.shipped import shipped_directory, shipped_files
from exneat_cli.commands.sweep import Experiment, read_experiment
from exneat_cli.main import main
from tests.analysis.fake_studies import contents
from tests.commands.figures import without_figures

CATALOGUE = read_catalogue(shipped_directory("experiments") / "catalogue.yaml")
IDS = [
    *(f"figure-4.{k}" for k in range(1, 21)),
    *(f"figure-5.{k}" for k in range(1, 8)),
    *(f"figure-7.{k}" for k in range(1, 10)),
    *(f"table-5.{k}" for k in range(1, 6)),
    *("figure-walking", "table-walking"),
]


@pytest.fixture(scope="module")
def outputs(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """All experiments at smoke size, with short episodes on Ant for as long as these tests run."""
    output = tmp_path_factory.mktemp("smoke") / "outputs"
    with pytest.MonkeyPatch.context() as patch:
        for module in ("sweep", "report"):
            patch.setattr(f"exneat_cli.commands.{module}.read_experiment", shortened)
        with without_figures():
            for name in shipped_files("experiments"):
                assert main(["sweep", f"experiment={name}", "budget=smoke", f"output={output}"]) == 0
        yield output


def shortened(name: object) -> Experiment:
    experiment = read_experiment(name)
    if experiment.settings.get("task") != "ant":
        return experiment
    return replace(experiment, settings={**experiment.settings, "task.max_steps": 50})


def report(output: Path, *arguments: str) -> int:
    return main(["report", f"output={output}", *arguments])


def test_the_catalogue_has_every_figure_and_table_of_the_thesis_and_ours() -> None:
    assert sorted(CATALOGUE) == sorted(IDS)


def test_every_id_builds_from_smoke_runs_which_stay_as_they_are(
    outputs: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = contents(outputs)
    assert report(outputs) == 0
    shown = capsys.readouterr()
    made = contents(outputs / "report")
    for name in IDS:
        kinds = ("csv", "md", "tex") if name.startswith("table") else ("png", "svg", "pdf")
        assert {f"{name}.{kind}" for kind in kinds} <= set(made), f"{name}: {shown.err}"
    assert "index.html" in made
    assert "0 not built for lack of runs" in shown.out
    assert {path: data for path, data in contents(outputs).items() if not path.startswith("report")} == before


def test_a_second_report_leaves_the_same_bytes(outputs: Path) -> None:
    assert report(outputs, "experiment=general_maze") == 0
    made = contents(outputs / "report" / "general_maze")
    assert {"index.html", "figure-4.5.svg", "figure-4.6.png", "table-5.2.csv"} <= set(made)
    assert report(outputs, "experiment=general_maze") == 0
    assert contents(outputs / "report" / "general_maze") == made


def test_one_thing_alone_is_built_and_its_axis_can_be_chosen(outputs: Path, tmp_path: Path) -> None:
    copy = tmp_path / "outputs"
    shutil.copytree(outputs / "track_maze-noise_0.05-smoke", copy / "track_maze-noise_0.05-smoke")
    assert report(copy, "only=figure-4.1") == 0
    by_generation = contents(copy / "report")
    assert sorted(by_generation) == ["figure-4.1.pdf", "figure-4.1.png", "figure-4.1.svg"]
    assert report(copy, "only=figure-4.1", "axis=env_steps") == 0
    assert contents(copy / "report")["figure-4.1.svg"] != by_generation["figure-4.1.svg"]
    sheet = tmp_path / "mine.mplstyle"
    sheet.write_text("font.size: 7")
    assert report(copy, "only=figure-4.1", "columns=1", f"style={sheet}") == 0
    assert b"font-size: 7px" in contents(copy / "report")["figure-4.1.svg"]


def test_what_is_missing_is_named_with_the_command_that_makes_it_and_the_rest_is_built(
    outputs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    copy = tmp_path / "outputs"
    for condition in ("noise_0.05", "gap_2", "size_17"):
        shutil.copytree(outputs / f"track_maze-{condition}-smoke", copy / f"track_maze-{condition}-smoke")
    assert report(copy) == 0
    shown = capsys.readouterr()
    assert (copy / "report" / "figure-4.2.svg").exists()
    assert (copy / "report" / "table-5.1.csv").exists()
    assert not (copy / "report" / "figure-7.2.svg").exists()
    assert f"exneat sweep experiment=track_maze budget=smoke output={copy}" in shown.err
    assert "exneat sweep experiment=ant" in shown.err
    assert "exneat sweep experiment=ant" in (copy / "report" / "index.html").read_text()
    assert report(copy, "only=figure-7.2") == 2
    message = capsys.readouterr().err
    assert "no finished run of NEAT" in message
    assert len(message.strip().splitlines()) <= 3


def test_every_condition_and_variant_of_the_catalogue_is_one_of_its_experiment() -> None:
    experiments = {name: read_experiment(name) for name in shipped_files("experiments")}
    for artefact in CATALOGUE.values():
        for part in getattr(artefact, "panels", ()) or getattr(artefact, "rows", ()):
            experiment = experiments[part.experiment]
            assert part.condition in experiment.conditions
            assert part.variant is None or part.variant in experiment.variants
            if getattr(part, "sweep", None):
                assert part.sweep in experiment.conditions[part.condition].sweeps
            assert set(getattr(artefact, "variants", ())) <= set(experiment.variants)
