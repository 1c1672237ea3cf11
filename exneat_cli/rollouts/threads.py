"""Runs episodes on threads: the compiled loop holds no GIL, so they run side by side."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor, wait

import numpy as np
from numpy.typing import NDArray

from exneat_cli.rollouts.outcomes import Results
from exneat_cli.rollouts.pieces import Pieces
from exneat_cli.rollouts.player import Crew, Player
from exneat_cli.seeding import EpisodeSeeds


class Threads:
    """A thread per player.

    Args:
        players: one world each.
        halt: (1,), what the players stop at when it is set.
    """

    def __init__(self, players: Sequence[Player], halt: NDArray[np.bool_]) -> None:
        self._players = players
        self._halt = halt
        self._pool = ThreadPoolExecutor(len(players), thread_name_prefix="episodes")

    def play(self, crew: Crew, episodes: Sequence[EpisodeSeeds], results: Results) -> None:
        """Run every brain through every episode and write `results`."""
        pieces = Pieces(len(crew.brains.size), len(episodes), len(self._players))
        failed = threading.Event()

        def work(player: Player) -> None:
            buffers = player.buffers(crew)
            try:
                while not failed.is_set() and (piece := pieces.take()) is not None:
                    episode, first, last = piece
                    player.play(crew, buffers, (first, last), episodes[episode], results.of_episode(episode))
            except BaseException:
                failed.set()
                raise

        workers = [self._pool.submit(work, player) for player in self._players]
        wait(workers)
        for worker in workers:
            worker.result()

    def close(self) -> None:
        """End all threads, before the next step of their episodes."""
        self._halt[0] = True
        self._pool.shutdown(cancel_futures=True)
