"""A counter that can be read without counting on, unlike `itertools.count`."""

from __future__ import annotations

from collections.abc import Iterator


class Counter(Iterator[int]):
    """Gives `following`, then the next whole number, and so on.

    Attributes:
        following: what `next` will give.
    """

    def __init__(self, following: int) -> None:
        self.following = following

    def __next__(self) -> int:
        self.following += 1
        return self.following - 1
