"""How brains and episodes are cut into pieces of work.

Pieces shrink towards the end, so that all who work end together (guided self-scheduling; Polychronopoulos and
Kuck, 1987).
"""

from __future__ import annotations

import threading
from typing import NamedTuple

PIECES_AHEAD = 4
"""A worker takes this part of its fair share of what is left."""


class Pieces:
    """Shares work out among threads: episode by episode, some brains at a time.

    Large pieces spare calls and the drawing of worlds.

    Args:
        brains: how many.
        episodes: that each of them goes through.
        threads: that work side by side.
    """

    def __init__(self, brains: int, episodes: int, threads: int) -> None:
        self._brains = brains
        self._total = brains * episodes
        self._threads = threads
        self._taken = 0
        self._lock = threading.Lock()

    def take(self) -> tuple[int, int, int] | None:
        """The next episode, its first brain and the one after its last; None when all are taken."""
        with self._lock:
            left = self._total - self._taken
            if left == 0:
                return None
            episode, first = divmod(self._taken, self._brains)
            fair = left if self._threads == 1 else max(1, left // (PIECES_AHEAD * self._threads))
            last = min(self._brains, first + fair)
            self._taken += last - first
            return episode, first, last


class Parcel(NamedTuple):
    """Some brains in some episodes: from the first of each to before the last."""

    first_brain: int
    last_brain: int
    first_episode: int
    last_episode: int

    @property
    def runs(self) -> int:
        """How many times a brain runs through an episode."""
        return (self.last_brain - self.first_brain) * (self.last_episode - self.first_episode)


class Parcels:
    """Shares work out to other processes: brain by brain, in all episodes if possible, so that each travels once.

    Args:
        brains: how many.
        episodes: that each of them goes through.
        most_brains: that a parcel may hold.
    """

    def __init__(self, brains: int, episodes: int, most_brains: int) -> None:
        self._brains = brains
        self._episodes = episodes
        self._most_brains = most_brains
        self._taken = 0

    @property
    def left(self) -> int:
        """Runs of a brain through an episode that were not taken yet."""
        return self._brains * self._episodes - self._taken

    def take(self, runs: int) -> Parcel | None:
        """The next parcel, of about so many runs (at least 1); None when all are taken."""
        if self.left == 0:
            return None
        brain, episode = divmod(self._taken, self._episodes)
        if episode == 0 and runs >= self._episodes:
            brains = min(runs // self._episodes, self._most_brains, self._brains - brain)
            parcel = Parcel(brain, brain + brains, 0, self._episodes)
        else:
            parcel = Parcel(brain, brain + 1, episode, min(self._episodes, episode + runs))
        self._taken += parcel.runs
        return parcel
