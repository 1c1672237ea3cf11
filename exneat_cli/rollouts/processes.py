"""Runs episodes in worker processes on this machine, with Python's own `multiprocessing`.

Work is repeated when its worker dies, and results are stored by position, so that they depend neither on deaths of
workers nor on the order of completion. A worker ends when it is told to, or with the process that started it.
"""

from __future__ import annotations

import contextlib
import math
import multiprocessing
import os
import pickle
import signal
import sys
import threading
import traceback
from collections import Counter, deque
from collections.abc import Iterator, Sequence
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from typing import Any

from exneat_cli.errors import ExneatError
from exneat_cli.interruption import uninterrupted
from exneat_cli.output import forgiving_output
from exneat_cli.rollouts.blocks import WORTH_SECONDS, Setup, blocks, run_block
from exneat_cli.rollouts.episode import Acting, Tally
from exneat_cli.rollouts.settings import Executor
from exneat_cli.seeding import EpisodeSeeds

MOST_DEATHS = 3
"""Number of workers that may die over the same block before the work is given up."""
_CONTEXT = multiprocessing.get_context("spawn")  # forking would copy locks held by other threads


class Processes:
    """Worker processes, which start when there is work for them and stay until `close`."""

    is_usable = True

    def __init__(self, executor: Executor) -> None:
        self._executor, self._seconds_per_run = executor, math.inf
        self._workers: list[_Worker] = []
        self._lock = threading.Lock()

    def run(self, setup: Setup, acting: Acting, episodes: Sequence[EpisodeSeeds], tally: Tally) -> None:
        """Run every brain through every episode of the setup; write `tally`.

        Raises:
            ExneatError: workers cannot be started or cannot import the task, or several workers in a row died over the
                same brains.
        """
        (brains, *added), moments = acting, bool(tally[-1].size)
        smallest = math.ceil(WORTH_SECONDS / self._seconds_per_run)
        places = blocks(len(brains.size), len(episodes), self._executor.threads, max(1, smallest))
        world, work = pickle.dumps((sys.path, pickle.dumps(setup))), []
        for some, which in places:
            work.append(pickle.dumps(((brains.part(some.start, some.stop), *added), list(episodes[which]), moments)))
        pace = math.inf
        with self._lock:
            try:
                for block, (part, seconds) in self._results(world, work):
                    some, which = places[block]
                    for own, values in zip(tally, part, strict=True):
                        own[which, some] = values
                    pace = min(pace, seconds / part[0].size)  # longer ones also loaded compiled code
                self._seconds_per_run = pace
            except BaseException as error:
                self.close()  # the results of the other workers are not needed any more
                if isinstance(error, ImportError):
                    why = f"a worker cannot import what it needs: {error}\n  executor=serial needs no worker"
                    raise ExneatError(f"executor=processes: {why}") from error
                raise

    def _results(self, world: bytes, work: Sequence[bytes]) -> Iterator[tuple[int, tuple[Tally, float]]]:
        """Have all of `work` done; yields the number of each block with its result."""
        waiting, busy, deaths = deque(range(len(work))), dict[_Worker, int](), Counter[int]()
        while waiting or busy:
            self._start(min(self._executor.threads, len(waiting) + len(busy)))
            for worker in [each for each in self._workers if each not in busy][: len(waiting)]:
                busy[worker] = waiting.popleft()
                worker.begin(world, work[busy[worker]])
            ready = wait([each.connection for each in busy])
            for worker in [each for each in busy if each.connection in ready]:
                block = busy.pop(worker)
                try:
                    yield block, worker.result()
                except EOFError:
                    self._workers.remove(worker)
                    worker.end()
                    waiting.appendleft(block)
                    deaths[block] += 1
                    if deaths[block] == MOST_DEATHS:
                        why = "gave up: one worker after the other died over the same brains"
                        raise ExneatError(f"executor=processes: {why}\n  resume=true goes on") from None

    def _start(self, count: int) -> None:
        """Make sure that there are at least `count` workers."""
        if len(self._workers) >= count:
            return
        resource_tracker.ensure_running()  # its first start would undo what follows
        with uninterrupted():
            # Children inherit the signals that this thread blocks: Ctrl-C also reaches them, but only we handle it.
            before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
            try:
                while len(self._workers) < count:
                    self._workers.append(_Worker())
            except OSError as error:
                raise ExneatError(f"executor=processes: no worker could be started: {error.strerror}") from error
            finally:
                signal.pthread_sigmask(signal.SIG_SETMASK, before)

    def close(self) -> None:
        """End all workers, even busy ones: they have nothing to save."""
        while self._workers:
            self._workers.pop().end()


class _Worker:
    """One process, and the connection to it."""

    def __init__(self) -> None:
        self.connection, theirs = _CONTEXT.Pipe()
        self._process = _CONTEXT.Process(target=_serve, args=(theirs,), daemon=True)
        try:
            self._process.start()
        finally:
            theirs.close()  # so that the death of the process ends the connection

    def begin(self, world: bytes, work: bytes) -> None:
        """Have the worker run a block, see `run_block`."""
        with contextlib.suppress(OSError):  # it is dead, as `result` will report
            self.connection.send((world, work))

    def result(self) -> tuple[Tally, float]:
        """The result of the block; raises the error that the worker raised.

        Raises:
            EOFError: the worker is dead.
        """
        try:
            result, error = self.connection.recv()
        except OSError as broken:
            raise EOFError from broken
        if error is not None:
            raise error
        return result  # type: ignore[no-any-return]

    def end(self) -> None:
        """Kill the process."""
        self._process.kill()
        self._process.join()
        self.connection.close()


def _serve(connection: Connection) -> None:
    """Run blocks in a worker until the other side is gone."""
    threading.Thread(target=_end_with_parent, daemon=True).start()
    with forgiving_output(), contextlib.suppress(EOFError, OSError):
        while True:
            world, work = connection.recv()
            answer: tuple[Any, Exception | None]
            try:
                answer = run_block({}, world, work), None
            except Exception as error:
                answer = None, _portable(error)
            connection.send(answer)


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)


def _portable(error: Exception) -> Exception:
    """The error, or one with the same message if it cannot be pickled, with a note of where it was raised."""
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:  # pickling a foreign error may raise anything
        error = RuntimeError(f"{type(error).__name__}: {error}")
    error.add_note(f"in a worker process:\n{traceback.format_exc()}")
    return error
