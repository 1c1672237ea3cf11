"""How brains and episodes are shared out among threads and processes."""

from __future__ import annotations

import time
from collections.abc import Iterator

Share = tuple[int, int, int]
"""An episode, the first brain that runs through it, and the one before which to stop."""

SHARES_AHEAD = 4
"""A thread takes this part of its fair share of what is left."""
BLOCKS_PER_WORKER = 8
"""So many blocks let processes end together."""
LONGEST_CALL = 0.25
"""Seconds that a call of compiled code in the main thread should not exceed: signals wait for its end."""


def shares_for_threads(brains: int, episodes: int, threads: int) -> Iterator[Share]:
    """Episode by episode, some brains at a time: large shares spare calls and the drawing of worlds.

    Shares shrink, so that all threads end together (guided self-scheduling; Polychronopoulos and Kuck, 1987).
    """
    left = brains * episodes
    for episode in range(episodes):
        first = 0
        while first < brains:
            fair = left if threads == 1 else max(1, left // (SHARES_AHEAD * threads))
            last = min(brains, first + fair)
            yield episode, first, last
            left -= last - first
            first = last


def short_shares(brains: int, episodes: int) -> Iterator[Share]:
    """The same for the main thread: as large as can be done within `LONGEST_CALL`, by the time the last ones took."""
    size = 1
    for episode in range(episodes):
        first = 0
        while first < brains:
            last, began = min(brains, first + size), time.perf_counter()
            yield episode, first, last
            seconds = time.perf_counter() - began
            if seconds > LONGEST_CALL:
                size = max(1, size // 2)
            elif seconds < LONGEST_CALL / 8:
                size *= 4
            first = last


def blocks(brains: int, episodes: int, workers: int, smallest: int) -> list[tuple[slice, slice]]:
    """Equal blocks of brains and episodes for other processes: whole rows if possible, so that a brain travels once.

    Args:
        brains: how many.
        episodes: of each of them.
        workers: that work side by side.
        smallest: runs of a brain through an episode that are worth being sent, if there is work for all.
    """
    runs = brains * episodes
    wanted = min(runs, max(workers, min(BLOCKS_PER_WORKER * workers, runs // smallest)))
    rows = max(1, min(brains, wanted))
    columns = -(-wanted // rows)
    return [(some, which) for some in _slices(brains, rows) for which in _slices(episodes, columns)]


def _slices(count: int, parts: int) -> list[slice]:
    return [slice(count * k // parts, count * (k + 1) // parts) for k in range(parts)]
