"""What a builder of figures or tables hands to the page that shows them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Built:
    """One figure or table that lies on disk.

    Attributes:
        name: e.g. ``figure-4.3``; its files are called so.
        title: what it shows, in a few words.
        caption: the sentences below it.
        paths: its files.
        header, rows: the cells of a table, as printed; empty for a figure.
    """

    name: str
    title: str
    caption: str
    paths: tuple[Path, ...]
    header: tuple[str, ...] = ()
    rows: tuple[tuple[str, ...], ...] = ()
