"""What a case of the fault suite hands back, printed for people and written as CSV."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from exneat_cli.records import make_directory, write_csv

_SHOWN = 8
"""Mistakes of one case that are told in full."""


@dataclass(frozen=True)
class Finding:
    """One measured figure beside its bar.

    Attributes:
        what: was counted or measured, in words.
        figure: the measured value.
        bar: what it must be, in words.
        meets: whether it is.
        note: what a reader needs to judge it by.
    """

    what: str
    figure: float
    bar: str
    meets: bool
    note: str = ""

    @property
    def verdict(self) -> str:
        """``meets`` or ``misses``."""
        return "meets" if self.meets else "misses"


@dataclass
class Mistakes:
    """What went wrong while a case ran; the first ones are told at once."""

    found: list[str] = field(default_factory=list)

    def add(self, text: str) -> None:
        """Note a mistake."""
        if len(self.found) < _SHOWN:
            say(f"  MISTAKE {text}")
        self.found.append(text)

    def none_of(self, what: str, note: str = "") -> Finding:
        """The finding that there must be none."""
        told = "; ".join(filter(None, [note, self.found[0][:200] if self.found else ""]))
        return Finding(what, len(self.found), "0", not self.found, told)


def at_most(what: str, figure: float, limit: float, note: str = "") -> Finding:
    """A figure that must not exceed a limit."""
    return Finding(what, figure, f"at most {limit:g}", figure <= limit, note)


def exactly(what: str, figure: float, expected: float, note: str = "") -> Finding:
    """A figure that must be what was asked for."""
    return Finding(what, figure, f"{expected:g}", figure == expected, note)


def say(text: str) -> None:
    """Tell people what is going on, away from the table."""
    print(text, file=sys.stderr, flush=True)


COLUMNS = ("case", "what", "figure", "bar", "verdict", "note")


def print_findings(case: str, findings: Sequence[Finding]) -> None:
    """One line each."""
    for each in findings:
        print(
            f"{case:<12}{each.what:<66}{each.figure:>10.4g}  {each.bar:<12}{each.verdict:<8}{each.note[:120]}".rstrip()
        )
    sys.stdout.flush()


def write_findings(path: Path, findings: Sequence[tuple[str, Finding]]) -> None:
    """Write all of them; the folder is made if absent."""
    make_directory(path.parent)
    rows = [(case, each.what, float(each.figure), each.bar, each.verdict, each.note) for case, each in findings]
    write_csv(path, COLUMNS, rows)
