"""The notebook runs from top to bottom, and shows a figure where it says that there is one."""

from __future__ import annotations

import ast
import contextlib
import io
import json
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from PIL import Image

NOTEBOOK = Path(__file__).parents[2] / "examples" / "quickstart.ipynb"


def shown_by(source: str, names: dict[str, Any]) -> Any:
    """What a cell shows below itself: the value of its last line, if that is an expression."""
    parsed = ast.parse(source)
    last = parsed.body.pop() if isinstance(parsed.body[-1], ast.Expr) else None
    exec(compile(parsed, "cell", "exec"), names)
    return eval(compile(ast.Expression(last.value), "cell", "eval"), names) if isinstance(last, ast.Expr) else None


def test_the_notebook_trains_looks_and_compares_with_figures_inline(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    cells = [
        "".join(cell["source"]) for cell in json.loads(NOTEBOOK.read_text())["cells"] if cell["cell_type"] == "code"
    ]
    assert all(not cell.get("outputs") for cell in json.loads(NOTEBOOK.read_text())["cells"])
    names: dict[str, Any] = {}
    with contextlib.redirect_stdout(io.StringIO()) as told:
        shown = [shown_by(cell, names) for cell in cells]
    assert "on 20 test episodes the champion" in told.getvalue()
    pictures = [each for each in shown if isinstance(each, Image.Image)]
    assert len(pictures) == 4
    assert all(picture._repr_png_().startswith(b"\x89PNG") and min(picture.size) > 200 for picture in pictures)
    (table,) = [each for each in shown if isinstance(each, pd.DataFrame)]
    assert list(table.index) == ["NEAT", "ExNEAT"]
    assert (table["runs"] == 3).all()
    for picture in pictures:
        picture.close()
