"""What a check of `exneat doctor` found, and how a check that crashes becomes a finding too."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple

from exneat_cli.errors import ExneatError

OK, DEGRADED, BROKEN = "ok", "degraded", "broken"
"""Fit; works, but slower or with something missing; must be fixed before exneat runs."""

_NAME_WIDTH = 16


class Finding(NamedTuple):
    """One line of the doctor.

    Attributes:
        state: `OK`, `DEGRADED` or `BROKEN`.
        name: what was looked at, in a word or two.
        found: what was seen.
        remedy: how to fix it; empty if there is nothing to fix.
    """

    state: str
    name: str
    found: str
    remedy: str = ""

    def lines(self) -> str:
        """State, name and what was found; below them, indented, the remedy."""
        line = f"{self.state:<9} {self.name:<{_NAME_WIDTH}} {self.found}"
        return f"{line}\n{'':<10}remedy: {self.remedy}" if self.remedy else line


class Check(NamedTuple):
    """A name, and what looks at the thing and yields its findings."""

    name: str
    look: Callable[[], Iterable[Finding]]


def findings_of(check: Check) -> Iterator[Finding]:
    """What a check finds; if it crashes, that is the last finding, and `BROKEN`."""
    try:
        yield from check.look()
    except Exception as error:
        yield Finding(BROKEN, check.name, f"could not be checked: {in_words(error)}", _remedy_of(error))


def in_words(error: BaseException) -> str:
    """An exception's type and text on one line; the text alone where it was written for users."""
    if isinstance(error, ExneatError):
        return str(error)
    return " ".join(f"{type(error).__name__}: {error}".split())


def _remedy_of(error: Exception) -> str:
    if isinstance(error, ImportError):
        return "install what is missing, then ask again"
    return "the check itself failed; fix what it names, or report it with this line"
