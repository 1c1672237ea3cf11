"""Runs episodes in batches of worlds on one device, for all runs of this process together.

One thread owns the device. Requests with the same task and noise share a batch: each takes a slot, and worlds take jobs
from all slots. Results depend neither on slots nor on worlds.
"""

from __future__ import annotations

import pickle
import sys
import threading
from collections.abc import Sequence
from dataclasses import dataclass, field

from exneat_cli.brains import Brains
from exneat_cli.errors import ExneatError
from exneat_cli.rollouts.batch.stage import Stage
from exneat_cli.rollouts.episode import Acting, Tally
from exneat_cli.rollouts.settings import Executor, Noise
from exneat_cli.seeding import EpisodeSeeds
from exneat_cli.tasks import HasBatch, Task

STEPS_AT_ONCE = 4
"""Control steps between checks for ended episodes; as many more are queued by then."""
GATHERING_SECONDS = 0.02
"""How long an idle batch waits for requests of other runs before it starts (s)."""
MOST_SLOTS = 1024

Setup = tuple[Task, Noise, bool]


@dataclass(eq=False)
class _Request:
    setup: Setup
    brains: Brains
    episodes: Sequence[EpisodeSeeds]
    tally: Tally
    done: threading.Event = field(default_factory=threading.Event)
    error: BaseException | None = None
    given_up: bool = False

    @property
    def moments(self) -> bool:
        return bool(self.tally[-1].size)

    @property
    def jobs(self) -> int:
        return len(self.brains.size) * len(self.episodes)


class Batches:
    """Batches of worlds on one device, opened when there is work for them."""

    is_usable = True

    def __init__(self, executor: Executor) -> None:
        executor.check_installed()
        self._device, self._most = executor.device_name, executor.worlds
        self._changed = threading.Condition()
        self._waiting: list[_Request] = []
        self._batches: dict[bytes, _Batch] = {}
        self._thread: threading.Thread | None = None
        self._closing = False

    def run(self, setup: Setup, acting: Acting, episodes: Sequence[EpisodeSeeds], tally: Tally) -> None:
        """Run every brain through every episode of the setup; write `tally`.

        Raises:
            ExneatError: the device has too little memory, or contacts exceed twice the usual room.
            ConfigError: MuJoCo Warp cannot simulate the model.
        """
        request = _Request(setup, acting[0], list(episodes), tally)
        with self._changed:
            self._waiting.append(request)
            if self._thread is None:
                self._thread = threading.Thread(target=self._serve, name="batches", daemon=True)
                self._thread.start()
            self._changed.notify()
        try:
            while not request.done.wait(1.0):
                pass
        except BaseException:
            request.given_up = True
            raise
        if request.error is not None:
            raise request.error

    def close(self) -> None:
        """End the thread, and free its memory on the device."""
        with self._changed:
            self._closing = True
            self._changed.notify()
        if self._thread is not None:
            self._thread.join()

    def _serve(self) -> None:
        try:
            while self._take_in():
                for batch in self._batches.values():
                    batch.advance()
        except BaseException as error:  # all waiting requests must receive the error
            failed = [request for batch in self._batches.values() for request in batch.requests]
            with self._changed:
                failed += self._waiting
                self._waiting.clear()
                self._batches.clear()
                self._thread = None
            for request in failed:
                request.error = _in_words(error, self._device, self._most)
                request.done.set()
        else:
            self._batches.clear()

    def _take_in(self) -> bool:
        """Hand waiting requests to their batches, or wait for some if there is no work; returns whether to continue."""
        with self._changed:
            while not (self._closing or self._waiting or any(each.requests for each in self._batches.values())):
                self._changed.wait()
                if not self._closing:
                    self._changed.wait(GATHERING_SECONDS)
            if self._closing:
                return False
            came, self._waiting = self._waiting, []
        for request in came:
            key = pickle.dumps((request.setup, request.moments))
            if key not in self._batches:
                self._batches[key] = _Batch(request.setup, self._device, self._most, moments=request.moments)
            self._batches[key].requests.append(request)
        return True


class _Batch:
    """The requests with one task and noise, and the worlds that they share."""

    def __init__(self, setup: Setup, device: str, most: int, *, moments: bool) -> None:
        self._setup, self._device, self._most, self._room = setup, device, most, 1
        self._moments = moments
        self._stage: Stage | None = None
        self._worlds = self._slots = 0
        self._running: dict[int, _Request] = {}
        self.requests: list[_Request] = []

    def advance(self) -> None:
        """Start waiting requests if possible, do some control steps, and hand out the results of ended requests."""
        if not self.requests:
            return
        if self._running and all(request.given_up for request in self._running.values()):
            self._forget_all()
        waiting = [each for each in self.requests if each not in self._running.values() and not each.given_up]
        self.requests = [*self._running.values(), *waiting]
        if not self._running and waiting:
            self._open(waiting)
        stage = self._stage
        assert stage is not None or not waiting
        if stage is None:
            return
        if self._running:
            stage.launch(STEPS_AT_ONCE)
        if len(waiting) <= self._slots - len(self._running):  # otherwise all wait until there are enough slots
            free = [slot for slot in range(self._slots) if slot not in self._running]
            for slot, request in zip(free, waiting, strict=False):
                stage.put(slot, request.brains, request.episodes)
                self._running[slot] = request
        ended, lacked_room = stage.look()
        if lacked_room:
            self._double_room()
            return
        for slot, request in list(self._running.items()):
            if ended[slot]:
                stage.fetch(slot, request.tally)
                del self._running[slot]
                self.requests.remove(request)
                request.done.set()

    def _open(self, waiting: Sequence[_Request]) -> None:
        """Make sure that there are enough worlds and slots for the waiting requests."""
        worlds = min(self._most, sum(request.jobs for request in waiting))
        slots = min(MOST_SLOTS, len(waiting))
        if self._stage is not None and worlds <= self._worlds and slots <= self._slots:
            return
        self._worlds, self._slots = max(worlds, self._worlds), max(slots, self._slots)
        self._stage = None  # frees its memory before more is taken
        task, noise, training = self._setup
        assert isinstance(task, HasBatch)
        opened = task.open_batch(
            self._worlds, self._device, training=training, reset_scale=noise.reset_scale, room=self._room
        )
        sizes = {"sensed_size": task.sensed_size, "action_size": len(task.actuator_names), "terms": len(task.terms)}
        self._stage = Stage(opened, sensor_std=noise.sensor_std, slots=self._slots, moments=self._moments, **sizes)

    def _double_room(self) -> None:
        if self._room > 1:
            what = "bodies have more contacts than there is room for, after it was doubled"
            raise ExneatError(f"executor=warp: {what}\n  use executor=threads for this model")
        self._room = 2
        jobs = sum(request.jobs for request in self._running.values())
        what = f"more contacts than there was room for: it is doubled, and {jobs} episodes begin again"
        print(f"exneat: executor=warp: {what}", file=sys.stderr, flush=True)
        self._forget_all()

    def _forget_all(self) -> None:
        """Drop the running requests and the worlds, so that these requests start again."""
        self._running.clear()
        self._stage = None


def _in_words(error: BaseException, device: str, worlds: int) -> BaseException:
    """The error, or an `ExneatError` if the user can do something about it."""
    if isinstance(error, RuntimeError | MemoryError) and "alloc" in f"{error}{type(error)}".lower():
        why = f"{device} has too little memory for {worlds} worlds"
        return ExneatError(f"executor=warp: {why}\n  set executor.worlds lower")
    return error
