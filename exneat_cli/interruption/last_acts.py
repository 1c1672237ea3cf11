"""What is still done when the process is ended in the midst of something."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator

_acts: list[Callable[[], None]] = []


@contextlib.contextmanager
def before_the_end(act: Callable[[], None]) -> Iterator[None]:
    """Have `act` done, by another thread, if the process must be ended amid the block; its errors count for nothing."""
    _acts.append(act)
    try:
        yield
    finally:
        _acts.remove(act)


def do_last_acts() -> None:
    """Do them, the last one first."""
    for act in reversed(_acts):
        with contextlib.suppress(Exception):
            act()
