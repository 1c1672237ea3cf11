"""The page of a report: complete by itself, linked in itself, and safe against what it shows."""

from __future__ import annotations

import base64
from html.parser import HTMLParser
from pathlib import Path

import pytest

from exneat_cli.analysis.catalogue import Built
from exneat_cli.analysis.index_page import write_index
from exneat_cli.analysis.tables import build_comparison
from exneat_cli.errors import ExneatError
from tests.analysis.fake_studies import finish, finish_all, plan_study, run_of

PNG = b"\x89PNG made up"
VOID = {"meta", "img"}


class Page(HTMLParser):
    """Ids, links, sources of pictures and text of a page; refuses tags that do not close in order."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.ids: list[str] = []
        self.links: list[str] = []
        self.sources: list[str] = []
        self.tags: set[str] = set()
        self.words = ""
        self._open: list[str] = []
        self.feed(path.read_text(encoding="utf-8"))
        self.close()
        assert not self._open

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        if tag not in VOID:
            self._open.append(tag)
        for key, value in attrs:
            found = {"id": self.ids, "href": self.links, "src": self.sources}.get(key)
            if found is not None:
                found.append(str(value))

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.words += data


def a_figure(directory: Path, name: str = "figure-4.1", **changes: str) -> Built:
    directory.mkdir(parents=True, exist_ok=True)
    paths = tuple(directory / f"{name}.{kind}" for kind in ("svg", "png"))
    for path in paths:
        path.write_bytes(PNG if path.suffix == ".png" else b"<svg xmlns='http://www.w3.org/2000/svg'/>")
    return Built(name, changes.get("title", "Learning"), changes.get("caption", "Lines rise."), paths)


def a_table(directory: Path, name: str = "table-5.1") -> Built:
    rows = (("NEAT", "0.300"), ("ExNEAT", ">20"))
    return Built(name, "Both", "Means.", (directory / f"{name}.csv",), ("variant", "ours"), rows)


def a_report(directory: Path) -> Path:
    study = finish_all(plan_study(directory / "runs"))
    report = directory / "report"
    artefacts = [
        a_figure(report, "figure-7.1"),
        a_figure(report, "figure-5.1"),
        a_table(report),
        a_figure(report),
        build_comparison(study, report),
        a_figure(report, "my own"),
    ]
    return write_index(report, {"track": study}, artefacts, {"figure-4.2": "no finished run\n  exneat sweep again"})


def test_the_page_needs_no_network_no_file_and_no_script(tmp_path: Path) -> None:
    path = a_report(tmp_path)
    page = Page(path)
    content = path.read_text()
    assert "http://" not in content
    assert "https://" not in content
    assert all(source.startswith("data:image/png;base64,") for source in page.sources)
    assert len(page.sources) == 4
    assert not page.tags & {"script", "link", "iframe"}
    assert base64.b64decode(page.sources[0].split(",")[1]) == PNG


def test_every_entry_of_the_contents_leads_somewhere_and_ids_are_unique(tmp_path: Path) -> None:
    page = Page(a_report(tmp_path))
    assert [link[1:] for link in page.links if link.startswith("#")] == page.ids
    assert len(set(page.ids)) == len(page.ids)


def test_links_to_files_are_relative_and_lead_to_files(tmp_path: Path) -> None:
    path = a_report(tmp_path)
    (path.parent / "table-5.1.csv").write_text("")
    links = [link for link in Page(path).links if not link.startswith("#")]
    assert len(links) == 11
    for link in links:
        assert (path.parent / link.replace("%20", " ")).exists(), link


def test_chapters_come_in_order_with_tables_before_figures(tmp_path: Path) -> None:
    ids = Page(a_report(tmp_path)).ids
    order = [
        "what-was-run",
        "run-track",
        "chapter-4-figures",
        "figure-4.1",
        "chapter-5-tables-and-figures",
        "table-5.1",
    ]
    order += ["figure-5.1", "chapter-7-figures", "figure-7.1", "comparisons", "comparison-track", "others", "my-own"]
    assert ids == [*order, "missing"]


def test_text_from_files_is_never_taken_for_markup(tmp_path: Path) -> None:
    evil = '<script>"&amp;'
    study = finish_all(
        plan_study(tmp_path / "runs", variants={"neat": evil, "exneat": "E"}, baselines=(), conditions={"calm": evil})
    )
    report = tmp_path / "report"
    artefacts = [
        a_figure(report, title=evil, caption=evil),
        build_comparison(study, report),
        Built("others", evil, evil, (), (evil,), ((evil,),)),
    ]
    path = write_index(report, {"track": study}, artefacts, {evil: f"{evil}\n{evil}"})
    page = Page(path)
    assert "script" not in page.tags
    assert page.words.count(evil) >= 12


def test_the_page_says_what_was_run(tmp_path: Path) -> None:
    study = plan_study(tmp_path / "runs")
    finish(run_of(study, "calm", "neat", 0), (0.1, 0.2), env_steps=1_000_000)
    finish(run_of(study, "calm", "neat", 1), (0.1, 0.2), env_steps=234_567, versions={"exneat": "0.2.0"})
    words = Page(write_index(tmp_path / "report", {"track": study}, [], {})).words
    assert "Small networks learn faster." in words
    assert "Budget quick: 2 of 14 runs finished, 1,234,567 environment steps of training, which took 0:03:01" in words
    assert "No two variants have finished runs" in words
    assert "exneat 0.1.0 and 0.2.0, numpy 2.4.6." in words
    assert "NEAT260 to 2" in words
    assert "random actions020 to 0" in words


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
