"""Arrays that the host writes and a device reads."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray


class Mirrored:
    """An array on the current device and its likeness in memory of the host that the device reads by itself.

    Writing waits for nothing: copies are queued behind what the device has to do. Who writes an entry anew must know
    that it was read.

    Attributes:
        there: on the device.
        here: (the same shape) as it will be there.
    """

    def __init__(self, values: NDArray[Any], dtype: Any = None) -> None:
        dtype = dtype or wp.dtype_from_numpy(values.dtype)
        self.there = wp.array(values, dtype=dtype)
        self._source = wp.array(values, dtype=dtype, device="cpu", pinned=self.there.device.is_cuda)
        self.here: NDArray[Any] = self._source.numpy()

    def write(self, row: int, values: NDArray[Any]) -> None:
        """Set entries from the begin of a row of the first axis on."""
        first = row * self.here[0].size
        self.here.reshape(-1)[first : first + values.size] = values.ravel()
        numbers = self.here.size // self._source.size  # in each of the device's entries, which may be vectors
        place, count = first // numbers, values.size // numbers
        wp.copy(self.there, self._source, dest_offset=place, src_offset=place, count=count)

    def resized(self, values: NDArray[Any]) -> Mirrored:
        """Another one of the same kind."""
        return Mirrored(values, self.there.dtype)


def widened(values: NDArray[Any], shape: tuple[int, ...]) -> NDArray[Any]:
    """The same with zeros behind it on every axis that is to be longer."""
    wide = np.zeros(shape, values.dtype)
    wide[tuple(map(slice, values.shape))] = values
    return wide


def grown(array: Any, shape: tuple[int, ...]) -> Any:
    """A larger array on the current device; what is there stays, and zeros are behind it."""
    return wp.array(widened(array.numpy(), shape), dtype=array.dtype)
