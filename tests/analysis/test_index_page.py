"""The page of a report: complete by itself, linked in itself, and safe against what it shows."""

from __future__ import annotations

import base64
from html.parser import HTMLParser
from pathlib import Path

import pytest

from exneat_cli.analysis.catalogue import Built
from exneat_cli.analysis.curve_values import Strip
from exneat_cli.analysis.index_page import write_index
from exneat_cli.analysis.tables import build_comparison
from exneat_cli.errors import ExneatError
from tests.analysis.fake_studies import a_study, finish, finish_all, plan_study, run_of

PNG = b"\x89PNG made up"


class Page(HTMLParser):
    """What a page holds: tags, values of attributes by their key, and text; refuses tags that do not close in order."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.values: dict[str, list[str]] = {"id": [], "href": [], "src": []}
        self.words = ""
        self._open: list[str] = []
        self.feed(path.read_text(encoding="utf-8"))
        self.close()
        assert not self._open

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        if tag not in ("meta", "img", "input"):
            self._open.append(tag)
        for key, value in attrs:
            self.values.setdefault(key, []).append(str(value))

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self._open[-1:] != ["script"]:
            self.words += data


def a_figure(directory: Path, name: str, title: str = "Learning") -> Built:
    directory.mkdir(parents=True, exist_ok=True)
    paths = tuple(directory / f"{name}.{kind}" for kind in ("svg", "png"))
    for path in paths:
        path.write_bytes(PNG if path.suffix == ".png" else b"<svg xmlns='http://www.w3.org/2000/svg'/>")
    return Built(name, title, title, paths)


def a_report(directory: Path) -> Path:
    study = a_study(directory / "runs")
    report = directory / "report"
    artefacts = [a_figure(report, name) for name in ("figure-7.1", "figure-5.1", "figure-4.1", "my own")]
    artefacts.append(Built("table-5.1", "Both", "Means.", artefacts[0].paths[:1], ("variant",), (("NEAT",),)))
    artefacts.append(build_comparison(study, report))
    return write_index(report, {"track": study}, artefacts, {"figure-4.2": "no finished run\n  exneat sweep again"})


def test_the_page_needs_no_network_no_other_script_and_no_picture_beside_it_and_links_to_files_by_relative_paths(
    tmp_path: Path,
) -> None:
    path = a_report(tmp_path)
    page = Page(path)
    assert "http" not in path.read_text()
    assert not {"link", "iframe"} & set(page.tags)
    assert page.tags.count("script") == 1
    assert page.values["src"] == ["data:image/png;base64," + base64.b64encode(PNG).decode()] * 4
    links = [link for link in page.values["href"] if not link.startswith("#")]
    assert all((path.parent / link.replace("%20", " ")).exists() for link in links)
    runs = [link for link in links if link.endswith("/")]
    assert (len(runs), len(links) - len(runs)) == (14, 2 * 4 + 1 + 3)


def test_chapters_come_in_order_with_tables_before_figures_and_the_contents_lead_to_each(tmp_path: Path) -> None:
    page = Page(a_report(tmp_path))
    chapters = ["chapter-4-figures", "figure-4.1", "chapter-5-tables-and-figures", "table-5.1", "figure-5.1"]
    others = [
        "chapter-7-figures",
        "figure-7.1",
        "comparisons",
        "comparison-track",
        "other-tables-and-figures",
        "my-own",
        "missing",
    ]
    assert page.values["id"] == ["filter", "what-was-run", "run-track", *chapters, *others]
    assert [link[1:] for link in page.values["href"] if link.startswith("#")] == page.values["id"][1:]


def test_text_from_files_is_never_taken_for_markup(tmp_path: Path) -> None:
    evil = '<script>"&amp;'
    study = a_study(tmp_path / "runs", variants={"neat": evil, "exneat": "E"}, baselines=(), conditions={"calm": evil})
    report = tmp_path / "report"
    table = Built("others", evil, evil, (), (evil,), ((evil,),))
    figure = a_figure(report, "figure-4.1", evil)._replace(strips=(Strip(10.0, 20.0, 2.504, 60.0, f"{evil}\n0.5"),))
    page = Page(
        write_index(
            report, {"track": study}, [figure, build_comparison(study, report), table], {evil: f"{evil}\n{evil}"}
        )
    )
    assert page.values["title"] == [f"{evil}\n0.5"]
    assert page.values["style"] == ["left:10.00%;top:20.00%;width:2.50%;height:60.00%"]
    assert page.tags.count("script") == 1  # ours
    assert page.words.count(evil) >= 12


def test_the_page_says_what_was_run(tmp_path: Path) -> None:
    study = plan_study(tmp_path / "runs")
    finish(run_of(study, "calm", "neat", 0), (0.1, 0.2), env_steps=1_000_000)
    finish(run_of(study, "calm", "neat", 1), (0.1, 0.2), env_steps=234_567, version="0.2.0")
    for seed, finished in enumerate(("2026-03-04T05:06:07+00:00", "2026-01-02T03:04:05+00:00")):
        run_of(study, "calm", "neat", seed).directory.update_manifest(finished=finished)
    words = Page(write_index(tmp_path / "report", {"track": study}, [], {})).words
    assert "track: exneat report" in words
    assert "Includes runs that finished by 2026-03-04 05:06 UTC." in words
    assert "Small networks learn faster." in words
    assert "2 of 14 runs are finished; their training took 1,234,567 environment steps and 0:03:01 (h:mm:ss)" in words
    assert "No two variants have finished runs" in words
    assert "exneat 0.1.0 and 0.2.0, numpy 2.4.6." in words
    assert "NEAT260 to 2" in words
    assert "random actions020" in words


def test_a_figure_is_named_once(tmp_path: Path) -> None:
    figure = a_figure(tmp_path, "figure-4.1", "Learning")._replace(caption="Learning. Lines: means.")
    words = Page(write_index(tmp_path, {}, [figure], {})).words
    assert words.count("Learning") == 2, "once in the contents, once above it"
    assert "Lines: means." in words


def test_of_each_variant_in_each_condition_the_film_of_its_best_run_is_shown_and_no_other(tmp_path: Path) -> None:
    study = a_study(tmp_path / "runs")
    filmed = [run for run in study.finished if run.variant == "neat"]
    for run in filmed:
        run.directory.plots.mkdir(exist_ok=True)
        (run.directory.plots / "champion.mp4").write_bytes(b"made up")
    page = Page(write_index(tmp_path / "report", {"ant": study}, [], {}))
    best = set()
    for condition in study.conditions:
        rivals = [run for run in filmed if run.condition == condition]
        assert len(rivals) > 1
        best.add(max(rivals, key=lambda run: study.finished[run].result.validation).directory.plots)  # type: ignore[union-attr]
    shown = [(tmp_path / "report" / source).resolve() for source in page.values["src"] if source.endswith(".mp4")]
    assert set(shown) == {plots / "champion.mp4" for plots in best}
    assert len(shown) == len(best)


def test_what_is_missing_stands_there_with_the_command_that_makes_it(tmp_path: Path) -> None:
    words = Page(a_report(tmp_path)).words
    assert "figure-4.2: no finished run" in words
    assert "exneat sweep again" in words
    assert "runs are not finished" not in words
    unfinished = plan_study(tmp_path / "none")
    words = Page(write_index(tmp_path / "empty", {"track": unfinished}, [], {})).words
    assert "14 of 14 runs are not finished" in words
    assert "exneat sweep experiment=track budget=quick" in words
    words = Page(write_index(tmp_path / "whole", {"track": finish_all(unfinished)}, [], {})).words
    assert words.rstrip().endswith("What is missing\nNothing.")


def test_the_same_data_gives_the_same_bytes(tmp_path: Path) -> None:
    assert a_report(tmp_path / "one").read_bytes() == a_report(tmp_path / "other").read_bytes()


def test_a_picture_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    gone = Built("figure-4.1", "Learning", "Lines.", (tmp_path / "figure-4.1.png",))
    with pytest.raises(ExneatError, match=r"figure-4.1.png: could not be read"):
        write_index(tmp_path, {}, [gone], {})
