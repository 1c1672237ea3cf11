"""The layers and fences of the package, read off the imports."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

import exneat_cli

PACKAGE = Path(exneat_cli.__file__).parent
ROOMS = ["tasks", "wiring", "algorithms", "brains", "rollouts", "records", "runs", "analysis", "commands", "main"]
FREE = {"compiling", "errors", "interruption", "output", "seeding"}
FENCES = {
    "hydra": {"main", "commands"},
    "omegaconf": {"main", "commands"},
    "gymnasium": {"tasks"},
    "mujoco": {"tasks"},
    "mujoco_warp": {"tasks"},
    "warp": {"tasks", "brains", "rollouts"},
    "neat": {"algorithms", "brains"},
    "cmaes": {"algorithms"},
    "matplotlib": {"analysis"},
    "jinja2": {"analysis"},
    "PIL": {"analysis"},
    "dask": {"rollouts"},
    "distributed": {"rollouts"},
}
IN_ONE_FILE = ("imageio_ffmpeg", "onnx", "tensorboard", "wandb", "mlflow", "optuna")


def imports_of(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: expected absolute imports"
            yield str(node.module)
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def modules() -> list[tuple[str, Path]]:
    found = []
    for path in sorted(PACKAGE.rglob("*.py")):
        room = path.relative_to(PACKAGE).with_suffix("").parts[0]
        if room not in ("__init__", "__main__", *FREE):
            found.append((room, path))
    return found


def test_no_files_need_each_other() -> None:
    paths = [path for path in sorted(PACKAGE.rglob("*.py")) if path.stem != "__init__"]
    names = {".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts): path for path in paths}
    TopologicalSorter({name: names.keys() & set(imports_of(path)) for name, path in names.items()}).prepare()


def test_every_file_stands_in_a_room() -> None:
    strangers = {room for room, _ in modules()} - set(ROOMS)
    assert not strangers


def test_imports_never_climb_to_a_later_room() -> None:
    wrong = []
    for room, path in modules():
        for name in imports_of(path):
            parts = name.split(".")
            if parts[0] != "exneat_cli" or len(parts) == 1:
                continue
            target = parts[1]
            if target in ROOMS and ROOMS.index(target) > ROOMS.index(room):
                wrong.append(f"{path.relative_to(PACKAGE)} imports {name}")
    assert not wrong


def test_runs_and_analysis_do_not_know_each_other() -> None:
    wrong = [
        f"{path.relative_to(PACKAGE)} imports {name}"
        for room, path in modules()
        if room in ("analysis", "runs")
        for name in imports_of(path)
        if name.startswith("exneat_cli.runs" if room == "analysis" else "exneat_cli.analysis")
    ]
    assert not wrong


def test_analysis_never_touches_genomes_or_simulators() -> None:
    forbidden = tuple(f"exneat_cli.{room}" for room in ("tasks", "algorithms", "brains", "rollouts"))
    wrong = [name for room, path in modules() if room == "analysis" for name in imports_of(path)]
    assert not [name for name in wrong if name.startswith(forbidden)]


def test_what_every_room_may_import_imports_no_room() -> None:
    for name in FREE:
        assert not [i for i in imports_of(PACKAGE / f"{name}.py") if i.startswith("exneat_cli")], name


def test_libraries_stay_behind_their_fences() -> None:
    wrong = []
    for room, path in modules():
        for name in imports_of(path):
            library = name.split(".")[0]
            if room not in FENCES.get(library, {room}):
                wrong.append(f"{path.relative_to(PACKAGE)} imports {library}")
    assert not wrong


@pytest.mark.parametrize("library", IN_ONE_FILE)
def test_a_library_that_one_file_wraps_is_imported_there_alone(library: str) -> None:
    users = {path for _, path in modules() for name in imports_of(path) if name.split(".")[0] == library}
    assert len(users) <= 1


def public_definitions(body: list[ast.stmt]) -> Iterator[ast.FunctionDef | ast.ClassDef]:
    for node in body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_"):
            yield node
            if isinstance(node, ast.ClassDef):
                yield from public_definitions(node.body)


def test_every_public_definition_has_a_docstring() -> None:
    bare = [
        f"{path.relative_to(PACKAGE)}: {node.name}"
        for path in sorted(PACKAGE.rglob("*.py"))
        for node in public_definitions(ast.parse(path.read_text(encoding="utf-8")).body)
        if not ast.get_docstring(node)
    ]
    assert not bare
