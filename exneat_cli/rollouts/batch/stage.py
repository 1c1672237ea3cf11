"""One batch of worlds with its queue of jobs: whatever runs there takes a slot, and worlds that end take the next job.

A control step is one program of kernels, captured as a CUDA graph on a GPU: take jobs, reset, observe, disturb, sense,
activate, drive, step, keep count. The host sees no more than how many episodes have ended.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from exneat_cli.brains import Brains
from exneat_cli.brains.batch import Programs, activate
from exneat_cli.brains.brain import memory_size
from exneat_cli.rollouts.batch import kernels
from exneat_cli.rollouts.batch.kernels import IDLE, Doing, Jobs, Outcome
from exneat_cli.rollouts.episode import Tally
from exneat_cli.seeding import EpisodeSeeds


class Stage:
    """W worlds and S slots.

    Args:
        worlds: as `HasBatch` opens them.
        sensor_std: sd of the normal noise on every reading.
        slots: S.
        sensed_size, action_size, terms: of the task.

    Attributes:
        control_steps: how many were done, of all worlds at once.
    """

    def __init__(
        self, worlds: Any, *, sensor_std: float, slots: int, sensed_size: int, action_size: int, terms: int
    ) -> None:
        self._worlds, self._sd, self._slots = worlds, sensor_std, slots
        self._sensed_size, self.control_steps = sensed_size, 0
        count = worlds.count
        self.device = worlds.status.device
        self._graph: Any = None
        with wp.ScopedDevice(self.device):
            self._programs = Programs()
            for name in Brains._fields[1:]:
                kind = float if name in ("edge_weight", "bias", "response") else int
                shape = (slots, 1, action_size) if name == "output_slot" else (slots, 1)
                setattr(self._programs, name, wp.zeros(shape, dtype=kind))
            self._keys = wp.zeros((slots, 2), dtype=wp.uint32)
            self._starts = wp.array(np.tile(worlds.resting_start(), (1 + slots, 1)))
            self._episodes = 1
            self._memory = wp.zeros((count, sensed_size + 1), dtype=float)
            framed = worlds.readings_size != sensed_size or worlds.is_framed
            self._readings = wp.zeros((count, worlds.readings_size), dtype=float) if framed else None
            self._action = wp.zeros((count, action_size), dtype=float)
            self._jobs = _struct(Jobs(), 1, int, "head", "tail", "slot", "brain", "episode", "place")
            self._doing = _struct(Doing(), count, int, "slot", "brain", "episode", "place", "steps")
            self._doing.totals = wp.zeros((count, terms), dtype=wp.float64)
            self._doing.brain.fill_(-1)
            self._outcome = _struct(Outcome(), (slots, 1), int, "status", "steps")
            self._outcome.totals = wp.zeros((slots, 1, terms), dtype=wp.float64)
            self._outcome.ended = wp.zeros(slots, dtype=int)
            self._overflow = wp.zeros(1, dtype=int)
            worlds.status.fill_(IDLE)
            self._program()  # compiles and loads all kernels, which a capture must not
        self._tail = 0

    def put(self, slot: int, brains: Brains, episodes: Sequence[EpisodeSeeds]) -> None:
        """Queue every brain in every episode; whatever had the slot before must be done."""
        count, jobs = len(brains.size), len(brains.size) * len(episodes)
        with wp.ScopedDevice(self.device):
            self._make_room(brains, len(episodes), jobs)
            for name in Brains._fields[1:]:
                _write(getattr(self._programs, name), slot, getattr(brains, name))
            starts = self._worlds.starts(episodes)
            first = slot * self._episodes
            wp.copy(self._starts, wp.array(starts), dest_offset=(1 + first) * starts.shape[1], count=starts.size)
            keys = np.array([each.sensor_noise.generate_state(2, np.uint32) for each in episodes], np.uint32)
            wp.copy(self._keys, wp.array(keys, dtype=wp.uint32), dest_offset=2 * first, count=keys.size)
            ended = self._outcome.ended.numpy()
            ended[slot] = 0
            self._outcome.ended.assign(ended)
            numbers = np.arange(jobs)
            columns = {"slot": np.full(jobs, slot), "place": numbers}
            columns |= {"brain": numbers % count, "episode": numbers // count}
            room = self._jobs.slot.shape[0]
            place = (self._tail + numbers) % room
            for name, values in columns.items():
                queued = getattr(self._jobs, name).numpy()
                queued[place] = values
                getattr(self._jobs, name).assign(queued)
            self._tail += jobs
            self._jobs.tail.assign([self._tail])

    def run(self, steps: int) -> tuple[NDArray[np.int32], bool]:
        """Do some control steps; returns (S,) how many episodes of each slot have ended, and whether room ran out."""
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
            self.control_steps += steps
            return self._outcome.ended.numpy(), bool(self._overflow.numpy()[0])

    def fetch(self, slot: int, tally: Tally) -> None:
        """Write what came of a slot whose episodes have all ended."""
        statuses, steps, totals = tally[:3]
        jobs, shape = statuses.size, statuses.shape
        statuses[:] = self._outcome.status[slot].numpy()[:jobs].reshape(shape)
        steps[:] = self._outcome.steps[slot].numpy()[:jobs].reshape(shape)
        totals[:] = self._outcome.totals[slot].numpy()[:jobs].reshape(*shape, -1)

    def _program(self) -> None:
        worlds, doing, count = self._worlds, self._doing, self._worlds.count
        memory = self._memory
        readings = memory if self._readings is None else self._readings
        taking = [self._jobs, doing, worlds.status, worlds.begins, self._episodes, memory]
        wp.launch(kernels.take_jobs, dim=count, inputs=taking)
        worlds.reset(self._starts)
        worlds.observe(readings)
        if self._sd > 0.0:
            size = worlds.readings_size
            wp.launch(kernels.disturb, dim=(count, -(-size // 4)), inputs=[self._keys, doing, self._sd, size, readings])
        worlds.sense(readings, memory)
        wp.launch(activate, dim=count, inputs=[self._programs, doing.slot, doing.brain, memory, self._action])
        worlds.drive(self._action)
        worlds.step()
        wp.launch(kernels.keep_count, dim=count, inputs=[worlds.status, worlds.terms, doing, self._outcome])
        worlds.note_overflows(self._overflow)

    def _make_room(self, brains: Brains, episodes: int, jobs: int) -> None:
        """Enlarge what is too small; what is there stays, and the program is captured anew."""
        grown = False
        for name in Brains._fields[1:]:
            array = getattr(self._programs, name)
            needed = len(getattr(brains, name))
            if needed > array.shape[1]:
                setattr(self._programs, name, _grown(array, (array.shape[0], _ample(needed), *array.shape[2:])))
                grown = True
        if memory_size(brains) > self._memory.shape[1]:
            self._memory = _grown(self._memory, (self._memory.shape[0], _ample(memory_size(brains))))
            grown = True
        if episodes > self._episodes:
            grown = True
            self._grow_episodes(episodes)
        if jobs > self._outcome.status.shape[1]:
            grown = True
            places = _ample(jobs)
            for name in ("status", "steps", "totals"):
                array = getattr(self._outcome, name)
                setattr(self._outcome, name, _grown(array, (array.shape[0], places, *array.shape[2:])))
            self._grow_queue(places)
        if grown:
            self._graph = None

    def _grow_episodes(self, episodes: int) -> None:
        before, slots = self._episodes, self._slots
        starts, keys = self._starts.numpy(), self._keys.numpy().reshape(slots, before, 2)
        spread = np.tile(starts[0], (slots, episodes, 1))
        spread[:, :before] = starts[1:].reshape(slots, before, -1)
        self._starts = wp.array(np.concatenate([starts[:1], spread.reshape(slots * episodes, -1)]))
        wider = np.zeros((slots, episodes, 2), np.uint32)
        wider[:, :before] = keys
        self._keys = wp.array(wider.reshape(-1, 2), dtype=wp.uint32)
        of_world = self._doing.episode.numpy()
        self._doing.episode.assign(of_world // before * episodes + of_world % before)
        self._episodes = episodes

    def _grow_queue(self, places: int) -> None:
        """Room for all slots to be full; what waits moves to the front."""
        head, room = int(self._jobs.head.numpy()[0]), self._jobs.slot.shape[0]
        waiting = (head + np.arange(self._tail - head)) % room
        for name in ("slot", "brain", "episode", "place"):
            values = np.zeros(self._slots * places, np.int32)
            values[: len(waiting)] = getattr(self._jobs, name).numpy()[waiting]
            setattr(self._jobs, name, wp.array(values))
        self._tail -= head
        self._jobs.head.assign([0])
        self._jobs.tail.assign([self._tail])


def _struct(struct: Any, shape: Any, dtype: type, *names: str) -> Any:
    for name in names:
        setattr(struct, name, wp.zeros(shape, dtype=dtype))
    return struct


def _ample(size: int) -> int:
    """Room for some growth: genomes get larger from generation to generation."""
    return size + size // 4 + 16


def _grown(array: Any, shape: tuple[int, ...]) -> Any:
    values = np.zeros(shape, array.numpy().dtype)
    values[tuple(slice(size) for size in array.shape)] = array.numpy()
    return wp.array(values, dtype=array.dtype)


def _write(array: Any, slot: int, values: NDArray[Any]) -> None:
    kind = np.float32 if values.dtype.kind == "f" else np.int32
    flat = wp.array(np.ascontiguousarray(values.astype(kind)).reshape(-1))
    row = int(np.prod(array.shape[1:]))
    if flat.size:
        wp.copy(array.flatten(), flat, dest_offset=slot * row, count=flat.size)
