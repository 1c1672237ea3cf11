"""What runs in the worker processes of a cluster."""

from __future__ import annotations

import functools
import pickle
import platform
import threading
import time
from collections import OrderedDict
from collections.abc import Sequence
from importlib.metadata import version
from typing import NamedTuple

import exneat_cli
from exneat_cli.compiling import source_digest
from exneat_cli.errors import ExneatError
from exneat_cli.rollouts.outcomes import Results
from exneat_cli.rollouts.player import Crew, Player, Setup
from exneat_cli.seeding import EpisodeSeeds

SETUPS_KEPT = 4
"""A worker keeps the opened worlds of this many setups; a robustness sweep has one per level."""
_LIBRARIES = ("numpy", "numba", "mujoco")

_idle: OrderedDict[Setup, list[Player]] = OrderedDict()
_lock = threading.Lock()


class Played(NamedTuple):
    """What a worker sends back.

    Attributes:
        results: of the parcel.
        seconds: that its episodes took; None if the world was new: the first call also loads compiled code.
    """

    results: Results
    seconds: float | None


@functools.cache
def versions() -> dict[str, str]:
    """What must be the same here and in every worker, or results could differ."""
    return {
        "exneat": f"{exneat_cli.__version__} with sources {source_digest()[:8]}",
        "Python": ".".join(platform.python_version_tuple()[:2]),
        **{library: version(library) for library in _LIBRARIES},
    }


def play_parcel(expected: dict[str, str], parcel: bytes) -> Played:
    """Run some brains through some episodes.

    Args:
        expected: `versions` of the process that asks.
        parcel: what `packed` gave there.

    Raises:
        ExneatError: a version differs.
    """
    for name, wanted in expected.items():
        if (came := versions()[name]) != wanted:
            fix = "install the same on all machines and start the workers again"
            raise ExneatError(f"executor=dask: expected workers with {name} {wanted}, got {came}\n  {fix}")
    setup, crew, episodes = pickle.loads(parcel)
    players = _players_of(setup)
    try:
        player, fresh = players.pop(), False
    except IndexError:  # no test before: another thread may take the last one in between
        player, fresh = Player(setup), True
    began = time.perf_counter()
    results = Results.empty(len(crew.brains.size), len(episodes), len(setup.task.terms))
    buffers = player.buffers(crew)
    for episode, seeds in enumerate(episodes):
        player.play(crew, buffers, (0, len(crew.brains.size)), seeds, results.of_episode(episode))
    players.append(player)
    return Played(results, None if fresh else time.perf_counter() - began)


def packed(setup: Setup, crew: Crew, episodes: Sequence[EpisodeSeeds]) -> bytes:
    """A parcel for `play_parcel`.

    dask could carry the arrays too, but they would arrive read-only, for which numba would compile everything anew.
    """
    return pickle.dumps((setup, crew, list(episodes)), protocol=5)


def _players_of(setup: Setup) -> list[Player]:
    """Players of this process that nobody uses; take from and give back to it."""
    with _lock:
        players = _idle.setdefault(setup, [])
        _idle.move_to_end(setup)
        if len(_idle) > SETUPS_KEPT:
            _idle.popitem(last=False)
        return players
