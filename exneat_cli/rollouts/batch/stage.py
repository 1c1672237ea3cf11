"""One batch of worlds with its queue of jobs: each request takes a slot, and worlds that finish take the next job.

A control step is one sequence of kernels, captured as a CUDA graph on a GPU: take jobs, reset, observe, disturb, sense,
activate, drive, step, keep count. During episodes, the host only reads how many of them have ended, one launch late, so
that the device has work while the host prepares more.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from exneat_cli.brains import Brains
from exneat_cli.brains.batch import activate, packed
from exneat_cli.brains.brain import memory_size
from exneat_cli.rollouts.batch import kernels
from exneat_cli.rollouts.batch.kernels import IDLE, Doing, Jobs, Outcome
from exneat_cli.rollouts.batch.mirrored import Mirrored, Reported, grown, widened
from exneat_cli.rollouts.batch.sensing import Sensing
from exneat_cli.rollouts.episode import Tally
from exneat_cli.seeding import EpisodeSeeds


class Stage:
    """W worlds and S slots.

    Args:
        worlds: as `HasBatch` opens them.
        sensor_std: sd of the normal noise on every reading.
        slots: S.
        sensed_size, action_size, terms: numbers of the task's sensed values, actuators and reward terms.
        moments: whether statistics of the sensed values are wanted.
    """

    def __init__(
        self,
        worlds: Any,
        *,
        sensor_std: float,
        slots: int,
        sensed_size: int,
        action_size: int,
        terms: int,
        moments: bool,
    ) -> None:
        self._worlds, self._sd, self._slots = worlds, sensor_std, slots
        count = worlds.count
        self.device = worlds.status.device
        self._graph: Any = None
        with wp.ScopedDevice(self.device):
            self._programs = Mirrored(np.zeros((slots, 1), np.int32))
            self._keys = Mirrored(np.zeros((slots, 2), np.uint32))
            self._starts = Mirrored(np.tile(worlds.resting_start(), (1 + slots, 1)))
            self._queue = Mirrored(np.zeros((1, 4), np.int32), wp.vec4i)
            self._tail = 0
            self._episodes = 1
            self._memory = wp.zeros((count, sensed_size + 1), dtype=float)
            framed = worlds.readings_size != sensed_size or worlds.is_framed
            self._readings = wp.zeros((count, worlds.readings_size), dtype=float) if framed else None
            self._action = wp.zeros((count, action_size), dtype=float)
            self._jobs = Jobs()
            self._jobs.head = wp.zeros(1, dtype=int)
            self._jobs.tail, self._jobs.queue = wp.zeros(1, dtype=int), self._queue.there
            self._doing = _struct(Doing(), count, int, "slot", "brain", "episode", "place", "steps")
            self._doing.totals = wp.zeros((count, terms), dtype=wp.float64)
            self._doing.brain.fill_(-1)
            self._outcome = _struct(Outcome(), (slots, 1), int, "status", "steps")
            self._outcome.totals = wp.zeros((slots, 1, terms), dtype=wp.float64)
            self._outcome.ended = wp.zeros(slots + 1, dtype=int)
            self._sensing = Sensing(count, slots, sensed_size) if moments else None
            self._overflow = self._outcome.ended[slots:]
            self._queued = np.zeros(slots, np.int64)
            self._reported = Reported(self._outcome.ended)
            self._aside = wp.Stream(self.device) if self.device.is_cuda else None
            worlds.status.fill_(IDLE)
            self._program()  # compiles and loads all kernels, which must not happen during a capture

    def put(self, slot: int, brains: Brains, episodes: Sequence[EpisodeSeeds]) -> None:
        """Queue every brain in every episode; the slot's previous request must be done."""
        programs, count = packed(brains), len(brains.size)
        jobs = np.empty((count * len(episodes), 4), np.int32)
        jobs[:, 0], jobs[:, 3] = slot, np.arange(len(jobs))
        jobs[:, 1], jobs[:, 2] = jobs[:, 3] % count, jobs[:, 3] // count
        with wp.ScopedDevice(self.device):
            self._make_room(len(programs), memory_size(brains), len(episodes), len(jobs))
            self._programs.write(slot, programs)
            keys = [each.sensor_noise.generate_state(2, np.uint32) for each in episodes]
            self._keys.write(slot * self._episodes, np.array(keys, np.uint32))
            self._starts.write(1 + slot * self._episodes, self._worlds.starts(episodes))
            tail, room = self._tail, len(self._queue.here)
            until_end = room - tail % room
            self._queue.write(tail % room, jobs[:until_end])
            if len(jobs) > until_end:
                self._queue.write(0, jobs[until_end:])
            self._move_tail(tail + len(jobs))
            self._queued[slot] += len(jobs)

    def launch(self, steps: int) -> None:
        """Queue some control steps on the device, without waiting for them."""
        with wp.ScopedDevice(self.device):
            if self.device.is_cuda and self._graph is None:
                with wp.ScopedCapture() as capture:
                    self._program()
                self._graph = capture.graph
            for _ in range(steps):
                if self._graph is not None:
                    wp.capture_launch(self._graph)
                else:
                    self._program()
            self._reported.send()

    def look(self) -> tuple[NDArray[np.bool_], bool]:
        """(S,) slots whose episodes have all ended, and whether room was exceeded, both before the last launch.

        Waits for the launch before the last one; nothing has ended if there was none.
        """
        ended = self._reported.take()
        if ended is None:
            return np.zeros(self._slots, np.bool_), False
        return ended[:-1] == self._queued, bool(ended[-1])

    def fetch(self, slot: int, tally: Tally) -> None:
        """Write the results of a slot whose episodes have all ended to `tally`."""
        statuses, steps, totals, *moments = tally
        jobs, shape = statuses.size, statuses.shape
        statuses[:] = self._read(self._outcome.status[slot])[:jobs].reshape(shape)
        steps[:] = self._read(self._outcome.steps[slot])[:jobs].reshape(shape)
        totals[:] = self._read(self._outcome.totals[slot])[:jobs].reshape(*shape, -1)
        if self._sensing is not None:
            for wanted, there in zip(moments, self._sensing.of(slot), strict=True):
                wanted[:] = self._read(there)[:jobs].reshape(*shape, -1)

    def _read(self, array: Any) -> NDArray[Any]:
        """The entries of an array that no launched step will change, read without waiting for these steps."""
        with wp.ScopedStream(self._aside, sync_enter=False):
            copy = wp.clone(array, device="cpu")
            if self._aside is not None:
                wp.synchronize_stream(self._aside)
        values: NDArray[Any] = copy.numpy()
        return values

    def _program(self) -> None:
        worlds, doing, count = self._worlds, self._doing, self._worlds.count
        memory = self._memory
        readings = memory if self._readings is None else self._readings
        taking = [self._jobs, doing, worlds.status, worlds.begins, self._episodes, memory]
        wp.launch(kernels.take_jobs, dim=count, inputs=taking)
        worlds.reset(self._starts.there)
        worlds.observe(readings)
        if self._sd > 0.0:
            size = worlds.readings_size
            wp.launch(
                kernels.disturb, dim=(count, -(-size // 4)), inputs=[self._keys.there, doing, self._sd, size, readings]
            )
        worlds.sense(readings, memory)
        if self._sensing is not None:
            self._sensing.add(doing, memory)
        wp.launch(activate, dim=count, inputs=[self._programs.there, doing.slot, doing.brain, memory, self._action])
        worlds.drive(self._action)
        worlds.step()
        wp.launch(kernels.keep_count, dim=count, inputs=[worlds.status, worlds.terms, doing, self._outcome])
        if self._sensing is not None:
            self._sensing.keep(worlds.status, doing)
        worlds.note_overflows(self._overflow)

    def _make_room(self, words: int, memory: int, episodes: int, jobs: int) -> None:
        """Enlarge arrays that are too small, keeping their entries; the steps are then captured again."""
        slots = self._slots
        if words > self._programs.here.shape[1]:
            self._programs = self._programs.resized(widened(self._programs.here, (slots, _ample(words))))
            self._graph = None
        if memory > self._memory.shape[1]:
            self._memory = grown(self._memory, (self._memory.shape[0], _ample(memory)))
            self._graph = None
        if episodes > self._episodes:
            self._grow_episodes(episodes)
            self._graph = None
        if jobs > self._outcome.status.shape[1]:
            for name in ("status", "steps", "totals"):
                array = getattr(self._outcome, name)
                setattr(self._outcome, name, grown(array, (slots, _ample(jobs), *array.shape[2:])))
            if self._sensing is not None:
                self._sensing.make_room(_ample(jobs))
            self._grow_queue(slots * _ample(jobs))
            self._graph = None

    def _grow_episodes(self, episodes: int) -> None:
        before, slots = self._episodes, self._slots
        starts, keys = self._starts.here, self._keys.here.reshape(slots, before, 2)
        spread = np.tile(starts[0], (slots, episodes, 1))
        spread[:, :before] = starts[1:].reshape(slots, before, -1)
        self._starts = self._starts.resized(np.concatenate([starts[:1], spread.reshape(slots * episodes, -1)]))
        self._keys = self._keys.resized(widened(keys, (slots, episodes, 2)).reshape(-1, 2))
        of_world = self._doing.episode.numpy()
        self._doing.episode.assign(of_world // before * episodes + of_world % before)
        self._episodes = episodes

    def _grow_queue(self, room: int) -> None:
        """Enlarge the queue, so that all slots can be full; waiting jobs move to the front."""
        head = int(self._jobs.head.numpy()[0])
        waiting = self._queue.here[(head + np.arange(self._tail - head)) % len(self._queue.here)]
        self._queue = self._queue.resized(widened(waiting, (room, 4)))
        self._jobs.queue = self._queue.there
        self._jobs.head.zero_()
        self._move_tail(len(waiting))

    def _move_tail(self, tail: int) -> None:
        """Make known that jobs are queued up to `tail`.

        The number travels with the command: memory of the host may change before a queued copy reads it.
        """
        self._tail = tail
        self._jobs.tail.fill_(tail)


def _struct(struct: Any, shape: Any, dtype: type, *names: str) -> Any:
    for name in names:
        setattr(struct, name, wp.zeros(shape, dtype=dtype))
    return struct


def _ample(size: int) -> int:
    """A size with room for growth, since genomes get larger from generation to generation."""
    return size + size // 4 + 16
