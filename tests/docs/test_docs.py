"""The texts name everything that there is, and stay as short as they promise."""

from __future__ import annotations

import dataclasses
import re
import runpy
from pathlib import Path
from typing import Any

import matplotlib.image
import numpy as np
import pytest

from exneat_cli.records.champion import Champion, Connection, Node, Scores
from exneat_cli.records.manifest import Manifest, Result, Score
from exneat_cli.records.tables import COLUMNS, RobustnessRow
from exneat_cli.runs import RunSettings
from exneat_cli.tasks import TASKS, AntTask
from exneat_cli.wiring import Module, Pin, Plan

ROOT = Path(__file__).parents[2]
PAGES = [path for path in ROOT.glob("docs/**/*.md") if "_build" not in path.parts]
TEXTS = [
    *PAGES,
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "outputs/README.md", "experiments/README.md")),
]


def text_of(name: str) -> str:
    return (ROOT / name).read_text(encoding="utf-8")


def test_the_readme_fits_on_a_few_screens_and_contributing_on_two() -> None:
    assert len(re.findall(r"\w+", text_of("README.md"))) <= 900
    assert len(text_of("CONTRIBUTING.md").splitlines()) <= 120


def test_the_readmes_python_is_the_example_that_is_tested() -> None:
    (shown,) = re.findall(r"```python\n(.*?)```", text_of("README.md"), flags=re.DOTALL)
    assert text_of("examples/quick_start.py").endswith(f'"""\n\n{shown}')


@pytest.mark.parametrize("path", TEXTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_file_that_a_text_links_to_exists(path: Path) -> None:
    targets = re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", path.read_text(encoding="utf-8"))
    missing = [target for target in targets if "://" not in target and not (path.parent / target).exists()]
    assert not missing


def test_every_group_and_option_is_in_the_manual() -> None:
    groups = text_of("docs/training.md").partition("## Groups")[2].partition("## ")[0]
    rows = {row.split("`")[1]: row for row in groups.splitlines() if row.startswith("| `")}
    missing = [
        f"{option.parent.name}={option.stem}"
        for option in ROOT.glob("conf/*/*.yaml")
        if f"`{option.stem}`" not in rows[option.parent.name]
    ]
    assert not missing


def test_every_plain_key_is_in_the_manual() -> None:
    sections = {"task", "algorithm", "geometry", "linkage", "noise", "evolution", "executor"}
    keys = {field.name.replace("task_kind", "task.kind") for field in dataclasses.fields(RunSettings)} - sections
    training = text_of("docs/training.md")
    assert not [key for key in keys if f"`{key}`" not in training and f"`{key}." not in training]


def test_every_column_and_term_is_in_the_manual() -> None:
    page = text_of("docs/run-directory.md")
    terms = [name for task in TASKS.values() for name in (*task().terms, *task().trace_columns)]
    terms = [re.sub(r"^prey_\d+", "prey_<k>", name) for name in terms]
    assert not [name for name in (*COLUMNS, *RobustnessRow._fields, *terms) if f"`{name}`" not in page]


@pytest.mark.parametrize(
    ("page", "kinds"),
    [
        ("docs/run-directory.md", [Manifest, Result, Score]),
        ("docs/champion.md", [Champion, Scores, Node, Connection, Plan, Module, Pin]),
    ],
)
def test_every_field_of_a_file_is_in_the_manual(page: str, kinds: list[Any]) -> None:
    text = text_of(page)
    names = [
        name
        for kind in kinds
        for name in getattr(kind, "__struct_encode_fields__", None) or [each.name for each in dataclasses.fields(kind)]
    ]
    assert not [name for name in names if f"`{name}`" not in text]


def test_the_tables_of_ant_say_who_senses_and_drives_what() -> None:
    page = text_of("docs/tasks.md")
    legs = {"front_left": 1, "back_left": 2, "back_right": 3, "front_right": 4}
    task = AntTask()
    for part in task.parts:
        leg = legs[part.name]
        first, last = part.sensors[0], part.sensors[-1]
        assert f"| {first}, {first + 1} | angles of hip {leg} and ankle {leg} |" in page
        assert re.search(rf"\| {last - 17}-{last} \| the same for .*leg {leg} \|", page)
        hip, ankle = part.actuators
        driven = ", ".join(task.actuator_names[k].split(" (")[0].replace("_", " ") for k in part.actuators)
        assert f"| {hip}, {ankle} | {driven} |" in page


def test_the_picture_of_the_hexapod_is_drawn_from_what_is_found_in_its_model(tmp_path: Path) -> None:
    kept = ROOT / "docs" / "images" / "hexapod.png"
    runpy.run_path(str(ROOT / "docs" / "draw_robot.py"))["draw"](tmp_path / "hexapod.png")
    drawn, shown = (matplotlib.image.imread(path) for path in (tmp_path / "hexapod.png", kept))
    assert np.abs(drawn - shown).mean() < 0.02, "python docs/draw_robot.py draws it anew"
    assert kept.stat().st_size < 200_000


def test_the_picture_of_the_readme_is_drawn_from_the_wiring_plans(tmp_path: Path) -> None:
    runpy.run_path(str(ROOT / "docs" / "draw_modules.py"))["draw"](tmp_path / "modules.svg")
    assert 0 < (tmp_path / "modules.svg").stat().st_size < 100_000
    assert (ROOT / "docs" / "images" / "modules.svg").stat().st_size < 100_000
