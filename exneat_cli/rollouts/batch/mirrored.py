"""Arrays that the host writes and a device reads, and the other way round."""

from __future__ import annotations

from collections import deque
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray


class Mirrored:
    """An array on the current device and its copy in the host's memory, which is pinned for a GPU.

    Writing does not wait: copies are queued behind the device's other work. Before an entry is written again, the
    caller must know that it has been read.

    Attributes:
        there: the array on the device.
        here: the copy on the host, as the array will be once all writing is done.
    """

    def __init__(self, values: NDArray[Any], dtype: Any = None) -> None:
        dtype = dtype or wp.dtype_from_numpy(values.dtype)
        self.there = wp.array(values, dtype=dtype)
        self._source = wp.array(values, dtype=dtype, device="cpu", pinned=self.there.device.is_cuda)
        self.here: NDArray[Any] = self._source.numpy()

    def write(self, row: int, values: NDArray[Any]) -> None:
        """Set entries, starting at a row of the first axis."""
        first = row * self.here[0].size
        self.here.reshape(-1)[first : first + values.size] = values.ravel()
        numbers = self.here.size // self._source.size  # in each of the device's entries, which may be vectors
        place, count = first // numbers, values.size // numbers
        wp.copy(self.there, self._source, dest_offset=place, src_offset=place, count=count)

    def resized(self, values: NDArray[Any]) -> Mirrored:
        """A new one of the same type, with other values."""
        return Mirrored(values, self.there.dtype)


class Reported:
    """An array on the current device whose values reach the host one report late, so that the device need not wait.

    At most two reports may be on their way.
    """

    def __init__(self, there: Any) -> None:
        self._there, self._waits = there, there.device.is_cuda
        self._unused = [wp.empty(there.shape, there.dtype, device="cpu", pinned=self._waits) for _ in range(2)]
        self._sent: deque[tuple[Any, Any]] = deque()

    def send(self) -> None:
        """Queue a copy behind the device's other work."""
        copy = self._unused.pop()
        wp.copy(copy, self._there)
        self._sent.append((copy, wp.record_event() if self._waits else None))

    def take(self) -> NDArray[Any] | None:
        """The report before the last one, once it has come; None if there is none."""
        if len(self._sent) < 2:
            return None
        copy, event = self._sent.popleft()
        if event is not None:
            wp.synchronize_event(event)
        values: NDArray[Any] = copy.numpy().copy()
        self._unused.append(copy)
        return values


def widened(values: NDArray[Any], shape: tuple[int, ...]) -> NDArray[Any]:
    """The values, padded with zeros at the end of every axis that is longer in `shape`."""
    wide = np.zeros(shape, values.dtype)
    wide[tuple(map(slice, values.shape))] = values
    return wide


def grown(array: Any, shape: tuple[int, ...]) -> Any:
    """A larger array on the current device, with the same entries, padded with zeros; any stream may read it."""
    larger = wp.array(widened(array.numpy(), shape), dtype=array.dtype)
    wp.synchronize_device()
    return larger
