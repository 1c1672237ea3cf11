"""Runs episodes in the worker processes of a dask cluster.

Parcels are computed again when the worker that had them dies, and results are put where they belong, so that
neither deaths nor the order of things show in them.
"""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Sequence
from typing import Any

from exneat_cli.brains import Brains
from exneat_cli.errors import ExneatError
from exneat_cli.rollouts.cluster import Cluster, cluster_of, release_clusters, retain_clusters
from exneat_cli.rollouts.cluster_worker import Played, packed, play_parcel, versions
from exneat_cli.rollouts.executor import Executor
from exneat_cli.rollouts.outcomes import Results
from exneat_cli.rollouts.pieces import PIECES_AHEAD, Parcel, Parcels
from exneat_cli.rollouts.player import Crew, Setup
from exneat_cli.seeding import EpisodeSeeds

WORTH_SECONDS = 0.05
"""A parcel takes at least this long, where there is so much to do: sending it costs 3 to 5 ms."""
QUEUED = 2
"""Parcels under way per thread of the cluster: one that is played, and one that waits beside it."""
MOST_BYTES = 4 * 2**20
"""Of the brains in one parcel."""
PATIENCE_SECONDS = 60.0
"""How long a cluster may be without any worker."""
RESUBMISSIONS = 5
"""How often a parcel is handed in again that dask gave up because its workers died (of 4, as dask is set up)."""


class ClusterWork:
    """A share of a cluster, for one setup.

    Args:
        setup: what is simulated.
        executor: of name ``dask``.

    Raises:
        ExneatError: dask is not installed, or nothing answers at the executor's address.
    """

    def __init__(self, setup: Setup, executor: Executor) -> None:
        self._setup = setup
        self._executor = executor
        self._seconds = 0.0
        self._runs = 0
        retain_clusters()
        try:
            self._cluster = cluster_of(executor)
        except BaseException:
            release_clusters()
            raise

    def play(self, crew: Crew, episodes: Sequence[EpisodeSeeds], results: Results) -> None:
        """Run every brain through every episode and write `results`.

        Raises:
            ExneatError: no worker was there for `PATIENCE_SECONDS`, brains killed one worker after the other, or
                a worker has other versions.
        """
        brains = len(crew.brains.size)
        parcels = Parcels(brains, len(episodes), max(1, MOST_BYTES * brains // _bytes_of(crew.brains)))
        # What was seen lately weighs more than what was seen long ago: brains grow and live longer.
        self._seconds, self._runs = self._seconds / 2, self._runs // 2
        under_way = _UnderWay(self._cluster, self._executor)
        with contextlib.closing(under_way):
            while True:
                threads = under_way.threads
                while len(under_way) < QUEUED * threads and (parcel := parcels.take(self._size(parcels.left, threads))):
                    under_way.send(parcel, packed(self._setup, _part(crew, parcel), _seeds(episodes, parcel)))
                if not len(under_way):
                    return
                for parcel, played in under_way.finished():
                    _put(results, parcel, played.results)
                    if played.seconds is not None:
                        self._seconds, self._runs = self._seconds + played.seconds, self._runs + parcel.runs

    def close(self) -> None:
        """Leave the cluster."""
        release_clusters()

    def _size(self, left: int, threads: int) -> int:
        """How many runs the next parcel has."""
        worth = math.ceil(WORTH_SECONDS * self._runs / self._seconds) if self._seconds else 1
        return max(1, worth, left // (PIECES_AHEAD * threads))


class _UnderWay:
    """Parcels that were sent and did not come back yet."""

    def __init__(self, cluster: Cluster, executor: Executor) -> None:
        self._cluster = cluster
        self._executor = executor
        self._parcels: dict[Any, tuple[Parcel, bytes, int]] = {}
        self._workers_seen = time.monotonic()
        self._threads = 0
        self._look_for_workers()

    def __len__(self) -> int:
        return len(self._parcels)

    @property
    def threads(self) -> int:
        """Threads of the cluster when it was last looked at; those to be while they are started."""
        return self._threads or (1 if self._executor.address else self._executor.threads)

    def send(self, parcel: Parcel, content: bytes, sent_before: int = 0) -> None:
        """Have a parcel played by whoever comes to it first."""
        future = self._cluster.client.submit(play_parcel, versions(), content, pure=False)
        self._parcels[future] = parcel, content, sent_before

    def finished(self) -> list[tuple[Parcel, Played]]:
        """Waits for parcels; may return none of them, after having dealt with what went wrong."""
        from distributed import wait

        with self._cluster.client.as_current(), contextlib.suppress(TimeoutError):
            wait(list(self._parcels), timeout=1.0, return_when="FIRST_COMPLETED")
        came = []
        for future in [future for future in self._parcels if future.done()]:
            with contextlib.suppress(TimeoutError):
                if future.status == "finished":
                    came.append((self._parcels[future][0], future.result(timeout=5.0)))
                    del self._parcels[future]
                else:
                    self._send_again(future)
        if came:
            self._workers_seen = time.monotonic()
        else:
            self._look_for_workers()
        return came

    def close(self) -> None:
        """Have nothing more played; what is being played ends by itself."""
        if self._parcels and self._cluster.usable:
            self._cluster.client.cancel(list(self._parcels))

    def _send_again(self, future: Any) -> None:
        """What becomes of a parcel that failed: sent again if its workers died, else its error is raised."""
        from distributed import KilledWorker

        parcel, content, sent_before = self._parcels[future]
        if future.status == "error":
            error = future.exception()
            if isinstance(error, ImportError):
                fix = "install the same exneat[dask] on all machines and start the workers again"
                raise ExneatError(f"executor=dask: a worker cannot import what it needs: {error}\n  {fix}") from error
            if not isinstance(error, KilledWorker):
                raise error
            if sent_before >= RESUBMISSIONS:
                what = f"brains {parcel.first_brain} to {parcel.last_brain - 1} of a generation"
                raise ExneatError(f"executor=dask: gave up {what}: one worker after the other died over them")
        elif not self._cluster.usable:
            raise ExneatError(f"executor=dask: {self._where()} went away") from None
        del self._parcels[future]
        self.send(parcel, content, sent_before + 1)

    def _look_for_workers(self) -> None:
        self._threads = self._cluster.threads()
        now = time.monotonic()
        if not self._executor.address and self._threads < self._executor.threads:
            self._cluster.fix()
        if self._threads:
            self._workers_seen = now
        elif now - self._workers_seen > PATIENCE_SECONDS:
            fix = "start some: dask worker <address> --nworkers auto --nthreads 1"
            raise ExneatError(
                f"executor=dask: {self._where()} had no workers for {PATIENCE_SECONDS:.0f} s"
                + (f"\n  {fix}" if self._executor.address else "")
            )

    def _where(self) -> str:
        address = self._executor.address
        return f"the scheduler at {address}" if address else "the cluster on this machine"


def _part(crew: Crew, parcel: Parcel) -> Crew:
    return crew._replace(brains=crew.brains.part(parcel.first_brain, parcel.last_brain))


def _seeds(episodes: Sequence[EpisodeSeeds], parcel: Parcel) -> Sequence[EpisodeSeeds]:
    return episodes[parcel.first_episode : parcel.last_episode]


def _put(results: Results, parcel: Parcel, came: Results) -> None:
    for values, part in zip(results, came, strict=True):
        values[parcel.first_episode : parcel.last_episode, parcel.first_brain : parcel.last_brain] = part


def _bytes_of(brains: Brains) -> int:
    return sum(value.nbytes for value in brains if not isinstance(value, int))
