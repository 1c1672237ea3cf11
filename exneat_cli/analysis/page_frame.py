"""The frame of a page that needs nothing but itself: style, headings, tables and pictures as text."""

from __future__ import annotations

import base64
import html
import os
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from urllib.parse import quote

from exneat_cli.errors import ExneatError

_STYLE = """
:root { color-scheme: light; }
body { margin: 0 auto; max-width: 62rem; padding: 1rem; background: #ffffff; color: #1b1b1b;
  font: 1rem/1.5 system-ui, sans-serif; }
h1, h2, h3 { line-height: 1.25; }
h2 { margin-top: 2.5rem; border-bottom: 1px solid #c8c8c8; }
a { color: #0b4f9e; }
img { display: block; max-width: 100%; height: auto; }
pre { overflow-x: auto; padding: 0.5rem; background: #f2f2f2; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-size: 0.9rem; }
th, td { padding: 0.25rem 0.6rem; border-bottom: 1px solid #dddddd; text-align: left; vertical-align: top; }
td.number { text-align: right; white-space: nowrap; font-variant-numeric: tabular-nums; }
.caption { max-width: 46rem; color: #404040; }
"""
_PICTURES = {".png": "image/png", ".svg": "image/svg+xml"}
_NUMBER = re.compile(r"[\[<>]?-?\d[^A-Za-z]*")


def text(words: str) -> str:
    """Words that cannot be taken for markup, in elements and in attributes."""
    return html.escape(words, quote=True)


def anchor(name: str) -> str:
    """An id that can be linked to."""
    return re.sub(r"[^\w.-]+", "-", name)


def page(title: str, body: Iterable[str]) -> str:
    """A whole document around the parts of its body."""
    return "\n".join(
        [
            "<!doctype html>",
            '<html lang="en">',
            "<head>",
            '<meta charset="utf-8">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            f"<title>{text(title)}</title>",
            f"<style>{_STYLE}</style>",
            "</head>",
            "<body>",
            *body,
            "</body>",
            "</html>",
            "",
        ]
    )


def table(label: str, header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table that scrolls by itself where the screen is narrow.

    Args:
        label: what it is, for those who do not see it.
        header: names of its columns.
        rows: its cells; those that are numbers are set to the right.
    """
    head = "".join(f'<th scope="col">{text(cell)}</th>' for cell in header)
    lines = "\n".join(f"<tr>{''.join(_cell(cell) for cell in row)}</tr>" for row in rows)
    opening = f'<div class="scroll" role="region" tabindex="0" aria-label="{text(label)}">'
    return f"{opening}<table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{lines}\n</tbody></table></div>"


def _cell(cell: str) -> str:
    return f'<td class="number">{text(cell)}</td>' if _NUMBER.fullmatch(cell) else f"<td>{text(cell)}</td>"


def picture(label: str, paths: Sequence[Path]) -> str:
    """The first picture among `paths`, PNG before SVG, inside the page itself; nothing if there is none.

    A picture in the page as an image cannot clash with the ids of another, as SVG elements would.

    Raises:
        ExneatError: the picture cannot be read.
    """
    for suffix, kind in _PICTURES.items():
        for path in paths:
            if path.suffix == suffix:
                return f'<img alt="{text(label)}" src="data:{kind};base64,{_encoded(path)}">'
    return ""


def _encoded(path: Path) -> str:
    try:
        return base64.b64encode(path.read_bytes()).decode("ascii")
    except OSError as error:
        raise ExneatError(f"{path}: could not be read: {error.strerror}") from error


def file_links(directory: Path, paths: Iterable[Path]) -> str:
    """Links to files, relative to the directory of the page."""
    links = (f'<a href="{quote(Path(os.path.relpath(p, directory)).as_posix())}">{text(p.name)}</a>' for p in paths)
    return ", ".join(links)
